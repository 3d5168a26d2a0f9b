"""Every kind of fault says all that its page needs, and hypotheses undo what was done."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.errors import HandeyeError
from handeye.estimation import Measurements, solve
from handeye.estimation.faults import CODES, KINDS, diagnose, kind_of
from handeye.estimation.faults.kinds import HYPOTHESES, SharedFaultError
from handeye.studies.planted import EXPECTED, Mistake, made_up, plant
from handeye.types import Pose, Recording

SHARED = (
    Mistake.WRONG_ROTATION,
    Mistake.BOARD_SIZE,
    Mistake.CAMERA_SIZE,
    Mistake.STRETCHED,
    Mistake.SHEARED,
)


def test_codes_are_different_and_every_planted_mistake_has_one() -> None:
    assert len(CODES) == len(KINDS)
    assert set(EXPECTED.values()) <= CODES
    assert set(EXPECTED) == set(Mistake)
    assert kind_of("not_rigid") is None


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.code)
def test_a_kind_says_what_its_page_needs(kind: object) -> None:
    for name in ("title", "cause", "shows", "cure"):
        text: str = getattr(kind, name)
        assert text == text.strip()
        assert "  " not in text
        if name == "title":
            assert not text.endswith(".")
        else:
            assert text.endswith(".")


def test_names_of_hypotheses_are_different() -> None:
    measurements = Measurements.of_recording(made_up(0, 3))
    names = [(h.kind.code, h.name) for hypotheses in HYPOTHESES for h in hypotheses(measurements)]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("mistake", SHARED)
@pytest.mark.parametrize("number", [0, 6])
def test_a_repair_brings_back_the_clean_answer(mistake: Mistake, number: int) -> None:
    clean = made_up(number, 3)
    recording, _ = plant(clean, mistake, np.random.default_rng(number))
    diagnosis = diagnose(recording)
    assert diagnosis.findings[0].code == EXPECTED[mistake]
    assert isinstance(diagnosis.refused, SharedFaultError)
    assert diagnosis.repaired is not None
    answer, expected = solve(diagnosis.repaired), solve(clean)
    off = (answer.X @ expected.X.inverse()).translation
    assert np.linalg.norm(off) < 3 * max(expected.sigma_translation_m, 1e-4)


@pytest.mark.parametrize("number", [0, 6])
def test_a_mirror_image_names_both_causes_and_is_not_put_right(number: int) -> None:
    recording, _ = plant(made_up(number, 3), Mistake.MIRRORED, np.random.default_rng(number))
    diagnosis = diagnose(recording)
    (finding,) = diagnosis.findings
    assert {finding.code, *finding.evidence["as_well"]} == {"mirrored_pictures", "wrong_rotation"}
    assert "left-handed" in finding.sentence
    assert diagnosis.repaired is None


def test_a_healthy_recording_has_no_findings() -> None:
    clean = made_up(1, 3)
    diagnosis = diagnose(clean)
    assert diagnosis.findings == ()
    assert diagnosis.refused is None
    assert diagnosis.repaired is not None
    assert [view.name for view in diagnosis.repaired.views] == [view.name for view in clean.views]


def test_sigmas_follow_their_points() -> None:
    clean = made_up(5, 3)
    random = np.random.default_rng(0)
    views = [replace(view, sigmas_px=random.uniform(0.05, 0.2, len(view))) for view in clean.views]
    given = clean.with_views(views)
    for mistake in (Mistake.FLIP, Mistake.SWAP, Mistake.FALSE_POINTS):
        recording, _ = plant(given, mistake, np.random.default_rng(0))
        repaired = diagnose(recording).repaired
        assert repaired is not None
        for view in repaired.views:
            at = {tuple(pixel): sigma for pixel, sigma in _points(given, recording)}
            assert view.sigmas_px is not None
            for pixel, sigma in zip(view.pixels.tolist(), view.sigmas_px.tolist(), strict=True):
                assert at[tuple(pixel)] == sigma


def _points(*recordings: Recording) -> list[tuple[list[float], float]]:
    return [
        (pixel, sigma)
        for recording in recordings
        for view in recording.views
        if view.sigmas_px is not None
        for pixel, sigma in zip(view.pixels.tolist(), view.sigmas_px.tolist(), strict=True)
    ]


def test_nonsense_is_refused_without_a_repair() -> None:
    clean = made_up(0, 3)
    random = np.random.default_rng(0)
    nonsense = [replace(v, T_base_flange=Pose.exp(random.normal(size=6))) for v in clean.views]
    diagnosis = diagnose(clean.with_views(nonsense))
    assert diagnosis.repaired is None
    assert isinstance(diagnosis.refused, HandeyeError)
    assert diagnosis.findings[0].code == "inconsistent"
