"""The driver of GenICam keeps the contract against the producer that ships with the library genicam."""

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from handeye.cameras.drivers import genicam
from handeye.cameras.drivers.genicam import GenicamCamera
from handeye.errors import DeviceError
from handeye.testing import CameraTests
from partners import genicam_cable


@pytest.fixture
def producer(monkeypatch: pytest.MonkeyPatch) -> Path:
    pytest.importorskip("harvesters", reason="harvesters is not installed (extra genicam)")
    shipped = Path(str(pytest.importorskip("genicam").__file__)).parent
    monkeypatch.setenv(genicam.PRODUCERS, str(shipped))
    return shipped / "viky.cti"


class TestContract(CameraTests):
    @pytest.fixture
    def camera(self, producer: Path) -> Iterator[GenicamCamera]:
        made = GenicamCamera(GenicamCamera.found()[0][0])
        yield made
        made.close()

    @pytest.fixture
    def size_px(self) -> tuple[int, int]:
        return (400, 400)

    @pytest.fixture
    def cable(self, camera: GenicamCamera) -> tuple[Callable[[], None], Callable[[], None]]:
        return genicam_cable(camera)


def test_two_cameras_at_one_stop(producer: Path) -> None:
    names = [name for name, _ in GenicamCamera.found()]
    assert len(names) == 3
    cameras = [GenicamCamera(f"{name},{producer}") for name in names[:2]]
    for camera in cameras:
        assert camera.grab("view_01.1").image is not None
    for camera in cameras:
        camera.close()


def test_what_is_not_there_is_named(producer: Path) -> None:
    for address, words in (("", "not found"), ("nobody", "there are"), (",/missing.cti", "no such producer")):
        with pytest.raises(DeviceError, match=words):
            GenicamCamera(address)


@pytest.mark.parametrize("form", [*genicam.BITS, *genicam.COLOURS])
def test_every_known_format_becomes_grey(form: str) -> None:
    channels = 4 if "a8" in form else 3 if form in {"RGB8", "BGR8"} else 1
    bits = genicam.BITS.get(form, 8)
    data = np.full(6 * 8 * channels, (1 << bits) - 1, np.uint16 if bits > 8 else np.uint8)
    component = SimpleNamespace(data_format=form, height=6, width=8, data=data)
    grey = genicam._grey("view_01.1", component)
    assert (grey.shape, grey.dtype) == ((6, 8), np.uint8)
    assert (grey == 255).all()


def test_an_unknown_format_is_said() -> None:
    component = SimpleNamespace(data_format="Coord3D_C16", height=6, width=8, data=np.zeros(48))
    with pytest.raises(DeviceError, match="Coord3D_C16"):
        genicam._grey("view_01.1", component)
