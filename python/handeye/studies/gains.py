"""What a predicted gain is worth, told apart from noise: expected reductions beside single draws.

A single draw of a candidate's noise says little: what is realised scatters by more than candidates differ.
Here each candidate is taken many times in a twin of the cell, with the noise of all views drawn again, so
that what is left is what the candidate itself brings.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import HandeyeError, InputError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.planning import Candidate
from handeye.planning.prediction import Sight, gains
from handeye.studies.measured_cell import MeasuredCell, measured_cell
from handeye.studies.policies import ARMS, start_of
from handeye.types import Mounting
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.validation import metrics

CRITERIA = ("entropy", "entropy_handeye")
CANDIDATES, DRAWS, HELD_OUT = 25, 50, 20
QUANTITIES = ("log_translation", "log_rotation", "log_error", "rmse_px")
# What the picture shows: the gain for the hand-eye, and what it speaks of.
SHOWN = ("entropy_handeye", "log_error")
SMALLEST_RELIABILITY = 1e-3
# First number of the steps that are held out: their noise is that of no other view.
HELD_OUT_STEP = 1000


@dataclass(frozen=True)
class GainScatter:
    """One start: gains of its candidates, and what each brought in every draw.

    Parameters
    ----------
    gains
        (N,) by criterion, as the estimate of the first draw predicts them.
    mean_gains
        (N,) by criterion: the mean of what the estimates of all draws predict; their starts differ in noise.
    reductions
        (N, D) by quantity: the natural logarithm of the error of the camera's centre, of its rotation, and
        the mean of the two; and the RMSE on held-out views, px.
    """

    gains: dict[str, tuple[float, ...]]
    mean_gains: dict[str, tuple[float, ...]]
    reductions: dict[str, tuple[tuple[float, ...], ...]]

    def correlations(self, criterion: str, quantity: str) -> dict[str, float]:
        """Pearson's correlations of predicted gains with what candidates brought.

        `expected`: with the mean over the draws. `corrected`: as with a mean of infinitely many (Spearman's
        correction for attenuation). `mean_gain`: of the mean gain, with the mean over the draws. `single`:
        the mean of those with each draw.
        """
        predicted, found = np.array(self.gains[criterion]), np.array(self.reductions[quantity])
        expected = _correlation(predicted, found.mean(axis=1))
        return {
            "expected": expected,
            "corrected": min(1.0, expected / np.sqrt(reliability(found))),
            "mean_gain": _correlation(np.array(self.mean_gains[criterion]), found.mean(axis=1)),
            "single": float(np.mean([_correlation(predicted, column) for column in found.T])),
        }

    def points(self, criterion: str, quantity: str) -> dict[str, list[float]]:
        """Return the gain of each candidate, what it brought in the mean and in the first draw."""
        found = np.array(self.reductions[quantity])
        return {
            "gain": list(self.gains[criterion]),
            "expected": found.mean(axis=1).tolist(),
            "single": found[:, 0].tolist(),
        }


def _correlation(one: FloatArray, other: FloatArray) -> float:
    return float(np.corrcoef(one, other)[0, 1])


def reliability(found: FloatArray) -> float:
    """Return the share of the variance of the means over draws (N, D) that is the candidates' own.

    What all candidates of a draw have in common, the noise of its start, changes no difference between them.
    """
    count = found.shape[1]
    means = found.mean(axis=1)
    rest = found - means[:, np.newaxis] - found.mean(axis=0) + found.mean()
    noise = np.sum(rest**2) / ((len(found) - 1) * (count - 1)) / count
    return max(1.0 - float(noise / np.var(means, ddof=1)), SMALLEST_RELIABILITY)


@dataclass(frozen=True)
class Gains:
    """All starts."""

    seed: int
    arm: str
    mounting: Mounting
    draws: int
    starts: tuple[GainScatter, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "study": "gains",
            "seed": self.seed,
            "arm": self.arm,
            "mounting": self.mounting.value,
            "starts": len(self.starts),
            "draws": self.draws,
            "candidates": len(next(iter(self.starts[0].gains.values()))),
            "correlation": {
                criterion: {quantity: self._summary(criterion, quantity) for quantity in QUANTITIES}
                for criterion in CRITERIA
            },
            "points": [start.points(*SHOWN) for start in self.starts],
        }

    def _summary(self, criterion: str, quantity: str) -> dict[str, float]:
        found = [start.correlations(criterion, quantity) for start in self.starts]
        low, high = np.percentile([one["expected"] for one in found], [25, 75])
        return {
            **{f"{name}_median": float(np.median([one[name] for one in found])) for name in found[0]},
            "expected_lower_quartile": float(low),
            "expected_upper_quartile": float(high),
        }


def study_gains(
    *,
    mounting: Mounting = Mounting.EYE_IN_HAND,
    arm: str = "realistic",
    model: ModelName = ModelName.AUTO,
    trials: int = 20,
    candidates: int = CANDIDATES,
    draws: int = DRAWS,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Gains:
    """Predict the gain of every candidate of a first step, and take each many times.

    Raises
    ------
    InputError
        Fewer than three candidates, or fewer than two draws.
    SolveError
        A cell could not be drawn.
    """
    if candidates < 3 or draws < 2:
        raise InputError(
            f"{candidates} candidates, {draws} draws: expected at least 3 and 2", code=Code.OUT_OF_RANGE
        )
    jobs = [_Job(number, mounting, arm, model, candidates, draws, seed) for number in range(trials)]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    return Gains(seed, arm, mounting, draws, tuple(done))


@dataclass(frozen=True)
class _Job:
    number: int
    mounting: Mounting
    arm: str
    model: ModelName
    candidates: int
    draws: int
    seed: int


def _run(job: _Job) -> GainScatter:
    size = 3 + job.candidates + HELD_OUT
    cell = measured_cell(job.number, job.mounting, ARMS[job.arm], pool_size=size, seed=job.seed)
    start, pool = start_of(cell, job.number, job.seed)
    offered, held_out = pool.candidates[: job.candidates], pool.candidates[job.candidates :]
    estimator = make_estimator(job.model, cell.kinematics if job.model is ModelName.AUTO else None)
    motions = np.array([job.mounting.chain(one.T_base_flange).matrix for one in offered])
    joints = np.array([one.joints_rad for one in offered])
    predicted: dict[str, list[FloatArray]] = {name: [] for name in CRITERIA}
    judged = cell.empty().with_views(
        [
            cell.measure(one.joints_rad or (), HELD_OUT_STEP + k, f"held_out_{k}")
            for k, one in enumerate(held_out)
        ]
    )
    shape = (len(offered), job.draws)
    reductions = {quantity: np.zeros(shape) for quantity in QUANTITIES}
    for draw in range(job.draws):
        begun = _taken(cell, start, draw)
        before = estimator(begun)
        for name, drawn in predicted.items():
            drawn.append(gains(before, _core.Criterion(name), motions, Sight(known=True), joints=joints))
        first = _quality(before, cell, judged)
        for k, one in enumerate(offered):
            view = cell.measure(one.joints_rad or (), len(start), one.name, draw)
            try:
                after = _quality(estimator(begun.with_views([view]), before), cell, judged)
            except HandeyeError:
                after = first
            for quantity, value in after.items():
                reductions[quantity][k, draw] = first[quantity] - value
    # Plain numbers, which a checkpoint keeps.
    return GainScatter(
        {name: tuple(drawn[0].tolist()) for name, drawn in predicted.items()},
        {name: tuple(np.mean(drawn, axis=0).tolist()) for name, drawn in predicted.items()},
        {name: tuple(map(tuple, found.tolist())) for name, found in reductions.items()},
    )


def _taken(cell: MeasuredCell, candidates: Sequence[Candidate], draw: int) -> Measurements:
    return cell.empty().with_views(
        [cell.measure(one.joints_rad or (), step, one.name, draw) for step, one in enumerate(candidates)]
    )


def _quality(estimate: Estimate, cell: MeasuredCell, held_out: Measurements) -> dict[str, float]:
    error = metrics.absolute_error(estimate.X, cell.X)
    translation, rotation = float(np.log(error.translation_mm)), float(np.log(error.rotation_deg))
    return {
        "log_translation": translation,
        "log_rotation": rotation,
        "log_error": 0.5 * (translation + rotation),
        "rmse_px": metrics.held_out_rmse_px(estimate, held_out),
    }
