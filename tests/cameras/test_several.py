"""Several cameras are told to expose at once; each frame is given once; a camera that fails is named."""

import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from handeye.cameras.protocol import Frame
from handeye.cameras.several import SeveralCameras
from handeye.errors import DeviceError


class Slow:
    """A camera that begins its exposure at once, and needs a while to send it; it meets the others at a barrier."""

    def __init__(self, grey: int, together: threading.Barrier | None = None) -> None:
        self.grey, self.together = grey, together
        self.exposed_s: list[float] = []
        self.labels: list[str] = []
        self.error: Exception | None = None

    def grab(self, label: str) -> Frame:
        self.exposed_s.append(time.monotonic())
        self.labels.append(label)
        if self.together is not None:
            self.together.wait(5)  # breaks where the others only begin afterwards
        if self.error is not None:
            raise self.error
        return Frame(np.full((2, 3), self.grey + len(self.labels), np.uint8))


@pytest.fixture
def cameras() -> dict[str, Slow]:
    together = threading.Barrier(3)
    return {name: Slow(10 * k, together) for k, name in enumerate(("left", "right", "front"))}


def grey(frame: Frame) -> int:
    assert frame.image is not None
    return int(frame.image[0, 0])


def test_all_expose_before_any_is_waited_for(cameras: dict[str, Slow]) -> None:
    rig = SeveralCameras(cameras)
    frames = rig.grab("station_01.1")
    assert {name: grey(frame) for name, frame in frames.items()} == {"left": 1, "right": 11, "front": 21}


def test_each_eye_gets_its_frame_of_the_stop(cameras: dict[str, Slow]) -> None:
    rig = SeveralCameras(cameras)
    eyes = rig.eyes()
    assert [grey(eyes[name].grab("station_01.1")) for name in ("front", "left", "right")] == [21, 1, 11]
    assert [grey(eyes[name].grab("station_02.1")) for name in ("left", "right", "front")] == [2, 12, 22]
    # Asked again at the same stop: a new exposure, not the old frame.
    assert grey(eyes["left"].grab("station_02.1")) == 3
    assert cameras["left"].labels == ["station_01.1", "station_02.1", "station_02.1"]


def test_a_stop_that_was_given_up_leaves_nothing_behind(cameras: dict[str, Slow]) -> None:
    rig = SeveralCameras(cameras)
    eyes = rig.eyes()
    eyes["left"].grab("station_01.1")
    assert grey(eyes["right"].grab("station_01.2")) == 12, "a frame of the stop before"
    cameras["front"].error = DeviceError("cable", code="no_image", hint="check the cable")
    assert grey(eyes["left"].grab("station_02.1")) == 3, "the others keep theirs"
    with pytest.raises(DeviceError, match="camera front: cable") as caught:
        eyes["front"].grab("station_02.1")
    assert (caught.value.code, caught.value.hint) == ("no_image", "check the cable")
    cameras["front"].error = ValueError("nonsense")
    with pytest.raises(DeviceError, match="camera front: nonsense") as caught:
        rig.grab("station_02.2")
    assert caught.value.code == "driver_failed"
    cameras["front"].error = None
    assert grey(eyes["left"].grab("station_02.3")) == 5


HANGS = """
import threading
from handeye.cameras.protocol import Frame
from handeye.cameras.several import SeveralCameras

class Hanging:
    def grab(self, label):
        threading.Event().wait()

rig = SeveralCameras({"left": Hanging(), "right": Hanging()})
threading.Thread(target=rig.grab, args=("station_01.1",), daemon=True).start()
while sum(thread.name == "camera" for thread in threading.enumerate()) < 2:
    pass
print("ends")
"""


def test_the_program_ends_though_a_camera_hangs() -> None:
    line = [sys.executable, "-c", HANGS]
    ended = subprocess.run(line, check=False, capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (0, "ends\n"), ended.stderr


def test_a_frame_is_given_once_for_each_target_looked_for(cameras: dict[str, Slow]) -> None:
    rig = SeveralCameras(cameras)
    eyes = rig.eyes(dict.fromkeys(cameras, 2))
    asked = ["left", "left", "right", "front", "right", "front"]
    assert [grey(eyes[name].grab("station_01.1")) for name in asked] == [1, 1, 11, 21, 11, 21]
    assert grey(eyes["left"].grab("station_01.1")) == 2
