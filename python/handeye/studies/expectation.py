"""What accuracy to expect from a board, a distance, an arm and a number of views, before anything is bought.

A few cells like the one that is asked about are simulated up to `MEASURED` views. For more views the planner
chooses candidates and says what covariance they leave, as it does for `handeye plan --together`: nothing is
measured then, so fifty views cost hardly more than six.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import HandeyeError, InputError, SolveError
from handeye.estimation import Estimate
from handeye.estimation.confidence import within
from handeye.planning.batch import plan_batch
from handeye.planning.feasibility import Generator
from handeye.session.configuration import Prepared, begin, prepare
from handeye.session.deciding import START_VIEWS
from handeye.session.loop import End, Session
from handeye.session.settings import Configuration
from handeye.types import Target
from handeye.types.arrays import FloatArray
from handeye.types.calibration import MM_PER_M

# Views that are simulated; what further ones leave is predicted from these.
MEASURED = 6
# Cells that are simulated, and the seed of the first: far from the seeds that people use.
CELLS, FIRST_SEED = 6, 770_000
_DRAWS = 4000


@dataclass(frozen=True)
class Level:
    """What is expected after a number of views.

    Parameters
    ----------
    views
        Number of views.
    mean_mm, mean_deg
        Mean error of the camera's centre and of its rotation.
    within_mm, within_deg
        Radii that would be stated: 95 % of errors lie within.
    """

    views: int
    mean_mm: float
    mean_deg: float
    within_mm: float
    within_deg: float

    def to_dict(self) -> dict[str, float]:
        """Return plain values for JSON."""
        return dict(vars(self))


@dataclass(frozen=True, eq=False)
class Expectation:
    """Levels by number of views, and what is expected without each source of error."""

    levels: tuple[Level, ...]
    cells: int

    def at(self, views: int) -> Level:
        """Return the level after a number of views.

        Raises
        ------
        InputError
            It was not asked for.
        """
        for level in self.levels:
            if level.views == views:
                return level
        raise InputError(f"{views} views: not among those asked for", code="out_of_range")


@dataclass(frozen=True)
class _Job:
    configuration: Configuration
    target: Target | None
    views: tuple[int, ...]


def expect(
    configuration: Configuration,
    views: Sequence[int],
    *,
    target: Target | None = None,
    cells: int = CELLS,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Expectation:
    """Return what accuracy a cell is expected to reach.

    Parameters
    ----------
    configuration
        The cell, simulated: arm, mounting, limits of views, errors, noise of the pixels (`points_only`).
    views
        Numbers of views, each at least three.
    target
        What is looked at; the simulated cell's own without it.
    cells
        Number of cells that are simulated.

    Raises
    ------
    InputError
        A number of views below three, or no cell.
    SolveError
        None of the cells has an answer.
    """
    if cells < 1 or not views or min(views) < START_VIEWS:
        raise InputError(
            f"{cells} cells, {min(views, default=0)} views: expected at least 1 and {START_VIEWS}",
            code="out_of_range",
        )
    numbers = tuple(sorted(set(views)))
    most = min(MEASURED, numbers[-1])
    asked = replace(configuration, accuracy_mm=None, accuracy_deg=None, most_views=most)
    jobs = [_Job(replace(asked, seed=FIRST_SEED + i), target, numbers) for i in range(cells)]
    rows = [row for row in run_all(_foretold, jobs, workers=workers, progress=progress) if row is not None]
    if not rows:
        raise SolveError("none of the cells has an answer", hint="allow other distances, or a smaller board")
    values = np.nanmean(np.array(rows), axis=0)
    levels = [
        Level(n, *(float(v) for v in value))
        for n, value in zip(numbers, values, strict=True)
        if np.all(np.isfinite(value))
    ]
    return Expectation(tuple(levels), len(rows))


def _foretold(job: _Job) -> FloatArray | None:
    """(V, 4) mean errors in mm and deg and 95 % radii after each number of views; None without an answer."""
    prepared = prepare(job.configuration, target=job.target)
    rows = np.full((len(job.views), 4), np.nan)
    with tempfile.TemporaryDirectory(prefix="handeye-") as folder:
        session, store = begin(prepared, Path(folder) / "s")
        try:
            known = _estimates(session)
        except HandeyeError:
            return None
        finally:
            store.close()
    if not known:
        return None
    for estimate, count in known:
        if count in job.views:
            rows[job.views.index(count)] = _level(estimate.hand_eye_covariance, estimate)
    last = known[-1][0]
    postures = [view.joints_rad for view in reversed(session.views) if view.joints_rad is not None]
    ahead = [n for n in job.views if n > MEASURED]
    if ahead:
        for number, covariance in zip(ahead, _predicted(prepared, last, postures, ahead), strict=True):
            rows[job.views.index(number)] = _level(covariance, last)
    return rows


def _estimates(session: Session) -> "list[tuple[Estimate, int]]":
    """Run a session; return what was believed after each number of views, where that was determined."""
    found: list[tuple[Estimate, int]] = []
    while not isinstance(step := session.next(), End):
        if step.estimate is not None and step.estimate.determined:
            found.append((step.estimate, len(session.views)))
        session.take(step)
    if step.estimate is not None and step.estimate.determined:
        found.append((step.estimate, len(session.views)))
    return found


def _predicted(
    prepared: Prepared, estimate: Estimate, postures: Sequence[Sequence[float]], ahead: Sequence[int]
) -> list[FloatArray]:
    """Return the covariances (6, 6) that the planner predicts after more views."""
    configuration, workspace = prepared.configuration, prepared.cell.workspace
    assert workspace is not None  # a simulated cell has one
    generator = Generator(prepared.arm, workspace, configuration.limits)
    drawn = generator.draw(estimate, postures, np.random.default_rng([configuration.seed, 9]))
    most = len(drawn.pool)
    return [
        plan_batch(estimate, drawn.pool, min(n - MEASURED, most), sight=drawn.sight).covariance for n in ahead
    ]


def _level(covariance: FloatArray, estimate: Estimate) -> tuple[float, float, float, float]:
    radii = within(covariance, estimate.degrees_of_freedom)
    millimetres = MM_PER_M * mean_length(covariance[:3, :3])
    degrees = float(np.rad2deg(mean_length(covariance[3:, 3:])))
    return millimetres, degrees, radii.translation_mm, radii.rotation_deg


def mean_length(covariance: FloatArray) -> float:
    """Return the mean length of a Gaussian vector of this covariance (3, 3), in its unit."""
    draws = np.random.default_rng(21).standard_normal((_DRAWS, 3))
    variances = np.clip(np.linalg.eigvalsh(covariance), 0, None)
    return float(np.sqrt(np.square(draws) @ variances).mean())


def reached(job: tuple[Configuration, Target | None]) -> tuple[float, float] | None:
    """Run a simulated cell to its number of views; return the true error in mm and deg, None without answer."""
    configuration, target = job
    prepared = prepare(configuration, target=target)
    truth: Any = prepared.truth
    with tempfile.TemporaryDirectory(prefix="handeye-") as folder:
        session, store = begin(prepared, Path(folder) / "s")
        try:
            end = session.run()
        except HandeyeError:
            return None
        finally:
            store.close()
    if end.calibration is None or truth is None or truth.X is None:
        return None
    off = (end.calibration.X @ truth.X.inverse()).log()
    return MM_PER_M * float(np.linalg.norm(off[:3])), float(np.rad2deg(np.linalg.norm(off[3:])))
