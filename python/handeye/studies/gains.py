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
from handeye.types.calibration import ModelName
from handeye.validation import metrics

CRITERIA = ("entropy", "entropy_handeye")
CANDIDATES, DRAWS, HELD_OUT = 25, 50, 20
QUANTITIES = ("log_translation", "log_rotation", "log_error", "rmse_px")
# First number of the steps that are held out: their noise is that of no other view.
HELD_OUT_STEP = 1000


@dataclass(frozen=True)
class GainScatter:
    """One start: gains of its candidates, and what each brought in every draw.

    Parameters
    ----------
    gains
        (N,) by criterion.
    reductions
        (N, D) by quantity: the natural logarithm of the error of the camera's centre, of its rotation, and
        the mean of the two; and the RMSE on held-out views, px.
    """

    gains: dict[str, tuple[float, ...]]
    reductions: dict[str, tuple[tuple[float, ...], ...]]

    def correlations(self, criterion: str, quantity: str) -> tuple[float, float]:
        """Pearson's correlation of the gain with the mean over the draws, and the mean of that with each."""
        predicted, found = np.array(self.gains[criterion]), np.array(self.reductions[quantity])
        expected = float(np.corrcoef(predicted, found.mean(axis=1))[0, 1])
        single = [float(np.corrcoef(predicted, column)[0, 1]) for column in found.T]
        return expected, float(np.mean(single))


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
        }

    def _summary(self, criterion: str, quantity: str) -> dict[str, float]:
        both = np.array([start.correlations(criterion, quantity) for start in self.starts])
        expected, single = both.T
        low, high = np.percentile(expected, [25, 75])
        return {
            "expected_median": float(np.median(expected)),
            "expected_lower_quartile": float(low),
            "expected_upper_quartile": float(high),
            "single_median": float(np.median(single)),
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
    measured = _taken(cell, start, 0)
    estimate = estimator(measured)
    motions = np.array([job.mounting.chain(one.T_base_flange).matrix for one in offered])
    joints = np.array([one.joints_rad for one in offered])
    predicted = {
        name: gains(estimate, _core.Criterion(name), motions, Sight(known=True), joints=joints)
        for name in CRITERIA
    }
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
        {name: tuple(gains.tolist()) for name, gains in predicted.items()},
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
