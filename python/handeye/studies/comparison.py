"""The same starts under several policies, measured after every view: what tables and curves are made of."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from handeye import _core
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.estimation import Estimate, Estimator, Measurements, make_estimator
from handeye.planning import NumberOfViews, Planner, PlannerOptions, Pool, Proposal, make_policy
from handeye.planning.prediction import Sight
from handeye.studies.protocol import Protocol, Trial, draw_trials
from handeye.types import Pose, Recording
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.types.kinematics import Kinematics
from handeye.validation import metrics

# The paper's three, in the order of its table I.
POLICIES = ("next_best_view", "random", "max_distance")
# Trials that one process does in a row: enough to be worth the sending, few enough to keep all busy.
TRIALS_PER_PIECE = 5


@dataclass(frozen=True)
class Metrics:
    """What is measured after each view; NaN where there is no truth or nothing was held out."""

    entropy_nats: float
    rmse_px: float = float("nan")
    relative_translation_mm: float = float("nan")
    relative_rotation_deg: float = float("nan")
    relative_translation_at_target_mm: float = float("nan")
    translation_mm: float = float("nan")
    rotation_deg: float = float("nan")
    nees: float = float("nan")


METRIC_NAMES = tuple(Metrics.__dataclass_fields__)


def measure(estimate: Estimate, held_out: Measurements, X_true: Pose | None) -> Metrics:
    """Measure an estimate on held-out views (at least 2, or none) and against the truth if there is one."""
    values: dict[str, float] = {}
    if len(held_out) > 1:
        relative = metrics.relative_error(estimate, held_out)
        values["rmse_px"] = metrics.held_out_rmse_px(estimate, held_out)
        values["relative_translation_mm"] = relative.translation_mm
        values["relative_rotation_deg"] = relative.rotation_deg
        at_target = metrics.relative_error_at_target(estimate, held_out)
        values["relative_translation_at_target_mm"] = at_target.translation_mm
    if X_true is not None:
        absolute = metrics.absolute_error(estimate.X, X_true)
        values["translation_mm"] = absolute.translation_mm
        values["rotation_deg"] = absolute.rotation_deg
        values["nees"] = metrics.nees(estimate.X, estimate.hand_eye_covariance, X_true)
    return Metrics(estimate.entropy, **values)


@dataclass(frozen=True)
class Scatter:
    """All candidates of the first step of a trial: gain predicted for each, and what it brought.

    Parameters
    ----------
    predicted_gain_nats
        Gain of the criterion, before the view is taken.
    rmse_reduction_px
        By how much the held-out RMSE fell once the view was taken.
    """

    predicted_gain_nats: tuple[float, ...]
    rmse_reduction_px: tuple[float, ...]

    @property
    def correlation(self) -> float:
        """Pearson's correlation; NaN for fewer than three candidates or no spread."""
        gains, reductions = np.array(self.predicted_gain_nats), np.array(self.rmse_reduction_px)
        if len(gains) < 3 or np.ptp(gains) == 0 or np.ptp(reductions) == 0:
            return float("nan")
        return float(np.corrcoef(gains, reductions)[0, 1])


@dataclass(frozen=True)
class TrialResult:
    """What became of one start: metrics after 0, 1, 2, ... added views for each policy."""

    trial: Trial
    steps: Mapping[str, tuple[Metrics, ...]]
    scatter: Scatter | None = None


@dataclass(frozen=True)
class SetResult:
    """All trials of one set."""

    name: str
    trials: tuple[TrialResult, ...]

    def values(self, policy: str, metric: str) -> FloatArray:
        """(trials, added views + 1) values of a metric."""
        return np.array([[getattr(m, metric) for m in t.steps[policy]] for t in self.trials])

    def final(self, policy: str, metric: str) -> FloatArray:
        """(trials,) values of a metric after the last view."""
        return self.values(policy, metric)[:, -1]


@dataclass(frozen=True)
class Comparison:
    """What to compare.

    Parameters
    ----------
    protocol
        How the trials are drawn.
    model
        Assumptions of the estimate.
    policies
        Names of the policies.
    criterion
        Criterion that gains are measured in.
    scatter
        Whether every candidate of the first step is tried, for the scatter of predicted and realised gain.
    kinematics
        The arm, if it is known; every view must then have joint positions.
    """

    protocol: Protocol = field(default_factory=Protocol)
    model: ModelName = ModelName.AUTO
    policies: tuple[str, ...] = POLICIES
    criterion: str = "entropy"
    scatter: bool = False
    kinematics: Kinematics | None = None


@dataclass(frozen=True)
class _Piece:
    recording: Recording
    comparison: Comparison
    trials: tuple[Trial, ...]
    prepare: Callable[[Measurements, Trial], Measurements] | None


def compare(
    recordings: Sequence[Recording],
    comparison: Comparison,
    *,
    workers: Workers = 1,
    progress: Progress | None = None,
    prepare: Callable[[Measurements, Trial], Measurements] | None = None,
) -> list[SetResult]:
    """Run every trial of every recording under every policy.

    Parameters
    ----------
    recordings
        The sets, their cameras calibrated.
    prepare
        Changes the measurements of a trial before it begins, such as by noise; a function of a module.

    Raises
    ------
    InputError, DegenerateError
        As `draw_trials`.
    SolveError
        An estimate failed.
    """
    pieces: list[_Piece] = []
    for recording in recordings:
        trials = draw_trials(recording, comparison.protocol)
        pieces += [
            _Piece(recording, comparison, tuple(trials[i : i + TRIALS_PER_PIECE]), prepare)
            for i in range(0, len(trials), TRIALS_PER_PIECE)
        ]
    done = run_all(_run_piece, pieces, workers=workers, progress=progress)
    return [
        SetResult(
            recording.name,
            tuple(
                result
                for piece, results in zip(pieces, done, strict=True)
                if piece.recording is recording
                for result in results
            ),
        )
        for recording in recordings
    ]


def piece_count(sets: int, protocol: Protocol) -> int:
    """Return how many pieces `compare` tells the progress of."""
    return sets * -(-protocol.trials // TRIALS_PER_PIECE)


def _run_piece(piece: _Piece) -> list[TrialResult]:
    whole = Measurements.of_recording(piece.recording)
    results: list[TrialResult] = []
    for trial in piece.trials:
        measurements = whole if piece.prepare is None else piece.prepare(whole, trial)
        results.append(run_trial(measurements, trial, piece.comparison, _truth(piece.recording)))
    return results


def _truth(recording: Recording) -> Pose | None:
    return None if recording.truth is None else recording.truth.X


def run_trial(
    measurements: Measurements, trial: Trial, comparison: Comparison, X_true: Pose | None
) -> TrialResult:
    """Run one start under every policy; all begin with the same estimate."""
    estimator = make_estimator(comparison.model, comparison.kinematics)
    held_out = measurements.select(trial.held_out)
    steps = {
        policy: tuple(
            measure(estimate, held_out, X_true)
            for estimate in run_policy(measurements, trial, policy, comparison, estimator)
        )
        for policy in comparison.policies
    }
    scatter = None
    if comparison.scatter:
        scatter = _scatter(measurements, trial, comparison, estimator, held_out)
    return TrialResult(trial, steps, scatter)


def run_policy(
    measurements: Measurements, trial: Trial, policy: str, comparison: Comparison, estimator: Estimator
) -> list[Estimate]:
    """Return the estimates after 0, 1, 2, ... added views; shorter lists are filled up with the last."""
    count = comparison.protocol.start_views + comparison.protocol.added_views
    planner = _planner(measurements, trial, policy, comparison, estimator, count)
    by_name = {view.name: view for view in measurements.views}
    estimates = [planner.estimate]
    while isinstance(answer := planner.ask(), Proposal):
        estimates.append(planner.tell(by_name[answer.candidate.name]).estimate)
    # A policy that runs out of candidates stays where it is.
    missing = comparison.protocol.added_views + 1 - len(estimates)
    return estimates + [estimates[-1]] * missing


def _planner(
    measurements: Measurements,
    trial: Trial,
    policy: str,
    comparison: Comparison,
    estimator: Estimator,
    count: int,
) -> Planner:
    options = PlannerOptions(
        policy=make_policy(policy),
        criterion=_core.Criterion(comparison.criterion),
        stop_rules=(NumberOfViews(count),),
        sight=Sight(known=True),
        seed=trial.seed,
    )
    pool = Pool.of_views([measurements.views[i] for i in trial.pool])
    return Planner(measurements.select(trial.start), pool, estimator, options)


def _scatter(
    measurements: Measurements,
    trial: Trial,
    comparison: Comparison,
    estimator: Estimator,
    held_out: Measurements,
) -> Scatter:
    planner = _planner(measurements, trial, "next_best_view", comparison, estimator, len(measurements))
    gains = planner.gains()
    before = metrics.held_out_rmse_px(planner.estimate, held_out)
    predicted: list[float] = []
    realised: list[float] = []
    for gain, index in zip(gains, trial.pool, strict=True):
        estimate = estimator(measurements.select([*trial.start, index]), planner.estimate)
        after = metrics.held_out_rmse_px(estimate, held_out)
        if np.isfinite([gain, before, after]).all():
            predicted.append(float(gain))
            realised.append(before - after)
    return Scatter(tuple(predicted), tuple(realised))


def pooled(sets: Iterable[SetResult], policy: str, metric: str) -> FloatArray:
    """(N,) final values of all sets together."""
    return np.concatenate([result.final(policy, metric) for result in sets])
