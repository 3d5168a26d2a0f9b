"""Every policy a row: the same start and budget in the same cells, with paired noise."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.planning import Candidate, Pool
from handeye.robots.simulated import ArmErrors
from handeye.session.simulated import usual_errors
from handeye.studies.course import AT_ONCE, OF_OURS, OURS, POLICY_ROWS, Course
from handeye.studies.measured_cell import MeasuredCell, measured_cell
from handeye.studies.protocol import second_turn_rad, trial_random
from handeye.types import Mounting
from handeye.types.arrays import FloatArray
from handeye.validation import metrics

BUDGETS = (8, 12)
START_VIEWS, SMALLEST_TURN_RAD = 3, np.deg2rad(5.0)
ARMS: dict[str, ArmErrors] = {"exact": ArmErrors(), "realistic": usual_errors()}
# How often the views of a policy are measured, all noise and the arm's errors drawn again.
DRAWS = 3
Z_95 = 1.959964
QUANTITIES = ("translation_mm", "rotation_deg")


@dataclass(frozen=True)
class Reached:
    """Errors of the default estimate after the views of a policy, mean over the draws; and how many views."""

    translation_mm: float
    rotation_deg: float
    views: int


@dataclass(frozen=True)
class Policies:
    """What each policy reached in each cell: by mounting, budget and policy."""

    seed: int
    trials: int
    draws: int
    arm: str
    reached: dict[tuple[Mounting, int], dict[str, tuple[Reached, ...]]]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        mountings: dict[str, Any] = {}
        for (mounting, budget), rows in self.reached.items():
            part = mountings.setdefault(mounting.value, {})
            part[str(budget)] = {policy: _summary(found, rows[OURS]) for policy, found in rows.items()}
        seconds = {
            mounting: {budget: _second(rows) for budget, rows in budgets.items()}
            for mounting, budgets in mountings.items()
        }
        return {
            "study": "policies",
            "seed": self.seed,
            "trials": self.trials,
            "draws": self.draws,
            "arm": self.arm,
            "ours": OURS,
            "best_of_others": seconds,
            "mountings": mountings,
        }


def _summary(found: Sequence[Reached], ours: Sequence[Reached]) -> dict[str, Any]:
    summary: dict[str, Any] = {"views": float(np.mean([one.views for one in found]))}
    for name in QUANTITIES:
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


def _second(rows: dict[str, Any]) -> dict[str, Any]:
    """Return, by quantity, the row nearest to ours of those that are not ours, and its interval."""
    others = {policy: found for policy, found in rows.items() if policy not in OF_OURS}
    best: dict[str, Any] = {}
    for name in QUANTITIES if others else ():
        policy = min(others, key=lambda row: others[row][name]["over_ours"])
        found = others[policy][name]
        best[name] = {"policy": policy, **{key: found[key] for key in ("over_ours", "over_ours_95")}}
    return best


def study_policies(
    *,
    policies: Sequence[str] = tuple(POLICY_ROWS),
    budgets: Sequence[int] = BUDGETS,
    mountings: Sequence[Mounting] = tuple(Mounting),
    arm: str = "realistic",
    trials: int = 40,
    draws: int = DRAWS,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Policies:
    """Let every policy take views in the same cells, and compare what the default estimate makes of them.

    Three common views to start from; the arm is described. Whatever a policy believes, its views are solved
    alike. Noise depends on the cell and the number of the view, not on the policy. What was chosen is
    measured several times, all noise and the arm's errors drawn again, so that the choice is judged and not
    its luck.

    Raises
    ------
    SolveError
        A cell or an estimate failed.
    """
    wanted = (OURS, *(policy for policy in policies if policy != OURS))
    jobs = [
        _Job(number, mounting, arm, tuple(budgets), wanted, draws, seed)
        for number in range(trials)
        for mounting in mountings
    ]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    reached: dict[tuple[Mounting, int], dict[str, tuple[Reached, ...]]] = {}
    for job, found in zip(jobs, done, strict=True):
        for (budget, policy), one in found.items():
            rows = reached.setdefault((job.mounting, budget), {})
            rows[policy] = (*rows.get(policy, ()), one)
    return Policies(seed, trials, draws, arm, reached)


@dataclass(frozen=True)
class _Job:
    number: int
    mounting: Mounting
    arm: str
    budgets: tuple[int, ...]
    policies: tuple[str, ...]
    draws: int
    seed: int


def _run(job: _Job) -> dict[tuple[int, str], Reached]:
    cell = measured_cell(job.number, job.mounting, ARMS[job.arm], seed=job.seed)
    start, pool = start_of(cell, job.number, job.seed)
    found: dict[tuple[int, str], Reached] = {}
    for policy in job.policies:
        for budget, taken in _choices(policy, cell, start, pool, job).items():
            some = [*start, *taken]
            course = Course(cell, start, pool, budget, np.random.default_rng(0))
            found[budget, policy] = _reached(course, some, job.draws)
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


def _reached(course: Course, some: Sequence[Candidate], draws: int) -> Reached:
    errors = [
        metrics.absolute_error(course.estimator()(course.measure(some, draw)).X, course.cell.X)
        for draw in range(draws)
    ]
    mm, deg = np.mean([(error.translation_mm, error.rotation_deg) for error in errors], axis=0)
    return Reached(float(mm), float(deg), len(some))


__all__ = ["ARMS", "BUDGETS", "DRAWS", "OURS", "POLICY_ROWS", "Policies", "study_policies"]
