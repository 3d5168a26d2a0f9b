"""Logs of checks over many nights: the night of a shift is named, and none where nothing moved."""

import pytest

from commands import Handeye
from handeye.errors import ExitCode
from handeye.studies.nights import study_nights
from handeye.studies.shift import ShiftStudy


def test_the_night_is_named() -> None:
    found = study_nights(ShiftStudy(trials=3, seed=5), 40)["moved"]
    assert found["nothing"]["none_named"] == 1.0
    for moved in ("camera", "board", "joint"):
        assert found[moved]["named_within_one"] == 1.0


def test_a_shift_needs_a_night_before(handeye: Handeye) -> None:
    assert handeye("study", "shift", "--nights", "1").code == ExitCode.USAGE


@pytest.mark.parametrize("known", [True, False])
def test_kinds_of_shift(known: bool) -> None:
    found = study_nights(ShiftStudy(trials=1, arm_known=known, seed=6), 3)["moved"]
    assert ("joint" in found) == known
