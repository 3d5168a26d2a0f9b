"""Wrong views among the first do not end a session, nor stay: later views tell which they were."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.cameras.protocol import Frame, ImageSource, Points
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.session.configuration import begin, prepare
from handeye.session.deciding import EndReason
from sessions import configured

GOOD = {EndReason.ACCURACY_REACHED, EndReason.VIEWS_TAKEN, EndReason.OUT_OF_REACH}


def number(label: str) -> int:
    return int(label.split("_")[1].partition(".")[0])


class Lying:
    """A robot that hardly moves at some views, and says that it went."""

    def __init__(self, robot: Robot, at: tuple[int, ...]) -> None:
        self._robot, self._at = robot, at
        self._claimed: Reading | None = None

    def move_to(self, goal: Goal) -> None:
        self._claimed = None
        if number(goal.label) not in self._at:
            self._robot.move_to(goal)
            return
        here = np.array(self._robot.read_pose().joints_rad)
        there = here + 0.05 * (np.array(goal.joints_rad) - here)
        self._robot.move_to(replace(goal, joints_rad=tuple(there.tolist())))
        self._claimed = Reading(goal.T_base_flange, goal.joints_rad)

    def read_pose(self) -> Reading:
        return self._claimed or self._robot.read_pose()

    def stop(self) -> None:
        self._robot.stop()


class Late:
    """A camera that shows at some views what it saw before, with other noise, and at others turns its labels."""

    def __init__(self, source: ImageSource, late: tuple[int, ...], turned: tuple[int, ...]) -> None:
        self._source, self._late, self._turned = source, late, turned
        self._last: Points | None = None

    def grab(self, label: str) -> Frame:
        frame = self._source.grab(label)
        before, self._last = self._last, frame.points
        assert self._last is not None
        if number(label) in self._turned:
            return Frame(None, Points(np.asarray(self._last.point_ids)[::-1].copy(), self._last.pixels))
        if before is None or number(label) not in self._late:
            return frame
        noise = np.random.default_rng(number(label)).normal(0, 1, np.shape(before.pixels))
        return Frame(None, Points(before.point_ids, np.asarray(before.pixels) + noise))


# Which views lie, are late, or have turned labels; before, each of these ended without an answer.
CASES = [
    (0, (2,), (), ()),
    (0, (), (1, 2), ()),
    (1, (), (), (3,)),
    (2, (2, 4), (), ()),
    (5, (), (2, 4), ()),
]


@pytest.mark.parametrize(("seed", "lies", "late", "turned"), CASES, ids=str)
def test_the_session_goes_on_without_them(
    seed: int, lies: tuple[int, ...], late: tuple[int, ...], turned: tuple[int, ...], tmp_path: Path
) -> None:
    prepared = prepare(configured(seed, accuracy_mm=0.05, accuracy_deg=0.005, most_views=10))
    cell = prepared.cell
    cell = replace(cell, robot=Lying(cell.robot, lies), source=Late(cell.source, late, turned))
    session, store = begin(replace(prepared, cell=cell), tmp_path / "s")
    end = session.run()
    store.close()
    assert end.reason in GOOD
    assert end.views >= 6
    assert end.calibration is not None
    assert end.reach is not None
    # Nothing was seen before the first view, and labels are put right.
    wrong = {f"view_{n:02d}" for n in (*lies, *(n for n in late if n > 1))}
    assert not wrong & set(end.calibration.used)
    assert len(end.calibration.used) >= end.views - len(wrong)
    assert prepared.truth is not None
    assert prepared.truth.X is not None
    off = (end.calibration.X @ prepared.truth.X.inverse()).log()
    assert 1e3 * np.linalg.norm(off[:3]) < 2 * end.reach.translation_mm
