"""Questions that are answered before anything is bought, and their pictures."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from commands import Handeye
from handeye.errors import InputError
from handeye.session.configuration import prepare
from handeye.session.simulated import usual_camera
from handeye.studies.expectation import expect
from handeye.studies.questions import CHOICES, AskedCell, Question
from handeye.studies.questions_picture import draw_question


def test_every_question_has_choices_that_differ_and_one_is_the_good_cell() -> None:
    for question, choices in CHOICES.items():
        made = [(choice.cell, choice.target) for choice in choices]
        assert len(set(map(str, made))) == len(choices)
        assert (AskedCell(), None) in made or question is Question.DISTANCE


@pytest.mark.parametrize(
    ("asked", "lens", "focal_px"),
    [
        (AskedCell(), "brown_conrady_5", 1400.0),
        (AskedCell(focal_px=2800.0), "brown_conrady_5", 2800.0),
        (AskedCell(lens="fisheye"), "kannala_brandt", 520.0),
        (AskedCell(lens="wide", focal_px=900.0), "brown_conrady_5", 900.0),
    ],
)
def test_a_cell_has_the_lens_that_is_asked_for(asked: AskedCell, lens: str, focal_px: float) -> None:
    camera = prepare(asked.configuration()).recording.camera
    assert camera.lens == lens
    assert camera.parameters[0] == camera.parameters[1] == focal_px
    assert camera.covariance is not None


@pytest.mark.parametrize("focal_px", [0.0, -5.0, float("nan"), float("inf")])
def test_a_focal_length_that_no_lens_has_is_refused(focal_px: float) -> None:
    with pytest.raises(InputError, match="camera"):
        usual_camera(focal_px=focal_px)


def test_a_longer_lens_is_expected_to_tell_rotations_better() -> None:
    exact = AskedCell(arm_errors=0.0, pixel_sigma=0.2)
    degrees = [
        expect(replace(exact, focal_px=focal_px).configuration(), [6], cells=3).at(6).within_deg
        for focal_px in (1000.0, 3000.0)
    ]
    assert degrees[1] < 0.9 * degrees[0]


def test_the_study_draws_and_writes_what_it_answers(handeye: Handeye, tmp_path: Path) -> None:
    asked = ("study", "questions", "--only", "views", "lens", "--cells", "1", "--workers", "1")
    answer = handeye(*asked, "--output", tmp_path)
    assert answer.code == 0, answer.err
    assert re.search(r"fisheye, 520 px +12 ", answer.out)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["questions.json", "which-lens.png", "which-views.png"]
    data = handeye.json(*asked)
    assert [choice["choice"] for choice in data["questions"]["lens"]] == [
        choice.name for choice in CHOICES[Question.LENS]
    ]
    drawn = draw_question(data["questions"]["lens"]).axes[0]
    assert [text.get_text() for text in drawn.get_xticklabels()] == [c.name for c in CHOICES[Question.LENS]]
    assert len(drawn.lines) == 2
