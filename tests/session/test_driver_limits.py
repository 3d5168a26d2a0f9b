"""What a driver says of its joints' limits is what is planned with, together with those of the description."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.errors import DeviceError
from handeye.robots.protocol import Goal, Reading
from handeye.session import configuration as configuring
from handeye.session import opening
from handeye.session.attempt import Cell
from handeye.session.configuration import begin, go_on, prepare
from handeye.session.deciding import EndReason
from handeye.session.prepared import Prepared
from sessions import configured


class Narrow:
    """A robot over that of a simulated cell; beyond what it states, it refuses to go."""

    def __init__(self, cell: Cell, joint_limits: object) -> None:
        self._robot, self.joint_limits = cell.robot, joint_limits
        self.goals: list[Goal] = []
        self.closed = 0

    def move_to(self, goal: Goal) -> None:
        self.goals.append(goal)
        low, high = np.transpose(self.joint_limits)  # type: ignore[call-overload]
        if goal.joints_rad is None or not np.all((low <= goal.joints_rad) & (goal.joints_rad <= high)):
            raise DeviceError(f"{goal.label}: beyond the limits", code="motion_refused")
        self._robot.move_to(goal)

    def read_pose(self) -> Reading:
        return self._robot.read_pose()

    def stop(self) -> None:
        self._robot.stop()

    def close(self) -> None:
        self.closed += 1


def narrowed(monkeypatch: pytest.MonkeyPatch, stated: object) -> tuple[Narrow, Prepared]:
    """Prepare a run on a robot that states limits."""
    made = prepare(configured(0))
    robot = Narrow(made.cell, stated)
    monkeypatch.setattr(opening, "open_robot", lambda *_, **__: robot)
    monkeypatch.setattr(configuring, "open_camera", lambda *_, **__: made.cell.source)
    space = made.cell.workspace
    assert space is not None
    bounds = (tuple(space.lower_m.tolist()), tuple(space.upper_m.tolist()))
    asked = replace(configured(0), driver="narrow", images="mine", workspace_m=bounds, floor_m=space.floor_m)
    asked = replace(asked, most_views=8, accuracy_mm=0.001, accuracy_deg=1e-4, anyway=True)
    return robot, prepare(asked, camera=made.cell.camera, target=made.cell.target)


def around(width_rad: float) -> np.ndarray:
    made = prepare(configured(0))
    assert made.start is not None
    here = np.array(made.start.joints_rad)
    return np.stack([here - width_rad, here + width_rad], axis=1)


def test_no_goal_is_planned_that_the_driver_would_refuse(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    stated = around(0.6)
    stated[0] = -9.0, 9.0  # wider than the description
    robot, prepared = narrowed(monkeypatch, stated)
    described = prepare(configured(0)).arm.limits
    assert np.array_equal(prepared.arm.limits[0], described[0])
    assert np.array_equal(prepared.arm.limits[1:], stated[1:])
    session, store = begin(prepared, tmp_path / "s")
    end = session.run()
    assert end.reason is EndReason.VIEWS_TAKEN
    assert len(robot.goals) == 8
    assert not [entry for entry in store.entries if entry.failure is not None]
    store.close()
    # The arm is the one that was described, and what the driver states now is planned with.
    robot.joint_limits = around(0.55)
    _, store, again = go_on(tmp_path / "s")
    store.close()
    assert again.arm.fingerprint == prepare(configured(0)).arm.fingerprint
    assert np.array_equal(again.arm.limits[1:], robot.joint_limits[1:])


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ([(-1.0, 1.0)], "expected"),
        ("narrow", "unreadable"),
        (np.full((6, 2), np.nan), "no position of joint"),
        ([(20.0, 30.0)] * 6, "no position of joint"),
    ],
)
def test_limits_that_cannot_be_those_of_the_arm_are_refused(
    monkeypatch: pytest.MonkeyPatch, stated: object, words: str
) -> None:
    with pytest.raises(DeviceError, match=words) as caught:
        narrowed(monkeypatch, stated)
    assert caught.value.code == "bad_reading"


def test_who_stands_beyond_them_is_not_moved(monkeypatch: pytest.MonkeyPatch) -> None:
    stated = around(0.5)
    stated[3] += 0.6
    with pytest.raises(DeviceError, match="beyond its limits"):
        narrowed(monkeypatch, stated)
