"""A software device of librealsense, which the library takes for a camera (extra `realsense`).

Two streams of colour, one of them smaller; pictures come from a thread. The library does not list it among
the cameras that are there. Not shown: USB, exposure, infrared, other models of distortion.
"""

import threading
from typing import Any

import numpy as np

from handeye.cameras.protocol import Grey
from handeye.extension import library

SERIAL, PERIOD_S = "1234", 0.02
# Of the factory: focal lengths, centre off the middle, and coefficients of Brown and Conrady.
FOCAL_PX, OFF_PX, COEFFICIENTS = (60.0, 61.0), (0.25, -0.25), [0.1, -0.2, 0.001, 0.002, 0.05]


class MockRealSense:
    """A camera that sends what it sees until it is closed.

    Parameters
    ----------
    size_px
        Width and height of its pictures.
    """

    def __init__(self, size_px: tuple[int, int]) -> None:
        rs: Any = library("pyrealsense2", "realsense")
        self._rs, self._size_px = rs, size_px
        self.seen: Grey = np.full(size_px[::-1], 10, np.uint8)
        self._silent, self._closed = threading.Event(), threading.Event()
        self.device = rs.software_device()
        self.device.register_info(rs.camera_info.name, "made up")
        self.device.register_info(rs.camera_info.serial_number, SERIAL)
        self._sensor = self.device.add_sensor("RGB Camera")
        self._profile = self._sensor.add_video_stream(self._stream(*size_px))
        self._sensor.add_video_stream(self._stream(size_px[0] // 2, size_px[1] // 2))
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def cut(self) -> None:
        """Send nothing."""
        self._silent.set()

    def mend(self) -> None:
        """Send again."""
        self._silent.clear()

    def close(self) -> None:
        """End it."""
        self._closed.set()
        self._thread.join()

    def _stream(self, width: int, height: int) -> Any:  # noqa: ANN401 - of librealsense
        rs = self._rs
        known = rs.intrinsics()
        known.width, known.height = width, height
        known.fx, known.fy = FOCAL_PX
        known.ppx, known.ppy = width / 2 + OFF_PX[0], height / 2 + OFF_PX[1]
        known.model, known.coeffs = rs.distortion.brown_conrady, COEFFICIENTS
        made = rs.video_stream()
        made.type, made.index, made.uid, made.fps, made.bpp = rs.stream.color, 0, width, 30, 3
        made.width, made.height, made.fmt, made.intrinsics = width, height, rs.format.rgb8, known
        return made

    def _run(self) -> None:
        number = 0
        while not self._closed.wait(PERIOD_S):
            if self._silent.is_set():
                continue
            number += 1
            frame = self._rs.software_video_frame()
            frame.stride, frame.bpp, frame.frame_number = self._size_px[0] * 3, 3, number
            frame.timestamp = 1e3 * PERIOD_S * number
            frame.domain = self._rs.timestamp_domain.system_time
            frame.profile = self._profile.as_video_stream_profile()
            frame.pixels = np.repeat(self.seen[..., np.newaxis], 3, axis=2)
            self._sensor.on_video_frame(frame)
