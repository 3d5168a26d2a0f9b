"""Every policy a row: the same start and budget in the same cells, with paired noise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from handeye import _core
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.estimation import Estimate, Estimator, Measurements, make_estimator
from handeye.planning import Candidate, Planner, PlannerOptions, Pool, Proposal, make_policy
from handeye.planning.batch import plan_batch
from handeye.planning.prediction import Sight
from handeye.robots.simulated import ArmErrors
from handeye.session.simulated import usual_errors
from handeye.studies.lattices import LATTICES
from handeye.studies.measured_cell import MeasuredCell, measured_cell
from handeye.studies.protocol import second_turn_rad, trial_random
from handeye.types import Mounting
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.validation import metrics

BUDGETS = (8, 12)
START_VIEWS, SMALLEST_TURN_RAD = 3, np.deg2rad(5.0)
ARMS: dict[str, ArmErrors] = {"exact": ArmErrors(), "realistic": usual_errors()}
# The row that is ours: what `handeye run` does.
OURS = "next_best_view"
# A lattice is drawn together until enough of it can be taken.
SHRINK = (1.0, 0.75, 0.5, 0.35, 0.25)
Z_95 = 1.959964


@dataclass(frozen=True)
class Course:
    """A policy at work: the cell, the common start, and how many views it may have."""

    cell: MeasuredCell
    start: tuple[Candidate, ...]
    pool: Pool
    budget: int
    random: np.random.Generator

    def estimator(self, model: ModelName = ModelName.AUTO) -> Estimator:
        """Return what answers, the arm described unless the model does without."""
        return make_estimator(model, self.cell.kinematics if model is ModelName.AUTO else None)

    def measure(self, candidates: Sequence[Candidate]) -> Measurements:
        """Take views in this order."""
        views = [
            self.cell.measure(candidate.joints_rad or (), step, candidate.name)
            for step, candidate in enumerate(candidates)
        ]
        return self.cell.empty().with_views(views)


PolicyRow = Callable[[Course], list[Candidate]]
"""From a course to the views taken after the start, in order; as many as the budget leaves, or fewer."""


def planned(
    policy: str, criterion: str, model: ModelName, offered: str | None, course: Course
) -> list[Candidate]:
    """Let a policy of the planner choose one after another, from the pool or from a lattice."""
    pool = course.pool if offered is None else Pool(tuple(_lattice(offered, course, most=None)))
    options = PlannerOptions(
        policy=make_policy(policy),
        criterion=_core.Criterion(criterion),
        sight=Sight(known=True),
        seed=int(course.random.integers(2**31)),
    )
    planner = Planner(course.measure(course.start), pool, course.estimator(model), options)
    taken: list[Candidate] = []
    while len(taken) < course.budget - len(course.start) and len(planner.pool) > 0:
        answer = planner.ask()
        if not isinstance(answer, Proposal):
            break
        chosen = answer.candidate
        step = len(course.start) + len(taken)
        planner.tell(course.cell.measure(chosen.joints_rad or (), step, chosen.name))
        taken.append(chosen)
    return taken


def together(objective: str, course: Course) -> list[Candidate]:
    """Choose all views at once after the start."""
    estimate = course.estimator()(course.measure(course.start))
    count = course.budget - len(course.start)
    plan = plan_batch(estimate, course.pool, count, objective=objective, sight=Sight(known=True))
    return list(plan.candidates)


def lattice(name: str, course: Course) -> list[Candidate]:
    """Drive to a lattice, thinned evenly to the budget."""
    return _lattice(name, course, most=course.budget - len(course.start))


def _lattice(name: str, course: Course, most: int | None) -> list[Candidate]:
    first = course.start[0]
    cell = course.cell
    chain = cell.recording.mounting.chain(first.T_base_flange)
    seen = (cell.X @ chain @ cell.Y).matrix
    poses = LATTICES[name](seen, course.random)
    wanted = course.budget - len(course.start)
    found: list[Candidate] = []
    for factor in SHRINK:
        twists = factor * _core.se3_log(poses @ np.linalg.inv(seen))
        found = cell.reachable(_core.se3_exp(twists) @ seen, first.joints_rad or ())
        if len(found) >= wanted:
            break
    if most is None or len(found) <= most:
        return found
    return [found[int(i)] for i in np.linspace(0, len(found) - 1, most).round()]


POLICY_ROWS: dict[str, PolicyRow] = {
    OURS: partial(planned, "next_best_view", "entropy", ModelName.AUTO, None),
    "next_best_view, hand-eye entropy": partial(
        planned, "next_best_view", "entropy_handeye", ModelName.AUTO, None
    ),
    "batch": partial(together, "entropy"),
    "batch, hand-eye entropy": partial(together, "entropy_handeye"),
    "next_best_view, paper's model": partial(planned, "next_best_view", "entropy", ModelName.PAPER, None),
    "max_distance": partial(planned, "max_distance", "entropy", ModelName.PAPER, None),
    "random": partial(planned, "random", "entropy", ModelName.PAPER, None),
    "sentiac_44": partial(planned, "next_best_view", "entropy", ModelName.PAPER, "sentiac_44"),
    **{name: partial(lattice, name) for name in ("easy_handeye_17", "serpentine", "human")},
}

# Rows that choose all their views together; the others choose one after another.
AT_ONCE = ("batch", "batch, hand-eye entropy", "easy_handeye_17", "serpentine", "human")


@dataclass(frozen=True)
class Reached:
    """Errors of the default estimate after the views of a policy, and how many these were."""

    translation_mm: float
    rotation_deg: float
    views: int


@dataclass(frozen=True)
class Policies:
    """What each policy reached in each cell: by mounting, budget and policy."""

    seed: int
    trials: int
    arm: str
    reached: dict[tuple[Mounting, int], dict[str, tuple[Reached, ...]]]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        mountings: dict[str, Any] = {}
        for (mounting, budget), rows in self.reached.items():
            part = mountings.setdefault(mounting.value, {})
            part[str(budget)] = {policy: _summary(found, rows[OURS]) for policy, found in rows.items()}
        return {
            "study": "policies",
            "seed": self.seed,
            "trials": self.trials,
            "arm": self.arm,
            "ours": OURS,
            "mountings": mountings,
        }


def _summary(found: Sequence[Reached], ours: Sequence[Reached]) -> dict[str, Any]:
    summary: dict[str, Any] = {"views": float(np.mean([one.views for one in found]))}
    for name in ("translation_mm", "rotation_deg"):
        theirs = np.array([getattr(one, name) for one in found])
        own = np.array([getattr(one, name) for one in ours])
        ratio = np.log(theirs / own)
        half = Z_95 * float(np.std(ratio, ddof=1)) / np.sqrt(len(ratio)) if len(ratio) > 1 else 0.0
        middle = float(np.mean(ratio))
        summary[name] = {
            "mean": float(np.mean(theirs)),
            "median": float(np.median(theirs)),
            "over_ours": float(np.exp(middle)),
            "over_ours_95": [float(np.exp(middle - half)), float(np.exp(middle + half))],
        }
    return summary


def study_policies(
    *,
    policies: Sequence[str] = tuple(POLICY_ROWS),
    budgets: Sequence[int] = BUDGETS,
    mountings: Sequence[Mounting] = tuple(Mounting),
    arm: str = "realistic",
    trials: int = 40,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Policies:
    """Let every policy take views in the same cells, and compare what the default estimate makes of them.

    Three common views to start from; the arm is described. Whatever a policy believes, its views are solved
    alike. Noise depends on the cell and the number of the view, not on the policy.

    Raises
    ------
    SolveError
        A cell or an estimate failed.
    """
    wanted = (OURS, *(policy for policy in policies if policy != OURS))
    jobs = [
        _Job(number, mounting, arm, tuple(budgets), wanted, seed)
        for number in range(trials)
        for mounting in mountings
    ]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    reached: dict[tuple[Mounting, int], dict[str, tuple[Reached, ...]]] = {}
    for job, found in zip(jobs, done, strict=True):
        for (budget, policy), one in found.items():
            rows = reached.setdefault((job.mounting, budget), {})
            rows[policy] = (*rows.get(policy, ()), one)
    return Policies(seed, trials, arm, reached)


@dataclass(frozen=True)
class _Job:
    number: int
    mounting: Mounting
    arm: str
    budgets: tuple[int, ...]
    policies: tuple[str, ...]
    seed: int


def _run(job: _Job) -> dict[tuple[int, str], Reached]:
    cell = measured_cell(job.number, job.mounting, ARMS[job.arm], seed=job.seed)
    start, pool = start_of(cell, job.number, job.seed)
    found: dict[tuple[int, str], Reached] = {}
    for policy in job.policies:
        for budget, taken in _choices(policy, cell, start, pool, job).items():
            some = [*start, *taken]
            course = Course(cell, start, pool, budget, np.random.default_rng(0))
            found[budget, policy] = _reached(course.estimator()(course.measure(some)), cell, len(some))
    return found


def _choices(
    policy: str, cell: MeasuredCell, start: tuple[Candidate, ...], pool: Pool, job: _Job
) -> dict[int, list[Candidate]]:
    """Return what a policy takes after the start, by budget."""

    def chosen(budget: int) -> list[Candidate]:
        random = trial_random(job.seed, policy, job.number)
        return POLICY_ROWS[policy](Course(cell, start, pool, budget, random))

    if policy in AT_ONCE:
        return {budget: chosen(budget) for budget in job.budgets}
    # What is chosen one after another for the largest budget begins with what is chosen for a smaller one.
    most = chosen(max(job.budgets))
    return {budget: most[: budget - len(start)] for budget in job.budgets}


def draw_start(pool: Pool, random: np.random.Generator) -> tuple[tuple[Candidate, ...], Pool]:
    """Draw three candidates that turn about two axes, and return them and the pool of the others."""
    while True:
        picked = random.choice(len(pool), START_VIEWS, replace=False)
        start = tuple(pool.candidates[int(i)] for i in picked)
        turns: FloatArray = np.array([one.T_base_flange.matrix for one in start])
        if second_turn_rad(turns) > SMALLEST_TURN_RAD:
            return start, pool.without([one.name for one in start])


def start_of(cell: MeasuredCell, number: int, seed: int) -> tuple[tuple[Candidate, ...], Pool]:
    """Return the start of a cell that all policies share, and the pool of its other candidates."""
    random = trial_random(seed, f"start {cell.recording.mounting}", number)
    return draw_start(Pool.of_views(cell.recording.views), random)


def _reached(estimate: Estimate, cell: MeasuredCell, views: int) -> Reached:
    error = metrics.absolute_error(estimate.X, cell.X)
    return Reached(error.translation_mm, error.rotation_deg, views)


__all__ = ["ARMS", "BUDGETS", "OURS", "POLICY_ROWS", "Policies", "study_policies"]
