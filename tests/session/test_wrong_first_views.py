"""Wrong views among the first do not end a session, nor stay: later views tell which they were."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.cameras.protocol import Frame, ImageSource, Points
from handeye.session.configuration import begin, go_on, prepare
from handeye.session.deciding import EndReason
from sessions import Lying, configured, number

GOOD = {EndReason.ACCURACY_REACHED, EndReason.VIEWS_TAKEN, EndReason.OUT_OF_REACH}


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


# Seed, share of the way, first view that lies: the views contradict one another, or leave a direction open.
@pytest.mark.parametrize(
    ("seed", "share", "first", "too_early"),
    [(100, 0.5, 2, 0), (100, 0.5, 2, 1), (105, 0.5, 3, 0), (100, 0.9, 2, 0), (106, 0.9, 3, 0)],
)
def test_a_session_that_ended_without_an_answer_goes_on_when_the_robot_is_put_right(
    seed: int, share: float, first: int, too_early: int, tmp_path: Path
) -> None:
    prepared = prepare(configured(seed, accuracy_mm=0.05, accuracy_deg=0.005, most_views=6))
    lying = Lying(prepared.cell.robot, range(first, 100), share)
    session, store = begin(replace(prepared, cell=replace(prepared.cell, robot=lying)), tmp_path / "s")
    end = session.run()
    store.close()
    assert end.calibration is None
    assert end.reason in {EndReason.REFUSED, EndReason.VIEWS_TAKEN}
    assert (end.error is not None) == (end.reason is EndReason.REFUSED)
    # What the arm's description and its joints agree on is no matter of how angles are written.
    assert end.error is None or end.error.code == "inconsistent"
    for _ in range(too_early):
        _, store, prepared = go_on(tmp_path / "s")
        lying = Lying(prepared.cell.robot, range(first, 100), share)
        end = replace(prepared, cell=replace(prepared.cell, robot=lying)).session(store).run()
        store.close()
        assert end.calibration is None
    before = end.views
    session, store, prepared = go_on(tmp_path / "s")
    end = session.run()
    store.close()
    assert before < end.views <= 2 * before + 1
    assert end.calibration is not None
    assert end.reach is not None
    assert prepared.truth is not None
    assert prepared.truth.X is not None
    off = (end.calibration.X @ prepared.truth.X.inverse()).log()
    assert 1e3 * np.linalg.norm(off[:3]) < 2 * end.reach.translation_mm
