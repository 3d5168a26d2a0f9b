"""Real data without truth: errors on views held out, and whether disjoint halves of the views agree."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, part_of, run_all
from handeye.estimation import Measurements, make_estimator
from handeye.studies.comparison import POLICIES, Comparison, SetResult, compare, piece_count
from handeye.studies.protocol import Protocol, contiguous_halves, random_halves
from handeye.types import Recording
from handeye.types.calibration import ModelName
from handeye.validation import metrics
from handeye.validation.metrics import summary

METRICS = (
    "relative_translation_mm",
    "relative_rotation_deg",
    "rmse_px",
    "relative_translation_at_target_mm",
)
HELD_OUT_SHARE = 1 / 3
HALVES_PER_PIECE = 10


@dataclass(frozen=True)
class Agreement:
    """By how much two answers from disjoint halves differ; `nees` is with both covariances added."""

    translation_mm: float
    rotation_deg: float
    nees: float


@dataclass(frozen=True)
class Holdout:
    """Errors on held-out views per set and policy, and the agreement of halves per set.

    Halves take all views of a set, so their agreement has nothing to do with the policy; JSON repeats it
    under each.
    """

    model: ModelName
    protocol: Protocol
    sets: tuple[SetResult, ...]
    random_halves: tuple[tuple[Agreement, ...], ...]
    contiguous_halves: tuple[Agreement, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "study": "holdout",
            "model": self.model.value,
            "seed": self.protocol.seed,
            "trials_per_set": self.protocol.trials,
            "start_views": self.protocol.start_views,
            "added_views": self.protocol.added_views,
            "held_out_share": self.protocol.held_out_share,
            "sets": {
                result.name: self._set(result, halves, contiguous)
                for result, halves, contiguous in zip(
                    self.sets, self.random_halves, self.contiguous_halves, strict=True
                )
            },
        }

    def _set(self, result: SetResult, halves: tuple[Agreement, ...], contiguous: Agreement) -> dict[str, Any]:
        agreement = {
            "split_half_translation_mm": summary(np.array([half.translation_mm for half in halves])),
            "split_half_rotation_deg": summary(np.array([half.rotation_deg for half in halves])),
            "split_half_nees_per_dof": summary(np.array([half.nees for half in halves]) / 6),
        }
        return {
            "policies": {
                policy: {
                    **{metric: summary(result.final(policy, metric)) for metric in METRICS},
                    **agreement,
                    "trials": len(result.trials),
                }
                for policy in POLICIES
            },
            **agreement,
            "contiguous_halves": {
                "split_half_translation_mm": contiguous.translation_mm,
                "split_half_rotation_deg": contiguous.rotation_deg,
                "split_half_nees_per_dof": contiguous.nees / 6,
            },
        }


def study_holdout(
    recordings: Sequence[Recording],
    *,
    model: ModelName = ModelName.AUTO,
    trials: int = 50,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Holdout:
    """Run 3 + 5 views with a third held out, and as many random halvings of all views.

    Raises
    ------
    InputError
        A recording with too few views.
    """
    comparison = Comparison(
        Protocol(trials=trials, seed=seed, held_out_share=HELD_OUT_SHARE), ModelName(model)
    )
    jobs = [
        _Halving(recording, comparison.model, seed, tuple(range(i, min(i + HALVES_PER_PIECE, trials))))
        for recording in recordings
        for i in range(0, trials, HALVES_PER_PIECE)
    ]
    first = piece_count(len(recordings), comparison.protocol)
    total = first + len(jobs)
    results = compare(recordings, comparison, workers=workers, progress=part_of(progress, 0, total))
    agreements = run_all(_halve, jobs, workers=workers, progress=part_of(progress, first, total))
    halves = tuple(
        tuple(
            agreement
            for job, found in zip(jobs, agreements, strict=True)
            if job.recording is recording
            for agreement in found
        )
        for recording in recordings
    )
    contiguous = tuple(
        _agreement(Measurements.of_recording(recording), contiguous_halves(recording), comparison.model)
        for recording in recordings
    )
    return Holdout(comparison.model, comparison.protocol, tuple(results), halves, contiguous)


@dataclass(frozen=True)
class _Halving:
    recording: Recording
    model: ModelName
    seed: int
    numbers: tuple[int, ...]


def _halve(job: _Halving) -> list[Agreement]:
    measurements = Measurements.of_recording(job.recording)
    return [
        _agreement(measurements, random_halves(job.recording, job.seed, number), job.model)
        for number in job.numbers
    ]


def _agreement(
    measurements: Measurements, halves: tuple[tuple[int, ...], tuple[int, ...]], model: ModelName
) -> Agreement:
    estimator = make_estimator(model)
    first, second = (estimator(measurements.select(half)) for half in halves)
    difference = metrics.split_half_difference(first, second)
    return Agreement(
        difference.translation_mm, difference.rotation_deg, metrics.split_half_nees(first, second)
    )
