"""Rules of statistics and of the disk that nothing else would miss."""

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from handeye.estimation.confidence import radius
from handeye.session.configuration import begin, prepare
from handeye.session.deciding import Step
from handeye.session.request import Requested
from sessions import configured


@pytest.mark.parametrize("freedom", [3.0, 8.0, np.inf])
def test_the_radius_has_the_tails_of_student(freedom: float) -> None:
    # Of a ball of unit deviation: the square of the radius over three is F distributed (3, freedom).
    exact = np.sqrt(3 * stats.f.ppf(0.95, 3, freedom)) if np.isfinite(freedom) else stats.chi.ppf(0.95, 3)
    assert radius(np.eye(3), freedom) == pytest.approx(exact, rel=0.02)


def test_the_request_is_met_only_if_both_radii_are_and_views_are_enough() -> None:
    asked = Requested(0.5, 0.05)
    assert asked.fewest_views >= 6
    for views, known, millimetres, degrees, met in (
        (6, True, 0.4, 0.04, True),
        (5, True, 0.4, 0.04, False),
        (6, False, 0.4, 0.04, False),
        (6, True, 0.6, 0.04, False),
        (6, True, 0.4, 0.06, False),
    ):
        within = SimpleNamespace(translation_mm=millimetres, rotation_deg=degrees)
        estimate = SimpleNamespace(determined=known, within_95=within)
        stop = asked.verdict(SimpleNamespace(views=views, estimate=estimate))  # type: ignore[arg-type]
        assert (stop is not None) == met
    for bad in ((0.0, 1.0), (1.0, 0.0), (float("nan"), 1.0), (-1.0, 1.0)):
        with pytest.raises(Exception, match="expected above zero"):
            Requested(*bad)


def test_the_candidates_follow_from_the_seed(tmp_path: Path) -> None:
    first: list[Step] = []
    for number, seed in enumerate((5, 5, 6)):
        prepared = prepare(configured(5))
        changed = configured(seed)
        session, store = begin(prepared, tmp_path / str(number))
        session._decide.__self__._wish = changed.wish()  # type: ignore[attr-defined]
        for _ in range(3):
            session.take(session.next())  # type: ignore[arg-type]
        step = session.next()
        store.close()
        assert isinstance(step, Step)
        first.append(step)
    one, same, other = ([*step.decision["candidates"].values()] for step in first)
    assert one == same
    assert one != other


def test_an_attempt_is_on_the_disk_before_the_arm_moves_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    prepared = prepare(configured(5))
    session, store = begin(prepared, tmp_path / "s")
    journal, recording = tmp_path / "s" / "journal.jsonl", tmp_path / "s" / "recording.toml"
    synced: dict[int, int] = {}
    fsync = os.fsync

    def counting(descriptor: int) -> None:
        status = os.fstat(descriptor)
        synced[status.st_ino] = status.st_size
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", counting)
    for _ in range(3):
        session.take(session.next())  # type: ignore[arg-type]
        for path in (journal, recording):
            assert synced[path.stat().st_ino] == path.stat().st_size
    store.close()
