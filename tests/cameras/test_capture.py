"""A camera behind OpenCV: pictures that wait in its queue are not believed to be of now."""

import numpy as np
import pytest

from handeye.cameras import capture
from handeye.cameras.capture import Capture
from handeye.errors import DeviceError


class Device:
    """A queue of pictures, each with the number of its exposure as its grey value."""

    def __init__(self, _source: object) -> None:
        self.exposed = 0
        self.queue: list[int] = []
        self.broken = False

    def isOpened(self) -> bool:
        return True

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


def test_what_waits_in_the_queue_is_thrown_away(monkeypatch: pytest.MonkeyPatch) -> None:
    device = Device(0)
    monkeypatch.setattr(capture.cv2, "VideoCapture", lambda _: device)
    camera = Capture(0)
    for label in ("view_01.1", "view_02.1"):
        for _ in range(10):
            device.expose()
        before = device.exposed
        frame = camera.grab(label)
        assert frame.image is not None
        assert frame.image.shape == (6, 8)
        assert frame.image[0, 0] > before
    device.broken = True
    with pytest.raises(DeviceError, match="no picture for view_03"):
        camera.grab("view_03.1")
