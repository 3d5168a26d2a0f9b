"""What drivers talk to on loopback, each with a cell behind it and a cable that can be pulled."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handeye.cameras.protocol import Frame, ImageSource
from handeye.errors import DeviceError
from handeye.testing import MockCell
from handeye.testing.robodk import MockRoboDK
from handeye.testing.universal_robots import MockUniversalRobot
from handeye.testing.xarm import MockXArm

NEVER = 10_000


@dataclass(frozen=True)
class Partner:
    """A controller: its cell, how its driver is named, where its arm is, and its cable."""

    cell: MockCell
    driver: str
    joints: Callable[[], np.ndarray]
    cut: Callable[[], None]
    mend: Callable[[], None]
    close: Callable[[], None]

    def moves(self) -> bool:
        """Whether the arm turns just now."""
        before = self.joints().copy()
        time.sleep(0.01)
        return not np.array_equal(before, self.joints())


def universal_robot(seed: int) -> Partner:
    cell = MockCell("ur5e", seed=seed, points_only=True)
    made = MockUniversalRobot(cell, pace=4.0)
    return Partner(cell, f"ur:{made.address}", lambda: made._q, made.cut, made.mend, made.close)


def xarm(seed: int) -> Partner:
    cell = MockCell("ur5e", seed=seed, points_only=True)
    made = MockXArm(cell)
    return Partner(cell, f"xarm:{made.address}", lambda: made._q, made.cut, made.mend, made.close)


def robodk(seed: int) -> Partner:
    pytest.importorskip("robodk.robolink", reason="robodk is not installed (extra robodk)")
    cell = MockCell("ur5e", seed=seed, points_only=True)
    made = MockRoboDK(cell)
    return Partner(cell, f"robodk:{made.address}", lambda: made._joints, made.cut, made.mend, made.close)


ROBOTS = {"ur": universal_robot, "xarm": xarm, "robodk": robodk}


@dataclass
class Eye:
    """A camera whose cable is pulled while it takes a picture."""

    inner: ImageSource
    cut: Callable[[], None]
    mend: Callable[[], None]
    show: Callable[[], None] = lambda: None
    grabs: int = 0
    cut_at: int = NEVER

    def grab(self, label: str) -> Frame:
        self.grabs += 1
        self.show()
        if self.grabs >= self.cut_at:
            threading.Timer(0.01, self.cut).start()
        return self.inner.grab(label)


class Wire:
    """The camera of the cell, on a wire; an exposure takes a moment."""

    def __init__(self, cell: MockCell) -> None:
        self.cell, self.connected = cell, True

    def grab(self, label: str) -> Frame:
        if self.connected:
            time.sleep(0.03)
        if not self.connected:
            raise DeviceError("no camera", code="connection_lost")
        return self.cell.grab(label)


def of_the_cell(cell: MockCell, _: Path) -> Eye:
    wire = Wire(cell)
    return Eye(wire, lambda: setattr(wire, "connected", False), lambda: setattr(wire, "connected", True))


CAMERAS: dict[str, Any] = {"mock": of_the_cell}
