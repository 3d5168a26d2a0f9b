"""The driver of cameras in ROS 2: without ROS against a made-up link, with it against a process on loopback."""

import threading
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from handeye.cameras.drivers import ros2
from handeye.cameras.drivers.ros2 import Ros2Camera, grey_of
from handeye.errors import DeviceError, InputError
from handeye.testing import CameraTests
from ros2_peer import Peer

# Parsers that ROS brings along are older than this Python.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

SIZE = (64, 48)


class FakeLink:
    """Stands for a node: a thread hands over messages, exposed a moment before."""

    seen = 10
    delay_s = 0.05
    offset_s = 0.0
    info_offset_s = 0.0
    focal = 50.0
    silent = False

    def __init__(self, *_: object) -> None:
        self.takers: dict[str, Callable[[Any], None]] = {}
        self.closed = threading.Event()
        FakeLink.last = self

    def now_s(self) -> float:
        return time.time()

    def subscribe(self, kind: str, topic: str, take: Callable[[Any], None], *, latched: bool = False) -> None:
        self.takers[topic] = take
        if len(self.takers) == 2:
            threading.Thread(target=self._run, daemon=True).start()

    def topics(self, kind: str) -> list[str]:
        return ["/other/image"] if kind.endswith("Image") else []

    def close(self) -> None:
        self.closed.set()

    def _run(self) -> None:
        exposed: list[tuple[float, int]] = []
        while not self.closed.wait(0.02):
            exposed.append((time.time(), self.seen))
            while exposed and exposed[0][0] + self.delay_s < time.time():
                at_s, grey = exposed.pop(0)
                if not self.silent:
                    self.takers["/camera/camera_info"](self._info(at_s + self.offset_s + self.info_offset_s))
                    self.takers["/camera/image_raw"](message(grey, at_s + self.offset_s))

    def _info(self, at_s: float) -> SimpleNamespace:
        k = [self.focal, 0, 32, 0, self.focal, 24, 0, 0, 1]
        return SimpleNamespace(
            header=header(at_s), width=64, height=48, k=k, d=[0.0] * 5, distortion_model="plumb_bob"
        )


def header(at_s: float) -> SimpleNamespace:
    return SimpleNamespace(stamp=SimpleNamespace(sec=int(at_s), nanosec=int(1e9 * (at_s - int(at_s)))))


def message(grey: int, at_s: float = 1.0, **changed: object) -> SimpleNamespace:
    width, height = SIZE
    values: dict[str, Any] = {
        "header": header(at_s),
        "width": width,
        "height": height,
        "step": width,
        "encoding": "mono8",
        "is_bigendian": 0,
        "data": np.full((height, width), grey, np.uint8).tobytes(),
    }
    return SimpleNamespace(**(values | changed))


@pytest.fixture
def link(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[FakeLink]]:
    made = type("Link", (FakeLink,), {})
    monkeypatch.setattr(ros2, "RosLink", made)
    monkeypatch.setattr(
        ros2, "ros_library", lambda _: SimpleNamespace(Image="Image", CameraInfo="CameraInfo")
    )
    monkeypatch.setattr(ros2, "GRAB_S", 1.5)
    monkeypatch.setattr(ros2, "STARTS_S", 1.5)
    monkeypatch.setattr(ros2, "INFO_S", 1.0)
    yield made
    FakeLink.last.close()


@pytest.fixture
def camera(link: type[FakeLink]) -> Ros2Camera:
    return Ros2Camera("")


class TestContract(CameraTests):
    @pytest.fixture
    def size_px(self) -> tuple[int, int]:
        return SIZE

    @pytest.fixture
    def change(self, link: type[FakeLink]) -> Callable[[], None]:
        def change() -> None:
            link.seen += 7

        return change

    @pytest.fixture
    def cable(self, link: type[FakeLink]) -> tuple[Callable[[], None], Callable[[], None]]:
        return (lambda: setattr(link, "silent", True)), (lambda: setattr(link, "silent", False))


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"offset_s": 3.0}, "bad_stamp"),
        ({"offset_s": -3.0}, "bad_stamp"),
        ({"info_offset_s": 0.01}, "no_camera_info"),
        ({"focal": 51.0}, "camera_changed"),
        ({"silent": True}, "no_image"),
    ],
)
def test_what_must_not_be_used_is_refused(
    link: type[FakeLink], camera: Ros2Camera, changed: dict[str, float], code: str
) -> None:
    assert camera.grab("view_01.1").image is not None
    for name, value in changed.items():
        setattr(link, name, value)
    time.sleep(0.15)  # what was on its way has come
    with pytest.raises(DeviceError) as caught:
        camera.grab("view_02.1")
    assert caught.value.code == code


def test_a_topic_without_pictures_names_those_that_have_some(link: type[FakeLink]) -> None:
    link.silent = True
    with pytest.raises(DeviceError, match="nothing comes; topics of sensor_msgs/msg/Image are: /other/image"):
        Ros2Camera("/camera/image_raw")
    with pytest.raises(InputError, match="'colour=red'"):
        Ros2Camera("/camera/image_raw,colour=red")


def test_encodings_become_grey() -> None:
    random = np.random.default_rng(0)
    rows = random.integers(0, 256, (48, 80), np.uint8)
    padded = grey_of("a", message(0, step=80, data=rows.tobytes()))
    assert np.array_equal(padded, rows[:, :64])
    sixteen = random.integers(0, 1 << 16, (48, 64), np.uint16)
    little = grey_of("a", message(0, encoding="mono16", step=128, data=sixteen.tobytes()))
    big = grey_of(
        "a", message(0, encoding="mono16", step=128, data=sixteen.byteswap().tobytes(), is_bigendian=1)
    )
    assert np.array_equal(little, sixteen >> 8)
    assert np.array_equal(big, sixteen >> 8)
    colours = np.zeros((48, 64, 3), np.uint8)
    colours[..., 0] = 200
    red = grey_of("a", message(0, encoding="rgb8", step=192, data=colours.tobytes()))
    blue = grey_of("a", message(0, encoding="bgr8", step=192, data=colours.tobytes()))
    assert abs(int(red[0, 0]) - 60) <= 1
    assert abs(int(blue[0, 0]) - 23) <= 1


@pytest.mark.parametrize(
    "changed",
    [
        {"encoding": "yuv422"},
        {"data": b"short"},
        {"step": 10},
        {"width": 0, "step": 0},
        {"width": 1 << 31, "step": 1 << 31},
        {"encoding": "rgb8"},
    ],
)
def test_pictures_that_are_none_are_refused(changed: dict[str, object]) -> None:
    with pytest.raises(DeviceError) as caught:
        grey_of("a", message(0, **changed))
    assert caught.value.code == "bad_image"


@pytest.fixture(scope="module")
def peer() -> Iterator[Peer]:
    made = Peer()
    yield made
    made.close()


def test_frames_over_ros2_with_wrong_or_late_stamps_are_refused(peer: Peer) -> None:
    camera = Ros2Camera("")
    try:
        assert camera.grab("view_01.1").image is not None
        for fault, code in (
            ("late", "bad_stamp"),
            ("ahead", "bad_stamp"),
            ("unstamped", "bad_stamp"),
            ("backwards", "bad_stamp"),
            ("mismatched", "no_camera_info"),
            ("silent", "no_image"),
        ):
            peer.say(f"image {fault}")
            time.sleep(0.5)
            with pytest.raises(DeviceError) as caught:
                camera.grab("view_02.1")
            assert caught.value.code == code, fault
            peer.say("well")
            asked = time.time()
            frame = camera.grab("view_02.2")
            assert frame.timestamp_s is not None
            assert frame.timestamp_s >= asked
    finally:
        camera.close()
