"""A robot that says wrong things: the end of a session names it, and rests on the other views."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.errors import DeviceError
from handeye.estimation.faults import CODES
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.session.configuration import begin, prepare
from handeye.session.deciding import EndReason
from handeye.session.journal import read_journal
from handeye.session.loop import End
from handeye.types import Pose
from sessions import configured


class Lying:
    """A robot whose pose is read wrongly at the views with some labels, or always the wrong way round."""

    def __init__(self, robot: Robot, at: str = "", error: Pose | None = None) -> None:
        self._robot, self._at, self._error, self._label = robot, at, error, ""

    def move_to(self, goal: Goal) -> None:
        self._label = goal.label
        self._robot.move_to(goal)

    def read_pose(self) -> Reading:
        reading = self._robot.read_pose()
        if self._error is None:
            return Reading(reading.T_base_flange.inverse(), reading.joints_rad)
        if self._label.startswith(self._at):
            return Reading(reading.T_base_flange @ self._error, reading.joints_rad)
        return reading

    def stop(self) -> None:
        self._robot.stop()


def ended(folder: Path, at: str = "", error: Pose | None = None) -> tuple[End, Pose]:
    prepared = prepare(configured(5, joints_err=False, most_views=20))
    lying = Lying(prepared.cell.robot, at, error)
    session, store = begin(replace(prepared, cell=replace(prepared.cell, robot=lying)), folder)
    try:
        end = session.run()
    finally:
        store.close()
    assert prepared.truth is not None
    assert prepared.truth.X is not None
    return end, prepared.truth.X


def open_entries(folder: Path) -> int:
    return len(read_journal(folder).entries)


def test_a_pose_read_too_early_is_named_and_left_out(tmp_path: Path) -> None:
    end, truth = ended(tmp_path / "s", "view_05", Pose.exp([0.006, -0.004, 0.003, 0.004, 0.006, -0.003]))
    # While it runs the wrong view counts as noise of the robot, so it may go on for as long as it is allowed.
    assert end.reason in {EndReason.ACCURACY_REACHED, EndReason.VIEWS_TAKEN}
    assert end.calibration is not None
    found = [f for f in end.calibration.diagnosis if f.code in CODES]
    assert [(f.code, f.evidence["views"]) for f in found] == [("view_moving", ["view_05"])]
    assert "view_05" not in end.calibration.used
    assert len(end.calibration.used) == end.views - 1
    assert end.reach is not None
    assert end.reach.translation_mm <= 0.5
    assert np.linalg.norm((end.calibration.X @ truth.inverse()).log()[:3]) < 1e-3


def test_poses_the_wrong_way_round_are_named(tmp_path: Path) -> None:
    # By one reading against the arm's description, before anything has moved.
    with pytest.raises(DeviceError, match="the pose is that of the base in the flange"):
        ended(tmp_path / "s")
    assert open_entries(tmp_path / "s") == 0
