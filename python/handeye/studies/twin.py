"""The paper's table II on a twin of its cell: errors on a validation part, three policies, and the truth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.compute.checkpoint import Checkpoint
from handeye.compute.parallel import Progress, Workers, part_of, run_all
from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements
from handeye.estimation.paper import paper_estimate
from handeye.robots import ArmKinematics, open_arm
from handeye.simulation.twin import ARM, TwinOptions, TwinSet, twin_set
from handeye.studies.comparison import (
    POLICIES,
    Comparison,
    SetResult,
    TrialResult,
    pooled,
    run_policy,
    run_trial,
)
from handeye.studies.curves import Curves, correlations
from handeye.studies.protocol import Protocol, Trial, draw_trials
from handeye.types import Pose, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.validation.metrics import summary

METRICS = (
    "relative_translation_mm",
    "relative_rotation_deg",
    "rmse_px",
    "relative_translation_at_target_mm",
    "translation_mm",
    "rotation_deg",
)
SETS = 7
TRIALS_PER_PIECE = 2
# The paper's model; our default from poses alone; our default where the description of the arm is known.
MODELS = ("paper", "auto", "auto_with_arm")


@dataclass(frozen=True, eq=False)
class Twin:
    """All sets under all models."""

    seed: int
    trials: int
    options: TwinOptions
    sets: tuple[TwinSet, ...]
    models: dict[str, Curves]

    def values(self, model: str, policy: str, metric: str) -> FloatArray:
        """(sets x trials,) values of a metric after the last view."""
        return pooled(self.models[model].sets, policy, metric)

    def together(self, model: str) -> SetResult:
        """Return all trials of all sets as one."""
        return SetResult("all sets", tuple(t for result in self.models[model].sets for t in result.trials))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        protocol = next(iter(self.models.values())).protocol
        return {
            "study": "twin",
            "arm": ARM,
            "seed": self.seed,
            "set_count": len(self.sets),
            "trials_per_set": self.trials,
            "start_views": protocol.start_views,
            "added_views": protocol.added_views,
            "rendered": self.options.rendered,
            "arm_error": {
                "translation_mm": float(np.mean([s.arm_error_mm for s in self.sets])),
                "rotation_deg": float(np.mean([s.arm_error_deg for s in self.sets])),
            },
            "models": {name: self._model(name) for name in self.models},
        }

    def _model(self, name: str) -> dict[str, Any]:
        found = [c for result in self.models[name].sets for c in correlations(result)]
        return {
            "policies": {
                policy: {metric: summary(self.values(name, policy, metric)) for metric in METRICS}
                for policy in POLICIES
            },
            "correlation": {
                "median": float(np.median(found)) if found else float("nan"),
                "trials": len(found),
            },
        }


def study_twin(
    *,
    models: Sequence[str] = MODELS,
    sets: int = SETS,
    trials: int = 10,
    options: TwinOptions | None = None,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Twin:
    """Run 3 + 5 views of the training part of every set, and measure on its validation part.

    Under the paper's model every candidate of the first step is tried too, for the correlation of predicted
    gain and realised fall of the RMSE.

    Raises
    ------
    InputError
        An unknown model, or no set.
    """
    unknown = [model for model in models if model not in MODELS]
    if unknown or not models or sets < 1:
        raise InputError(
            f"models {', '.join(models)}, {sets} sets: expected some of {', '.join(MODELS)}, and a set",
            code=Code.OUT_OF_RANGE,
        )
    options = options or TwinOptions()
    protocol = Protocol(trials=trials, seed=seed)
    pieces_per_set = -(-trials // TRIALS_PER_PIECE)
    total = sets * (1 + len(models) * pieces_per_set)
    make = partial(twin_set, options=options, seed=seed)
    # A checkpoint keeps what is measured; sets are drawn again, they are the same.
    makers = workers.workers if isinstance(workers, Checkpoint) else workers
    made = run_all(make, range(sets), workers=makers, progress=part_of(progress, 0, total))
    found: dict[str, Curves] = {}
    for number, model in enumerate(models):
        comparison = _comparison(model, protocol)
        drawn = [_trials(one, protocol) for one in made]
        pieces = [
            _Piece(one, comparison, tuple(some[i : i + TRIALS_PER_PIECE]))
            for one, some in zip(made, drawn, strict=True)
            for i in range(0, trials, TRIALS_PER_PIECE)
        ]
        before = sets * (1 + number * pieces_per_set)
        done = run_all(_run, pieces, workers=workers, progress=part_of(progress, before, total))
        results = tuple(
            SetResult(
                one.recording.name,
                tuple(
                    result
                    for piece, some in zip(pieces, done, strict=True)
                    if piece.one is one
                    for result in some
                ),
            )
            for one in made
        )
        found[model] = Curves(comparison.model, protocol, results)
    return Twin(seed, trials, options, tuple(made), found)


def trajectories(twin: Twin, number: int = 0) -> dict[str, list[Pose]]:
    """Return where the camera stood at every view of the first trial of a set, by policy, paper's model.

    By the truth: the poses of the base that the answers lead to would differ by policy.
    """
    one = twin.sets[number]
    protocol = Protocol(trials=1, seed=twin.seed)
    (trial,) = _trials(one, protocol)
    measurements = Measurements.of_recording(one.recording)
    truth = one.recording.truth
    X = Pose.identity() if truth is None or truth.X is None else truth.X
    return {policy: _path(measurements, trial, policy, protocol, X) for policy in POLICIES}


def _path(measurements: Measurements, trial: Trial, policy: str, protocol: Protocol, X: Pose) -> list[Pose]:
    noting = _Noting()
    run_policy(measurements, trial, policy, Comparison(protocol, ModelName.PAPER), noting)
    return [view.T_base_flange @ X.inverse() for view in noting.taken]


class _Noting:
    """The paper's estimate; notes which views it was last given."""

    def __init__(self) -> None:
        self.taken: tuple[View, ...] = ()

    def __call__(self, measurements: Measurements, previous: Estimate | None = None) -> Estimate:
        self.taken = measurements.views
        return paper_estimate(measurements, previous)


@dataclass(frozen=True, eq=False)
class _Piece:
    one: TwinSet
    comparison: Comparison
    trials: tuple[Trial, ...]


def _comparison(model: str, protocol: Protocol) -> Comparison:
    if model == "paper":
        return Comparison(protocol, ModelName.PAPER, scatter=True)
    arm = ArmKinematics(open_arm(ARM)) if model == "auto_with_arm" else None
    return Comparison(protocol, ModelName.AUTO, kinematics=arm)


def _trials(one: TwinSet, protocol: Protocol) -> list[Trial]:
    """Draw starts from the training part; all of the validation part is held out."""
    views = one.recording.views
    training = one.recording.with_views([views[i] for i in one.training])
    return [
        replace(
            trial,
            start=tuple(one.training[i] for i in trial.start),
            pool=tuple(one.training[i] for i in trial.pool),
            held_out=one.validation,
        )
        for trial in draw_trials(training, protocol)
    ]


def _run(piece: _Piece) -> list[TrialResult]:
    measurements = Measurements.of_recording(piece.one.recording)
    truth = piece.one.recording.truth
    X_true = None if truth is None else truth.X
    return [run_trial(measurements, trial, piece.comparison, X_true) for trial in piece.trials]


__all__ = ["MODELS", "SETS", "Twin", "study_twin", "trajectories"]
