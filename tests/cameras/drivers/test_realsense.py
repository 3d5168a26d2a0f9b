"""The driver of RealSense keeps the contract against the software device of its own library."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from handeye.cameras.drivers import realsense
from handeye.cameras.drivers.realsense import RealSenseCamera
from handeye.datasets.camera_files import read_camera
from handeye.errors import DeviceError, InputError
from handeye.testing import CameraTests
from handeye.testing.realsense import MockRealSense

pytest.importorskip(
    "pyrealsense2", reason="pyrealsense2 is not installed (extra realsense)", exc_type=ImportError
)
SIZE = (64, 48)


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[MockRealSense]:
    made = MockRealSense(SIZE)
    # The library does not list software devices among those that are there.
    monkeypatch.setattr(realsense, "_devices", lambda _: [made.device])
    monkeypatch.setattr(realsense, "GRAB_S", 0.5)
    yield made
    made.close()


@pytest.fixture
def camera(device: MockRealSense) -> Iterator[RealSenseCamera]:
    made = RealSenseCamera("1234")
    yield made
    made.close()


class TestContract(CameraTests):
    @pytest.fixture
    def size_px(self) -> tuple[int, int]:
        return SIZE

    @pytest.fixture
    def change(self, device: MockRealSense) -> Callable[[], None]:
        def change() -> None:
            device.seen = device.seen + 7

        return change

    @pytest.fixture
    def cable(self, device: MockRealSense) -> tuple[Callable[[], None], Callable[[], None]]:
        return device.cut, device.mend


def test_what_the_factory_measured_is_read(camera: RealSenseCamera, tmp_path: Any) -> None:
    import json

    (tmp_path / "camera.json").write_text(json.dumps(camera.intrinsics()))
    found = read_camera(tmp_path / "camera.json")
    assert found.lens == "brown_conrady_5"
    assert found.size_px == SIZE
    assert np.allclose(found.parameters, [60, 61, 32.25, 23.75, 0.1, -0.2, 0.001, 0.002, 0.05])


def test_sizes_and_cameras_that_are_not_there_are_named(device: MockRealSense) -> None:
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
