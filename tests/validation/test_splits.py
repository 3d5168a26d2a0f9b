"""Validation: what halves, held-out views and the truth say, and what is said of them."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from folders import made_cell, made_recording, parallel_recording
from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.errors import DegenerateError, InputError
from handeye.types import Recording, Truth
from handeye.types.calibration import ModelName
from handeye.validation.findings import findings
from handeye.validation.splits import AgainstTruth, Agreement, ModelCheck, Validation, validate

AUTO, PAPER = ModelName.AUTO, ModelName.PAPER


def noisy_recording(count: int = 16) -> Recording:
    """An arm off by a millimetre at every view."""
    cell = made_cell(8)
    poses = [cell.robot_pose(cell.look()) for _ in range(count)]
    sigma = np.array([1e-3] * 3 + [1e-3] * 3)
    views = cell.views(poses, sigma_px=0.1, robot_sigma=sigma)
    return Recording("noisy", cell.mounting, cell.camera, cell.target, tuple(views), Truth(cell.X))


@pytest.fixture(scope="module")
def noisy() -> Validation:
    return validate(noisy_recording(), splits=6)


def test_measures(noisy: Validation) -> None:
    check = noisy.checks[AUTO]
    assert len(check.random_halves) + check.undetermined == 6
    assert check.contiguous_halves is not None
    assert check.truth is not None
    # Halves differ by about twice the deviation of the whole.
    expected = 2 * check.sigma_translation_mm
    assert np.mean(check.halves("translation_mm")) == pytest.approx(expected, rel=0.7)
    assert 0.2 < np.mean(check.halves("nees_per_dof")) < 3
    assert check.truth.in_region_95


def test_paper_model_claims_too_much_on_a_noisy_arm(noisy: Validation) -> None:
    paper = noisy.checks[PAPER]
    assert paper.truth is not None
    assert not paper.truth.in_region_95
    assert np.mean(paper.halves("nees_per_dof")) > 10
    codes = [finding.code for finding in findings(PAPER, noisy.checks)]
    assert {"truth_outside", "covariance_too_small", "residuals_are_the_robots"} <= set(codes)


def test_same_seed_same_result(noisy: Validation) -> None:
    assert validate(noisy_recording(), splits=6, workers=2).to_dict() == noisy.to_dict()
    assert validate(noisy_recording(), splits=6, seed=1).to_dict() != noisy.to_dict()


def test_progress_ends_at_the_total() -> None:
    steps: list[tuple[int, int]] = []
    validate(made_recording(6), splits=2, progress=lambda done, total: steps.append((done, total)))
    done, total = steps[-1]
    assert done == total
    assert [step[0] for step in steps] == sorted(step[0] for step in steps)


def test_too_few_views() -> None:
    with pytest.raises(InputError) as caught:
        validate(made_recording(5))
    assert caught.value.code == "too_few_views"


def test_parallel_axes() -> None:
    with pytest.raises(DegenerateError):
        validate(parallel_recording(8))


def test_shipped_recording() -> None:
    found = validate(read_recording(shipped_recording()).recording, splits=3)
    truth = found.check.truth
    assert truth is not None
    assert truth.in_region_95
    assert truth.translation_mm < 0.2
    assert "shared_errors" not in [finding.code for finding in found.findings]


@dataclass
class Numbers:
    """A check with invented numbers, good in every respect."""

    model: ModelName = AUTO
    translation_mm: float = 1.0
    nees: float = 1.0
    count: int = 4
    undetermined: int = 0
    contiguous_mm: float | None = 1.0
    unseen_px: float = 0.1
    rmse_px: float = 0.1
    sigma_px: float = 0.07
    truth: AgainstTruth | None = field(default_factory=lambda: AgainstTruth(1, 1, 1, True))
    views: int = 20

    @property
    def random_halves(self) -> list[int]:
        return list(range(self.count))

    @property
    def held_out(self) -> list[int]:
        return [1]

    @property
    def contiguous_halves(self) -> Agreement | None:
        return None if self.contiguous_mm is None else Agreement(self.contiguous_mm, 0.1, 1)

    def halves(self, name: str) -> np.ndarray:
        values = {"translation_mm": self.translation_mm, "rotation_deg": 0.1, "nees_per_dof": self.nees}
        return np.full(self.count, values[name])

    def unseen(self, name: str) -> np.ndarray:
        assert name == "rmse_px"
        return np.array([self.unseen_px])

    @property
    def estimate(self) -> "Numbers":
        return self

    @property
    def noise(self) -> "Numbers":
        return self

    @property
    def pixel_sigma_px(self) -> list[float]:
        return [self.sigma_px] * self.views


def codes(check: Numbers, other: Numbers | None = None) -> list[str]:
    checks: dict[ModelName, ModelCheck] = {AUTO: check}  # type: ignore[dict-item]
    if other is not None:
        checks[PAPER] = other  # type: ignore[assignment]
    found = list(findings(AUTO, checks))
    assert all(finding.sentence and "nan" not in finding.sentence for finding in found)
    return [finding.code for finding in found]


def test_nothing_to_complain_of() -> None:
    assert codes(Numbers(), Numbers(PAPER)) == ["split_half"]


CASES: dict[str, Callable[[], list[str]]] = {
    "halves_undetermined": lambda: codes(Numbers(count=0, undetermined=4)),
    "some_halves_undetermined": lambda: codes(Numbers(undetermined=1)),
    "few_views": lambda: codes(Numbers(views=8)),
    "truth_outside": lambda: codes(Numbers(truth=AgainstTruth(5, 1, 30, False))),
    "covariance_too_small": lambda: codes(Numbers(nees=4)),
    "covariance_large": lambda: codes(Numbers(nees=0.1)),
    "contiguous_undetermined": lambda: codes(Numbers(contiguous_mm=None)),
    "contiguous_disagree": lambda: codes(Numbers(contiguous_mm=3)),
    "residuals_are_the_robots": lambda: codes(Numbers(rmse_px=1)),
    "shared_errors": lambda: codes(Numbers(truth=None)),
    "held_out_misleads": lambda: codes(Numbers(unseen_px=2), Numbers(PAPER, translation_mm=3, unseen_px=1)),
    "held_out_flatters": lambda: codes(Numbers(translation_mm=3), Numbers(PAPER, unseen_px=1)),
    "other_model_better": lambda: codes(Numbers(translation_mm=3, unseen_px=2), Numbers(PAPER, unseen_px=1)),
}


@pytest.mark.parametrize("code", CASES)
def test_each_finding_has_its_cause(code: str) -> None:
    assert code in CASES[code]()
