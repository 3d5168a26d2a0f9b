"""The driver of RealSense keeps the contract against the software device of its own library."""

import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from handeye.cameras.drivers import realsense
from handeye.cameras.drivers.realsense import RealSenseCamera
from handeye.datasets.camera_files import read_camera
from handeye.errors import DeviceError, InputError
from handeye.testing import CameraTests

rs: Any = pytest.importorskip(
    "pyrealsense2", reason="pyrealsense2 is not installed (extra realsense)", exc_type=ImportError
)
SIZE = (64, 48)


class SoftwareDevice:
    """Two streams, whose pictures come from a thread."""

    def __init__(self) -> None:
        self.seen, self.silent, self.closed = 10, False, threading.Event()
        self.device = rs.software_device()
        self.device.register_info(rs.camera_info.name, "made up")
        self.device.register_info(rs.camera_info.serial_number, "1234")
        self.sensor = self.device.add_sensor("RGB Camera")
        self.profile = self.sensor.add_video_stream(self._stream(*SIZE))
        self.sensor.add_video_stream(self._stream(32, 24))
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self.closed.set()
        self._thread.join()

    def _stream(self, width: int, height: int) -> Any:
        known = rs.intrinsics()
        known.width, known.height, known.fx, known.fy = width, height, 60.0, 61.0
        known.ppx, known.ppy = width / 2 + 0.25, height / 2 - 0.25
        known.model, known.coeffs = rs.distortion.brown_conrady, [0.1, -0.2, 0.001, 0.002, 0.05]
        made = rs.video_stream()
        made.type, made.index, made.uid, made.fps, made.bpp = rs.stream.color, 0, width, 30, 3
        made.width, made.height, made.fmt, made.intrinsics = width, height, rs.format.rgb8, known
        return made

    def _run(self) -> None:
        number = 0
        while not self.closed.wait(0.02):
            if self.silent:
                continue
            number += 1
            frame = rs.software_video_frame()
            frame.stride, frame.bpp, frame.frame_number = SIZE[0] * 3, 3, number
            frame.timestamp, frame.domain = 20.0 * number, rs.timestamp_domain.system_time
            frame.profile = self.profile.as_video_stream_profile()
            frame.pixels = np.full((SIZE[1], SIZE[0], 3), self.seen % 256, np.uint8)
            self.sensor.on_video_frame(frame)


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[SoftwareDevice]:
    made = SoftwareDevice()
    # The library does not list software devices among those that are there.
    monkeypatch.setattr(realsense, "_devices", lambda _: [made.device])
    monkeypatch.setattr(realsense, "GRAB_S", 0.5)
    yield made
    made.close()


@pytest.fixture
def camera(device: SoftwareDevice) -> Iterator[RealSenseCamera]:
    made = RealSenseCamera("1234")
    yield made
    made.close()


class TestContract(CameraTests):
    @pytest.fixture
    def size_px(self) -> tuple[int, int]:
        return SIZE

    @pytest.fixture
    def change(self, device: SoftwareDevice) -> Callable[[], None]:
        def change() -> None:
            device.seen += 7

        return change

    @pytest.fixture
    def cable(self, device: SoftwareDevice) -> tuple[Callable[[], None], Callable[[], None]]:
        return (lambda: setattr(device, "silent", True)), (lambda: setattr(device, "silent", False))


def test_what_the_factory_measured_is_read(camera: RealSenseCamera, tmp_path: Any) -> None:
    import json

    (tmp_path / "camera.json").write_text(json.dumps(camera.intrinsics()))
    found = read_camera(tmp_path / "camera.json")
    assert found.lens == "brown_conrady_5"
    assert found.size_px == SIZE
    assert np.allclose(found.parameters, [60, 61, 32.25, 23.75, 0.1, -0.2, 0.001, 0.002, 0.05])


def test_sizes_and_cameras_that_are_not_there_are_named(device: SoftwareDevice) -> None:
    for address, words in (
        ("1234,color,640x480", "there are: 32x24, 64x48"),
        ("1234,infrared", "there are: none"),
        ("99", "there are: 1234"),
    ):
        with pytest.raises(DeviceError, match=words) as caught:
            RealSenseCamera(address)
        assert caught.value.code == "no_camera"
    for address in ("1234,depth", "1234,color,big"):
        with pytest.raises(InputError):
            RealSenseCamera(address)
    assert RealSenseCamera.found() == [("1234", "made up")]
