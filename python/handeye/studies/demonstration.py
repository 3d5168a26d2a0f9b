"""What choosing views is worth, shown on one recording with known truth: numbers and a sentence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.compute.parallel import Progress, run_all
from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.studies.comparison import POLICIES, Comparison, run_policy
from handeye.studies.protocol import Protocol, Trial, draw_trials
from handeye.types import Pose, Recording
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.types.units import MM_PER_M
from handeye.validation.metrics import absolute_error

# Starts that one process does in a row.
STARTS_PER_PIECE = 3

_WORDS = {
    "next_best_view": "views chosen for their gain",
    "random": "random views",
    "max_distance": "the most distant views",
}


@dataclass(frozen=True)
class Way:
    """A policy under a model."""

    policy: str
    model: ModelName = ModelName.AUTO


# Every policy under the default model, and the paper's policy under the paper's own model.
WAYS = (*(Way(policy) for policy in POLICIES), Way("next_best_view", ModelName.PAPER))


@dataclass(frozen=True, eq=False)
class Curve:
    """What one way reached from every start, after each view.

    Parameters
    ----------
    translation_mm, rotation_deg
        (S, V) true error of the camera's pose from S starts with V numbers of views.
    sigma_translation_mm
        (S, V) standard deviation of its position as the answer states it.
    """

    way: Way
    translation_mm: FloatArray
    rotation_deg: FloatArray
    sigma_translation_mm: FloatArray

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            name: {"mean": values.mean(axis=0).tolist(), "median": np.median(values, axis=0).tolist()}
            for name, values in (
                ("translation_mm", self.translation_mm),
                ("rotation_deg", self.rotation_deg),
                ("sigma_translation_mm", self.sigma_translation_mm),
            )
        }


@dataclass(frozen=True, eq=False)
class Demonstration:
    """The same random starts continued in several ways."""

    recording: Recording
    protocol: Protocol
    curves: Mapping[Way, Curve]

    @property
    def views(self) -> tuple[int, ...]:
        """Numbers of views at which the curves have their values."""
        first = self.protocol.start_views
        return tuple(range(first, first + self.protocol.added_views + 1))

    @property
    def sentence(self) -> str:
        """What it shows, in one sentence that the numbers decide."""
        final = {policy: self._mean(Way(policy))[-1] for policy in POLICIES}
        best, *rest = sorted(POLICIES, key=lambda policy: final[policy])
        others = " and ".join(f"{_WORDS[policy]} {final[policy]:.2g} mm" for policy in rest)
        taken = f"After {self.protocol.start_views} + {self.protocol.added_views} views"
        text = f"{taken}, {_WORDS[best]} leave the camera {final[best]:.2g} mm off on average, {others}"
        chosen, chance = self._mean(Way(best)), final["random"]
        enough = int(np.argmax(chosen <= chance))
        if best != "random" and enough < self.protocol.added_views:
            text += f"; {enough} of the former are worth {self.protocol.added_views} random ones"
        return f"{text}."

    def _mean(self, way: Way) -> FloatArray:
        return self.curves[way].translation_mm.mean(axis=0)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys; lists run over the number of views."""
        return {
            "recording": self.recording.name,
            "source": self.recording.source,
            "seed": self.protocol.seed,
            "starts": self.protocol.trials,
            "views": list(self.views),
            "policies": {policy: self.curves[Way(policy)].to_dict() for policy in POLICIES},
            "paper_model": {
                way.policy: curve.to_dict()
                for way, curve in self.curves.items()
                if way.model is ModelName.PAPER
            },
            "sentence": self.sentence,
        }


def demonstrate(
    recording: Recording,
    *,
    starts: int = 12,
    added_views: int = 5,
    seed: int = 0,
    workers: int = 1,
    progress: Progress | None = None,
) -> Demonstration:
    """Continue random starts of three views in every one of `WAYS`, and compare each answer with the truth.

    The result is the same for the same seed, whatever the number of workers.

    Raises
    ------
    InputError
        A recording without truth, or with too few views.
    DegenerateError
        No three views turn about two axes.
    """
    if recording.truth is None or recording.truth.X is None:
        raise InputError(
            f"{recording.name}: no truth to compare with, expected [truth] with {recording.mounting.x_name}",
            code=Code.NO_TRUTH,
        )
    protocol = Protocol(trials=starts, added_views=added_views, seed=seed)
    trials = draw_trials(recording, protocol)
    jobs = [
        _Job(recording, recording.truth.X, protocol, tuple(trials[i : i + STARTS_PER_PIECE]))
        for i in range(0, len(trials), STARTS_PER_PIECE)
    ]
    rows = [row for done in run_all(_run, jobs, workers=workers, progress=progress) for row in done]
    values = np.array(rows)
    curves = {way: Curve(way, *(values[:, k, :, j] for j in range(3))) for k, way in enumerate(WAYS)}
    return Demonstration(recording, protocol, curves)


@dataclass(frozen=True)
class _Job:
    recording: Recording
    X_true: Pose
    protocol: Protocol
    trials: tuple[Trial, ...]


_Row = list[list[tuple[float, float, float]]]


def _run(job: _Job) -> list[_Row]:
    measurements = Measurements.of_recording(job.recording)
    return [[_steps(job, measurements, trial, way) for way in WAYS] for trial in job.trials]


def _steps(job: _Job, measurements: Measurements, trial: Trial, way: Way) -> list[tuple[float, float, float]]:
    comparison = Comparison(job.protocol, way.model)
    estimates = run_policy(measurements, trial, way.policy, comparison, make_estimator(way.model))
    return _measured(estimates, job.X_true)


def _measured(estimates: Sequence[Estimate], X_true: Pose) -> list[tuple[float, float, float]]:
    steps: list[tuple[float, float, float]] = []
    for estimate in estimates:
        error = absolute_error(estimate.X, X_true)
        sigma = MM_PER_M * float(np.sqrt(np.trace(estimate.hand_eye_covariance[:3, :3])))
        steps.append((error.translation_mm, error.rotation_deg, sigma))
    return steps
