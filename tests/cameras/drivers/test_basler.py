"""The driver of Basler keeps the contract against pylon's emulator of cameras."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from handeye.cameras.drivers.basler import BaslerCamera
from handeye.cameras.protocol import ImageSource
from handeye.cameras.several import SeveralCameras
from handeye.errors import DeviceError
from handeye.testing import CameraTests

os.environ.setdefault("PYLON_CAMEMU", "2")  # read when the library is loaded
pytest.importorskip("pypylon.pylon", reason="pypylon is not installed (extra basler)")

ONE, OTHER = "0815-0000", "0815-0001"


class Emulated:
    """What the emulated camera sees: a file, read at each exposure."""

    def __init__(self, folder: Path) -> None:
        self.file, self.settings = folder / "scene.png", folder / "camera.pfs"
        self.grey = 0
        self.change()
        camera = BaslerCamera(ONE)._camera
        camera.ImageFileMode.Value, camera.TestImageSelector.Value = "On", "Off"
        camera.ImageFilename.Value = str(self.file)
        camera.Width.Value, camera.Height.Value = 320, 240
        from pypylon.pylon import FeaturePersistence

        FeaturePersistence.Save(str(self.settings), camera.GetNodeMap())
        camera.Close()

    def change(self) -> None:
        self.grey += 20
        cv2.imwrite(str(self.file), np.full((240, 320), self.grey, np.uint8))


@pytest.fixture
def emulated(tmp_path: Path) -> Emulated:
    return Emulated(tmp_path)


@pytest.fixture
def camera(emulated: Emulated) -> Iterator[BaslerCamera]:
    made = BaslerCamera(f"{ONE},{emulated.settings}")
    yield made
    made.close()


class TestContract(CameraTests):
    @pytest.fixture
    def size_px(self) -> tuple[int, int]:
        return (320, 240)

    @pytest.fixture
    def change(self, emulated: Emulated) -> Callable[[], None]:
        return emulated.change

    @pytest.fixture
    def cable(self, camera: BaslerCamera) -> tuple[Callable[[], None], Callable[[], None]]:
        return (camera._camera.DestroyDevice), (lambda: None)


def test_a_picture_that_is_cut_short_is_refused(camera: BaslerCamera) -> None:
    camera._camera.ForceFailedBufferCount.Value = 1
    camera._camera.ForceFailedBuffer.Execute()
    with pytest.raises(DeviceError, match="broken picture"):
        camera.grab("view_01.1")
    assert camera.grab("view_01.2").image is not None


def test_colours_and_more_bits_become_grey(camera: BaslerCamera) -> None:
    for kind in ("RGB8Packed", "Mono12", "BayerRG8"):
        camera._camera.PixelFormat.Value = kind
        image = camera.grab("view_01.1").image
        assert image is not None
        assert (image.shape, image.dtype) == ((240, 320), np.uint8)


def test_two_cameras_at_one_stop(camera: ImageSource) -> None:
    other = BaslerCamera(OTHER)
    rig = SeveralCameras({"left": camera, "right": other})
    shapes = {name: eye.grab("station_01.1").image.shape for name, eye in rig.eyes().items()}  # type: ignore[union-attr]
    other.close()
    assert shapes["left"] == (240, 320)
    assert shapes["right"] != (240, 320)


@pytest.mark.parametrize("address", ["", "40012345", f"{ONE},missing.pfs"])
def test_what_is_not_there_is_named(address: str) -> None:
    with pytest.raises(DeviceError) as caught:
        BaslerCamera(address)
    assert caught.value.code == "no_camera"
