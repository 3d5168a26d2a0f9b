"""A camera behind OpenCV: pictures that wait in its queue are not believed to be of now."""

from collections.abc import Callable

import numpy as np
import pytest

from handeye.cameras import capture
from handeye.cameras.capture import Capture
from handeye.errors import DeviceError
from handeye.testing import CameraTests


class Device:
    """A queue of pictures, each with the number of its exposure as its grey value."""

    def __init__(self, _source: object) -> None:
        self.exposed = 0
        self.queue: list[int] = []
        self.broken = False
        self.opened = 0

    def isOpened(self) -> bool:
        self.opened += 1
        return not self.broken

    def release(self) -> None:
        self.queue.clear()

    def expose(self) -> None:
        """Expose as a camera that runs freely does: what does not fit the queue is lost."""
        self.exposed += 1
        if len(self.queue) < 4:
            self.queue.append(self.exposed)

    def grab(self) -> bool:
        if not self.queue:
            self.expose()
        self.queue.pop(0)
        return True

    def read(self) -> tuple[bool, np.ndarray | None]:
        if self.broken:
            return False, None
        if not self.queue:
            self.expose()
        return True, np.full((6, 8, 3), self.queue.pop(0), dtype=np.uint8)


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Device:
    made = Device(0)
    monkeypatch.setattr(capture.cv2, "VideoCapture", lambda _: made)
    return made


class TestContract(CameraTests):
    @pytest.fixture
    def camera(self, device: Device) -> Capture:
        return Capture(0)

    @pytest.fixture
    def size_px(self) -> tuple[int, int]:
        return (8, 6)

    @pytest.fixture
    def change(self, device: Device) -> Callable[[], None]:
        return device.expose

    @pytest.fixture
    def cable(self, device: Device) -> tuple[Callable[[], None], Callable[[], None]]:
        return (lambda: setattr(device, "broken", True)), (lambda: setattr(device, "broken", False))


def test_what_waits_in_the_queue_is_thrown_away(device: Device) -> None:
    camera = Capture(0)
    for label in ("view_01.1", "view_02.1"):
        for _ in range(10):
            device.expose()
        before = device.exposed
        frame = camera.grab(label)
        assert frame.image is not None
        assert frame.image.shape == (6, 8)
        assert frame.image[0, 0] > before


def test_a_camera_that_was_lost_is_opened_again(device: Device) -> None:
    camera = Capture(0)
    device.broken = True
    with pytest.raises(DeviceError, match="no picture for view_01") as caught:
        camera.grab("view_01.1")
    assert caught.value.code == "no_image"
    with pytest.raises(DeviceError, match="cannot be opened") as caught:
        camera.grab("view_01.2")
    assert caught.value.code == "no_camera"
    device.broken = False
    assert camera.grab("view_01.3").image is not None
    assert device.opened == 3
