"""What accuracy to expect from a board, a distance, an arm and a number of views, before anything is bought.

A few cells like the one that is asked about are simulated up to `MEASURED` views. For more views the planner
chooses candidates and says what covariance they leave, as it does for `handeye plan --together`: nothing is
measured then, so fifty views cost hardly more than twelve. What is stated is on the safe side; by how much is
read off the simulated cells, whose truth is known: the mean error that is foretold is the stated one times
that ratio.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from handeye.codes import Code
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import HandeyeError, InputError, SolveError
from handeye.estimation import Estimate
from handeye.estimation.confidence import within
from handeye.planning.batch import plan_batch
from handeye.planning.feasibility import Generator
from handeye.session.configuration import begin, prepare
from handeye.session.deciding import START_VIEWS
from handeye.session.loop import End, Session
from handeye.session.prepared import Prepared
from handeye.session.settings import Configuration
from handeye.types import Pose, Target
from handeye.types.arrays import FloatArray
from handeye.types.units import MM_PER_M

# Views that are simulated; what further ones leave is predicted from these.
MEASURED = 12
# Numbers of views on either side over which the ratio of errors made and stated is averaged.
_AROUND = 2
# Cells that are simulated, and the seed of the first: far from the seeds that people use. So many know the
# mean of an error whose deviation is 0.6 of it, as where most of it is in one direction, to an eighteenth.
CELLS, FIRST_SEED = 120, 770_000
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
        raise InputError(f"{views} views: not among those asked for", code=Code.OUT_OF_RANGE)


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
        None of the cells has an answer, or comes to so many views.
    """
    if cells < 1 or not views or min(views) < START_VIEWS:
        raise InputError(
            f"{cells} cells, {min(views, default=0)} views: expected at least 1 and {START_VIEWS}",
            code=Code.OUT_OF_RANGE,
        )
    numbers = tuple(sorted(set(views)))
    most = min(MEASURED, numbers[-1])
    asked = replace(configuration, accuracy_mm=None, accuracy_deg=None, most_views=most)
    jobs = [_Job(replace(asked, seed=FIRST_SEED + i), target, numbers) for i in range(cells)]
    told = [one for one in run_all(_told, jobs, workers=workers, progress=progress) if one is not None]
    if not told:
        raise SolveError("none of the cells has an answer", hint="allow other distances, or a smaller board")
    levels: list[Level] = []
    for number in numbers:
        stated = [one.stated[number] for one in told if number in one.stated]
        if not stated:
            raise SolveError(
                f"none of {cells} cells came to {number} views: no pose left shows the target as asked",
                hint="allow other distances or angles, or ask for fewer views",
            )
        mean_mm, mean_deg, *radii = np.mean(stated, axis=0)
        by_mm, by_deg = _made_of_stated(told, min(number, MEASURED))
        levels.append(Level(number, float(by_mm * mean_mm), float(by_deg * mean_deg), *map(float, radii)))
    return Expectation(tuple(levels), len(told))


@dataclass(frozen=True)
class _Told:
    """Of a cell, by number of views: mean errors as stated and 95 % radii, and the errors that were made."""

    stated: dict[int, tuple[float, float, float, float]]
    made: dict[int, tuple[float, float]]


def _made_of_stated(told: Sequence[_Told], number: int) -> FloatArray:
    """(2,) mean errors that were made over the mean of those stated, averaged around a number of views.

    The mean of the cells' own ratios would be too large: what is stated is large in cells that are known
    badly by chance, and in those the ratio is small.
    """
    ratios: list[FloatArray] = []
    for near in range(number - _AROUND, number + _AROUND + 1):
        pairs = [(one.made[near], one.stated[near][:2]) for one in told if near in one.made]
        if pairs:
            made, stated = np.array(pairs).mean(axis=0)
            ratios.append(made / stated)
    return np.asarray(np.mean(ratios, axis=0), dtype=np.float64)


def _told(job: _Job) -> _Told | None:
    """Return what a cell stated and made of errors; None without an answer."""
    prepared = prepare(job.configuration, target=job.target)
    if prepared.truth is None or prepared.truth.X is None:
        return None
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
    stated = {count: _level(estimate.hand_eye_covariance, estimate) for estimate, count in known}
    made = {count: _errors(estimate.X, prepared.truth.X) for estimate, count in known}
    last = known[-1][0]
    postures = [view.joints_rad for view in reversed(session.views) if view.joints_rad is not None]
    ahead = [n for n in job.views if n > MEASURED]
    if ahead:
        for number, covariance in zip(ahead, _predicted(prepared, last, postures, ahead), strict=True):
            stated[number] = _level(covariance, last)
    return _Told(stated, made)


def _errors(X: Pose, X_true: Pose) -> tuple[float, float]:
    """Return the error of the camera's centre in mm and of its rotation in deg."""
    off = (X @ X_true.inverse()).log()
    return MM_PER_M * float(np.linalg.norm(off[:3])), float(np.rad2deg(np.linalg.norm(off[3:])))


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
    if workspace is None:
        raise InputError("a cell without a workspace", code=Code.NO_WORKSPACE)
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


def reached(job: tuple[Configuration, Target | None]) -> dict[int, tuple[float, float]]:
    """Run a simulated cell to its number of views; return the errors in mm and deg after each number."""
    configuration, target = job
    asked = replace(configuration, accuracy_mm=None, accuracy_deg=None)
    prepared = prepare(asked, target=target)
    if prepared.truth is None or prepared.truth.X is None:
        return {}
    with tempfile.TemporaryDirectory(prefix="handeye-") as folder:
        session, store = begin(prepared, Path(folder) / "s")
        try:
            return {n: _errors(estimate.X, prepared.truth.X) for estimate, n in _estimates(session)}
        except HandeyeError:
            return {}
        finally:
            store.close()
