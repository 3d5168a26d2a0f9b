"""How far a calibration of given views holds, and which of the usual measures mislead here.

Three questions, each with its weakness:

- Do halves of the views agree? Needs no truth and does not reward an answer that bends to follow the robot's
  error; but both halves share whatever is wrong with the camera's calibration or the size of the target.
- Does an answer from some views predict the others? Nearer to use, but an answer that bends to follow the arm
  predicts an arm that errs in the same way. So it may prefer the worse of two answers.
- Is the error as large as the covariance says? NEES over its degrees of freedom is 1 for a true covariance:
  of the answer where there is truth, else of the difference of halves.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.compute.parallel import Progress, part_of, run_all
from handeye.errors import HandeyeError, InputError
from handeye.estimation import Estimate, Measurements, make_estimator, require_determined
from handeye.types import Recording
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Finding, ModelName
from handeye.types.units import MM_PER_M
from handeye.validation import metrics
from handeye.validation.findings import findings
from handeye.validation.metrics import summary

# Three views in each half.
FEWEST_VIEWS = 6
HELD_OUT_SHARE = 1 / 3


@dataclass(frozen=True)
class Agreement:
    """By how much the answers of two disjoint halves differ; NEES over 6 with both covariances added."""

    translation_mm: float
    rotation_deg: float
    nees_per_dof: float

    def to_dict(self) -> dict[str, float]:
        """Return plain values for JSON."""
        return {
            "translation_mm": self.translation_mm,
            "rotation_deg": self.rotation_deg,
            "nees_per_dof": self.nees_per_dof,
        }


@dataclass(frozen=True)
class HeldOut:
    """Metrics of the paper on views that the answer has not seen."""

    rmse_px: float
    relative_translation_mm: float
    relative_rotation_deg: float
    relative_translation_at_target_mm: float


@dataclass(frozen=True)
class AgainstTruth:
    """The answer from all views against the truth."""

    translation_mm: float
    rotation_deg: float
    nees_per_dof: float
    in_region_95: bool

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "translation_mm": self.translation_mm,
            "rotation_deg": self.rotation_deg,
            "nees_per_dof": self.nees_per_dof,
            "in_region_95": self.in_region_95,
        }


@dataclass(frozen=True, eq=False)
class ModelCheck:
    """All measures of one model.

    Parameters
    ----------
    estimate
        The answer from all views.
    rmse_px
        Its root mean square residual over all points.
    random_halves
        Agreement of random halves; those that do not determine the answer are counted in `undetermined`.
    contiguous_halves
        Agreement of the first and the last half, in the order of recording; None if not determined.
    held_out
        Metrics of answers from two thirds of the views on the other third.
    truth
        None where there is none.
    """

    model: ModelName
    estimate: Estimate
    rmse_px: float
    random_halves: tuple[Agreement, ...]
    undetermined: int
    contiguous_halves: Agreement | None
    held_out: tuple[HeldOut, ...]
    truth: AgainstTruth | None

    @property
    def sigma_translation_mm(self) -> float:
        """Standard deviation of the camera's position that the answer claims."""
        return MM_PER_M * float(np.sqrt(np.trace(self.estimate.hand_eye_covariance[:3, :3])))

    @property
    def sigma_rotation_deg(self) -> float:
        """Standard deviation of the camera's rotation that the answer claims."""
        return float(np.rad2deg(np.sqrt(np.trace(self.estimate.hand_eye_covariance[3:, 3:]))))

    def halves(self, name: str) -> FloatArray:
        """(N,) values of a field of `Agreement` over the random halves."""
        return np.array([getattr(half, name) for half in self.random_halves])

    def unseen(self, name: str) -> FloatArray:
        """(N,) values of a field of `HeldOut` over the splits."""
        return np.array([getattr(split, name) for split in self.held_out])

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        contiguous = self.contiguous_halves
        return {
            "sigma_translation_mm": self.sigma_translation_mm,
            "sigma_rotation_deg": self.sigma_rotation_deg,
            "rmse_px": self.rmse_px,
            "split_half": {
                "random": {name: _summary(self.halves(name)) for name in Agreement.__dataclass_fields__},
                "undetermined": self.undetermined,
                "contiguous": None if contiguous is None else contiguous.to_dict(),
            },
            "held_out": {name: _summary(self.unseen(name)) for name in HeldOut.__dataclass_fields__},
            "truth": None if self.truth is None else self.truth.to_dict(),
        }


@dataclass(frozen=True, eq=False)
class Validation:
    """The measures of the chosen model and, to compare, of the other one.

    Parameters
    ----------
    findings
        What the measures say and which of them mislead here, with the evidence.
    """

    recording: Recording
    views: tuple[str, ...]
    model: ModelName
    seed: int
    checks: Mapping[ModelName, ModelCheck]
    findings: tuple[Finding, ...]

    @property
    def check(self) -> ModelCheck:
        """The measures of the chosen model."""
        return self.checks[self.model]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "recording": self.recording.name,
            "mounting": self.recording.mounting.value,
            "views": list(self.views),
            "model": self.model.value,
            "seed": self.seed,
            "models": {model.value: check.to_dict() for model, check in self.checks.items()},
            "findings": [finding.to_dict() for finding in self.findings],
        }


def validate(
    recording: Recording,
    model: ModelName = ModelName.AUTO,
    *,
    splits: int = 20,
    seed: int = 0,
    workers: int = 1,
    progress: Progress | None = None,
) -> Validation:
    """Split the views in many ways and compare what the parts say, under both models.

    Parameters
    ----------
    recording
        At least six usable views.
    model
        The model whose answer is judged; the other is measured beside it.
    splits
        Number of random halvings, and of random thirds held out.
    seed
        Seed of the splits; both models see the same.

    Raises
    ------
    InputError
        Too few views.
    DegenerateError
        All views together do not determine the answer.
    SolveError
        All views together have no answer under the chosen model.
    """
    measurements = Measurements.of_recording(recording)
    count = len(measurements)
    if count < FEWEST_VIEWS:
        raise InputError(
            f"{recording.name}: {count} usable views, at least {FEWEST_VIEWS} are needed for two halves",
            code=Code.TOO_FEW_VIEWS,
            hint="take more views",
        )
    random = np.random.default_rng(seed)
    halvings = [_parts(random.permutation(count), count // 2) for _ in range(splits)]
    thirds = [_parts(random.permutation(count), max(2, int(count * HELD_OUT_SHARE))) for _ in range(splits)]
    chosen = ModelName(model)
    checks: dict[ModelName, ModelCheck] = {}
    for number, name in enumerate([chosen, *(other for other in ModelName if other is not chosen)]):
        told = part_of(progress, number * (2 * splits + 1), 2 * (2 * splits + 1))
        try:
            checks[name] = _check(recording, measurements, name, halvings, thirds, workers, told)
        except HandeyeError:
            if name is chosen:
                raise  # without the other model there is merely nothing to compare with
    views = tuple(view.name for view in measurements.views)
    return Validation(recording, views, chosen, seed, checks, tuple(findings(chosen, checks)))


_Split = tuple[tuple[int, ...], tuple[int, ...]]


def _parts(order: Iterable[int], first: int) -> _Split:
    numbers = [int(i) for i in order]
    return tuple(sorted(numbers[:first])), tuple(sorted(numbers[first:]))


def _check(
    recording: Recording,
    measurements: Measurements,
    model: ModelName,
    halvings: Sequence[_Split],
    thirds: Sequence[_Split],
    workers: int,
    progress: Progress | None,
) -> ModelCheck:
    estimate = make_estimator(model)(measurements)
    require_determined(estimate)
    count = len(measurements)
    contiguous = _parts(range(count), count // 2)
    total = len(halvings) + len(thirds) + 1
    halve = partial(_agreement, recording, model)
    agreements = run_all(
        halve, [contiguous, *halvings], workers=workers, progress=part_of(progress, 0, total)
    )
    unseen = run_all(
        partial(_held_out, recording, model),
        thirds,
        workers=workers,
        progress=part_of(progress, len(halvings) + 1, total),
    )
    found = tuple(agreement for agreement in agreements[1:] if agreement is not None)
    problem = estimate.corrected(measurements).with_camera(estimate.camera).problem
    squared = problem.squared_error(estimate.X.matrix, estimate.Y.matrix)
    return ModelCheck(
        model=model,
        estimate=estimate,
        rmse_px=float(np.sqrt(squared / np.sum(measurements.point_counts))),
        random_halves=found,
        undetermined=len(halvings) - len(found),
        contiguous_halves=agreements[0],
        held_out=tuple(split for split in unseen if split is not None),
        truth=_against_truth(recording, estimate),
    )


def _answer(measurements: Measurements, model: ModelName) -> Estimate | None:
    """Return an estimate, None where the views do not determine one."""
    try:
        estimate = make_estimator(model)(measurements)
    except HandeyeError:
        return None
    return estimate if estimate.determined else None


def _agreement(recording: Recording, model: ModelName, halves: _Split) -> Agreement | None:
    measurements = Measurements.of_recording(recording)
    first, second = (_answer(measurements.select(half), model) for half in halves)
    if first is None or second is None:
        return None
    difference = metrics.split_half_difference(first, second)
    return Agreement(
        difference.translation_mm, difference.rotation_deg, metrics.split_half_nees(first, second) / 6
    )


def _held_out(recording: Recording, model: ModelName, split: _Split) -> HeldOut | None:
    measurements = Measurements.of_recording(recording)
    unseen, seen = (measurements.select(part) for part in split)
    estimate = _answer(seen, model)
    if estimate is None:
        return None
    relative = metrics.relative_error(estimate, unseen)
    return HeldOut(
        metrics.held_out_rmse_px(estimate, unseen),
        relative.translation_mm,
        relative.rotation_deg,
        metrics.relative_error_at_target(estimate, unseen).translation_mm,
    )


def _against_truth(recording: Recording, estimate: Estimate) -> AgainstTruth | None:
    if recording.truth is None or recording.truth.X is None:
        return None
    error = metrics.absolute_error(estimate.X, recording.truth.X)
    squared = metrics.nees(estimate.X, estimate.hand_eye_covariance, recording.truth.X)
    return AgainstTruth(
        error.translation_mm,
        error.rotation_deg,
        squared / 6,
        metrics.region_holds(squared, estimate.degrees_of_freedom),
    )


def _summary(values: FloatArray) -> dict[str, Any] | None:
    return summary(values) if len(values) else None
