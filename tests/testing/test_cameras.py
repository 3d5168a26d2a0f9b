"""The shipped tests of cameras: ours pass, and each rule finds the driver that breaks it."""

from collections.abc import Callable

import numpy as np
import pytest

from handeye.cameras.protocol import Frame, ImageSource
from handeye.errors import DeviceError
from handeye.testing import CameraTests, MockCell
from rules import rules_of


class Steady:
    """A driver as it should be."""

    def __init__(self) -> None:
        self.scene = 0
        self.time_s = 0.0
        self.connected = True
        self.closed = 0

    def close(self) -> None:
        self.closed += 1

    def grab(self, label: str) -> Frame:
        if not self.connected:
            raise DeviceError(f"{label}: no camera", code="connection_lost")
        self.time_s += 1.0
        return Frame(np.full((6, 8), self.scene, dtype=np.uint8), timestamp_s=self.time_s)


class TestSteady(CameraTests):
    @pytest.fixture
    def camera(self) -> ImageSource:
        return Steady()

    @pytest.fixture
    def size_px(self) -> tuple[int, int]:
        return (8, 6)

    @pytest.fixture
    def change(self, camera: Steady) -> Callable[[], None]:
        return lambda: setattr(camera, "scene", camera.scene + 1)

    @pytest.fixture
    def cable(self, camera: Steady) -> tuple[Callable[[], None], Callable[[], None]]:
        return (lambda: setattr(camera, "connected", False)), (lambda: setattr(camera, "connected", True))


class TestSimulatedCamera(CameraTests):
    @pytest.fixture
    def cell(self) -> MockCell:
        return MockCell()

    @pytest.fixture
    def camera(self, cell: MockCell) -> ImageSource:
        return cell._source

    @pytest.fixture
    def size_px(self) -> tuple[int, int]:
        return (1280, 1024)

    @pytest.fixture
    def change(self, cell: MockCell) -> Callable[[], None]:
        goals = iter(cell.goals(4)[1:])
        return lambda: cell.stand(next(goals).joints_rad or ())


class NoGrab:
    pass


class Coloured(Steady):
    def grab(self, label: str) -> Frame:
        return Frame(np.zeros((6, 8, 3), dtype=np.uint8))


class OtherSize(Steady):
    def grab(self, label: str) -> Frame:
        return Frame(np.zeros((8, 6), dtype=np.uint8))


class Raw(Steady):
    def grab(self, label: str) -> Frame:
        return super().grab(label).image  # type: ignore[return-value]


class OneBuffer(Steady):
    def __init__(self) -> None:
        super().__init__()
        self.buffer = np.zeros((6, 8), dtype=np.uint8)

    def grab(self, label: str) -> Frame:
        self.buffer += 1
        return Frame(self.buffer)


class BackInTime(Steady):
    def grab(self, label: str) -> Frame:
        self.time_s -= 2.0
        return super().grab(label)


class Queue(Steady):
    def grab(self, label: str) -> Frame:
        waiting, self.waiting = getattr(self, "waiting", None), super().grab(label)
        return waiting or self.waiting


class LastOne(Steady):
    def grab(self, label: str) -> Frame:
        if self.connected:
            self.last = super().grab(label)
        return self.last


class NotMended(Steady):
    def grab(self, label: str) -> Frame:
        self.connected = self.connected and not hasattr(self, "lost")
        if not self.connected:
            self.lost = True
        return super().grab(label)


class ClosesOnce(Steady):
    def close(self) -> None:
        super().close()
        if self.closed > 1:
            raise ValueError("closed already")


class ClosesPolitely(Steady):
    def close(self) -> None:
        self.grab("goodbye")


BROKEN: list[tuple[type, str, str]] = [
    (NoGrab, "test_keeps_the_contract", "lacks grab"),
    (Coloured, "test_keeps_the_contract", "expected grey values"),
    (OtherSize, "test_keeps_the_contract", "6 x 8 pixels"),
    (Raw, "test_keeps_the_contract", "expected Frame"),
    (OneBuffer, "test_keeps_the_contract", "copy of the buffer"),
    (BackInTime, "test_keeps_the_contract", "before that of the picture before"),
    (Queue, "test_a_picture_is_of_now", "of before"),
    (LastOne, "test_says_that_the_connection_is_lost", "DID NOT RAISE"),
    (NotMended, "test_says_that_the_connection_is_lost", "no camera"),
    (ClosesOnce, "test_can_be_closed", "second time: .*closed already"),
    (ClosesPolitely, "test_can_be_closed_without_a_connection", "first time: .*no camera"),
]


@pytest.mark.parametrize(("driver", "rule", "words"), BROKEN, ids=[kind.__name__ for kind, _, _ in BROKEN])
def test_each_rule_finds_who_breaks_it(driver: type, rule: str, words: str) -> None:
    camera = driver()
    given: dict[str, object] = {
        "camera": camera,
        "size_px": (8, 6),
        "change": lambda: setattr(camera, "scene", camera.scene + 1),
        "cable": (
            lambda: setattr(camera, "connected", False),
            lambda: setattr(camera, "connected", True),
        ),
    }
    test = getattr(CameraTests(), rule)
    wanted = test.__code__.co_varnames[1 : test.__code__.co_argcount]
    with pytest.raises((AssertionError, DeviceError, pytest.fail.Exception), match=words):
        test(**{name: given[name] for name in wanted})


def test_every_rule_is_broken_by_somebody() -> None:
    assert {rule for _, rule, _ in BROKEN} == rules_of(CameraTests)
