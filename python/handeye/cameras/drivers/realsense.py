"""RealSense cameras, by their own library (extra `realsense`). Not tried on a real camera."""

import threading
import time
from typing import Any

import cv2
import numpy as np

from handeye.cameras.protocol import Frame, Grey
from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.extension import library

GRAB_S, POLL_S = 5.0, 0.005
# The exposure of the first picture that comes may have begun before it was asked for.
SKIPPED = 1
STREAMS = ("color", "infrared")
COLOURS = {"rgb8": cv2.COLOR_RGB2GRAY, "bgr8": cv2.COLOR_BGR2GRAY}
FORMATS = (*COLOURS, "y8")
USUAL_SIZE = (1280, 720)


class RealSenseCamera:
    """One stream of a camera: colour, or infrared with the projector's dots off.

    Parameters
    ----------
    address
        Serial number, or nothing for the only camera; after a comma `color` or `infrared`; after another the
        size, such as 1920x1080 (1280x720 where it is not said and the camera has it).

    Raises
    ------
    InputError
        An address of another form.
    DeviceError
        The library, the camera or the stream is not there.
    """

    def __init__(self, address: str) -> None:
        serial, _, rest = address.partition(",")
        stream, _, size = rest.partition(",")
        width, _, height = size.partition("x")
        if stream not in {"", *STREAMS} or (size and not (width.isdecimal() and height.isdecimal())):
            raise InputError(
                f"address {address[:60]!r}, expected SERIAL,color,1280x720", code=Code.BAD_ADDRESS
            )
        self._serial, self._stream = serial, stream or STREAMS[0]
        self._size = (int(width), int(height)) if size else None
        self._rs = library("pyrealsense2", "realsense")
        self._one_at_a_time = threading.Lock()
        self._sensor: Any = None
        self._profile: Any = None
        self._queue: Any = None
        with self._one_at_a_time:
            self._open()

    @staticmethod
    def found() -> list[tuple[str, str]]:
        """Return the serial number and the model of each camera that is there.

        Raises
        ------
        DeviceError
            The library is not there.
        """
        rs = library("pyrealsense2", "realsense")
        return [
            (_info(each, rs.camera_info.serial_number), _info(each, rs.camera_info.name))
            for each in _devices(rs)
        ]

    def intrinsics(self) -> dict[str, Any]:
        """Return what the factory measured, as librealsense writes it, without a covariance."""
        known = self._profile.as_video_stream_profile().get_intrinsics()
        return {
            "width": known.width,
            "height": known.height,
            "ppx": known.ppx,
            "ppy": known.ppy,
            "fx": known.fx,
            "fy": known.fy,
            "model": str(known.model).rpartition(".")[2],
            "coeffs": list(known.coeffs),
        }

    def grab(self, label: str) -> Frame:
        """Return a picture exposed after now, as 8 bits of grey.

        Raises
        ------
        DeviceError
            `no_image`; a camera that was lost is opened again at the next call.
        """
        with self._one_at_a_time:
            try:
                if self._sensor is None:
                    self._open()
                while self._queue.poll_for_frame():
                    pass  # from before the question
                for _ in range(SKIPPED):
                    self._next()
                frame = self._next()
                return Frame(self._grey(frame), timestamp_s=float(frame.get_timestamp()) / 1e3)
            except RuntimeError as error:
                self._forget()
                raise DeviceError(
                    f"{label}: camera {self._serial or '(the only one)'}: {str(error).strip()}",
                    code=Code.NO_IMAGE,
                    hint="check the cable (USB 3) and that no other program has the camera",
                ) from error

    def close(self) -> None:
        """Let go of the camera."""
        with self._one_at_a_time:
            self._forget()

    def _next(self) -> Any:  # noqa: ANN401 - a frame of librealsense
        """Return the next frame, waited for so that others can run."""
        end = time.monotonic() + GRAB_S
        while time.monotonic() < end:
            frame = self._queue.poll_for_frame()
            if frame:
                return frame
            time.sleep(POLL_S)
        raise RuntimeError(f"no picture within {GRAB_S:.0f} s")

    def _grey(self, frame: Any) -> Grey:  # noqa: ANN401 - a frame of librealsense
        pixels = np.asanyarray(frame.get_data())
        if pixels.ndim == 2:
            return np.array(pixels, dtype=np.uint8)
        name = str(self._profile.format()).rpartition(".")[2]
        return np.array(cv2.cvtColor(pixels, COLOURS[name]), dtype=np.uint8)

    def _open(self) -> None:
        rs = self._rs
        there = _devices(rs)
        serials = [_info(each, rs.camera_info.serial_number) for each in there]
        fitting = [each for each, serial in zip(there, serials, strict=True) if self._serial in {"", serial}]
        if len(fitting) != 1:
            listed = ", ".join(serials) or "none"
            raise DeviceError(
                f"camera {self._serial or '(the only one)'}: not found; there are: {listed}",
                code=Code.NO_CAMERA,
                hint="name one by its serial number, such as realsense:832112070000",
            )
        try:
            self._sensor, self._profile = self._chosen(fitting[0])
            self._queue = rs.frame_queue(2)
            self._sensor.open(self._profile)
            self._sensor.start(self._queue)
        except RuntimeError as error:
            self._sensor = None
            raise DeviceError(
                f"camera {self._serial}: {str(error).strip()}",
                code=Code.NO_CAMERA,
                hint="is another program using it?",
            ) from error

    def _chosen(self, device: Any) -> tuple[Any, Any]:  # noqa: ANN401 - of librealsense
        """Return the sensor and the profile: of the stream, in a format that is known, of the size."""
        known: list[tuple[tuple[int, int], Any, Any]] = []
        for sensor in device.sensors:
            for profile in sensor.get_stream_profiles():
                kind = str(profile.stream_type()).rpartition(".")[2]
                form = str(profile.format()).rpartition(".")[2]
                if kind == self._stream and form in FORMATS:
                    video = profile.as_video_stream_profile()
                    known.append(((video.width(), video.height()), sensor, profile))
        sizes = {size for size, _, _ in known}
        wanted = self._size or (USUAL_SIZE if USUAL_SIZE in sizes else max(sizes, default=None))
        if wanted not in sizes:
            listed = ", ".join(f"{w}x{h}" for w, h in sorted(sizes)) or "none"
            raise DeviceError(
                f"camera {self._serial}: no {self._stream} of the size asked for; there are: {listed}",
                code=Code.NO_CAMERA,
            )
        return next((sensor, profile) for size, sensor, profile in known if size == wanted)

    def _forget(self) -> None:
        sensor, self._sensor = self._sensor, None
        if sensor is not None:
            for end in (sensor.stop, sensor.close):
                try:
                    end()
                except RuntimeError:  # it may be gone already
                    continue


def _devices(rs: Any) -> list[Any]:  # noqa: ANN401 - of librealsense
    return list(rs.context().query_devices())


def _info(device: Any, what: Any) -> str:  # noqa: ANN401 - of librealsense
    return str(device.get_info(what)) if device.supports(what) else ""
