"""What accuracy is expected, beside what simulated cells of other seeds reach."""

from dataclasses import replace

import numpy as np
import pytest

from commands import Handeye
from handeye.errors import InputError
from handeye.robots.simulated import ArmErrors
from handeye.session.settings import Configuration, Simulation
from handeye.studies import expectation
from handeye.studies.expectation import expect, mean_length, reached
from handeye.types import Chessboard

QUICK = Configuration(
    "epson_c4l", most_views=6, refine=False, simulation=Simulation(ArmErrors(), points_only=0.2)
)


def test_the_mean_length_of_a_vector_is_that_of_its_distribution() -> None:
    # Of three equal deviations it is 2 sqrt(2 / pi), of one sqrt(2 / pi).
    assert mean_length(np.eye(3) * 4.0) == pytest.approx(4 * np.sqrt(2 / np.pi), rel=0.02)
    assert mean_length(np.diag([9.0, 0.0, 0.0])) == pytest.approx(3 * np.sqrt(2 / np.pi), rel=0.03)


def test_what_is_expected_is_about_what_other_cells_reach() -> None:
    found = expect(QUICK, [6], cells=4)
    errors = [reached((replace(QUICK, seed=seed), None))[6][0] for seed in range(4)]
    assert 0.3 < found.at(6).mean_mm / float(np.mean(errors)) < 3.5
    assert found.at(6).within_mm > found.at(6).mean_mm


def test_more_is_expected_of_more_views_a_larger_board_and_better_pictures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(expectation, "MEASURED", 5)
    usual = expect(QUICK, [5, 8, 16], cells=2)
    means = [level.within_mm for level in usual.levels]
    assert [level.views for level in usual.levels] == [5, 8, 16]
    assert means == sorted(means, reverse=True)
    small = expect(QUICK, [5], target=Chessboard(5, 6, 0.01), cells=2)
    assert small.at(5).within_mm > 1.5 * usual.at(5).within_mm
    noisy = replace(QUICK, simulation=replace(QUICK.simulation, points_only=0.6))
    assert expect(noisy, [5], cells=2).at(5).within_mm > 1.5 * usual.at(5).within_mm


def test_the_same_question_has_the_same_answer_whoever_works() -> None:
    assert expect(QUICK, [5], cells=2) != expect(QUICK, [5], cells=1)
    assert expect(QUICK, [5], cells=2).levels == expect(QUICK, [5], cells=2, workers=2).levels


@pytest.mark.parametrize(("views", "cells"), [([2], 1), ([], 1), ([5], 0)])
def test_what_cannot_be_asked_is_refused(views: list[int], cells: int) -> None:
    with pytest.raises(InputError, match="expected at least"):
        expect(QUICK, views, cells=cells)


def test_the_command(handeye: Handeye) -> None:
    asked = ("--views", "5", "--cells", "1", "--arm-errors", "0", "--rows", "6", "--columns", "9")
    answer = handeye.json("expect", *asked, "--pitch-mm", "25")
    assert answer["cells"] == 1
    assert [level["views"] for level in answer["levels"]] == [5]
    assert "pitch" in handeye.fails("expect", *asked)["message"]
    assert "95 % radius" in handeye("expect", *asked, "--pitch-mm", "25").out
