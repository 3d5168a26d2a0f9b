"""Policies at work: the cell, the common start, how many views there may be, and what each of them takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from handeye import _core
from handeye.estimation import Estimate, Estimator, Measurements, make_estimator
from handeye.planning import Candidate, Planner, PlannerOptions, Pool, Proposal, make_policy
from handeye.planning.batch import plan_batch
from handeye.planning.collisions import Workspace
from handeye.planning.prediction import Sight
from handeye.session.choosing import ArmChooser
from handeye.session.deciding import Situation, Step
from handeye.session.entry import Entry, Failure
from handeye.session.starting import Start
from handeye.session.wish import Wish
from handeye.simulation.cells import simulated_arm
from handeye.studies.lattices import LATTICES
from handeye.studies.measured_cell import MeasuredCell
from handeye.types.calibration import ModelName

# A lattice is drawn together until enough of it can be taken.
SHRINK = (1.0, 0.75, 0.5, 0.35, 0.25)
# Postures of the pool are not asked for collisions, so nobody's are: an arm without floor and thickness.
EMPTY = Workspace(np.full(3, -2.0), np.full(3, 2.0), floor_m=-2.0, link_radius_m=0.0, tool_radius_m=0.0)
# Goals from which the target was not seen, at most, for each view.
MISSES = 3
# Where `tool_point` wants to be right: so far ahead of the camera, where a part would lie.
TOOL_POINTS_M = ((0.0, 0.0, 0.5),)


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

    def measure(self, candidates: Sequence[Candidate], draw: int = 0) -> Measurements:
        """Take views in this order, with the noise of a draw."""
        views = [
            self.cell.measure(candidate.joints_rad or (), step, candidate.name, draw)
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
        criterion=_core.Criterion(criterion, tool_points=_tool_points(criterion)),
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


class _OfHandEye(Wish):
    """A request whose views are worth what they tell of the hand-eye alone."""

    def criterion(self, estimate: Estimate, measurements: Measurements) -> _core.Criterion:
        """Return the entropy of X, everything else marginalised."""
        del estimate, measurements
        return _core.Criterion("entropy_handeye")


def driven(policy: str, wishes: type[Wish], course: Course) -> list[Candidate]:
    """Drive as `handeye run` does: candidates are drawn for every view, and the best are climbed from."""
    cell, last = course.cell, course.start[-1]
    seed = int(course.random.integers(2**31))
    wish = wishes(accuracy_mm=None, accuracy_deg=None, seed=seed, policy=make_policy(policy))
    standing = Start(last.T_base_flange, last.joints_rad or ())
    chooser = ArmChooser(simulated_arm(), EMPTY, cell.recording.camera, standing, wish)
    estimator = course.estimator()
    measured = course.measure(course.start)
    estimate = estimator(measured)
    entries: list[Entry] = []
    taken: list[Candidate] = []
    wanted = course.budget - len(course.start)
    while len(taken) < wanted and len(entries) < MISSES * wanted:
        step = chooser.choose(Situation(tuple(entries), measured.views, measured, estimate))
        if not isinstance(step, Step) or step.goal.joints_rad is None:
            break
        goal, joints = step.goal.T_base_flange, step.goal.joints_rad
        name = f"driven_{len(entries) + 1:02d}"
        view = None
        if cell.shows((cell.X @ cell.recording.mounting.chain(goal) @ cell.Y).matrix):
            view = cell.measure(joints, len(measured), name)
            taken.append(Candidate(name, goal, joints))
            measured = measured.with_views([view])
            estimate = estimator(measured, estimate)
        failure = Failure.NOT_FOUND if view is None else None
        number = len(entries) + 1
        entries.append(
            Entry(number, name, step.phase, goal, joints, True, view, failure, standing_rad=joints)
        )
    return taken


def together(objective: str, course: Course) -> list[Candidate]:
    """Choose all views at once after the start."""
    estimate = course.estimator()(course.measure(course.start))
    count = course.budget - len(course.start)
    points = _tool_points(objective)
    plan = plan_batch(
        estimate, course.pool, count, objective=objective, tool_points_m=points, sight=Sight(known=True)
    )
    return list(plan.candidates)


def _tool_points(criterion: str) -> tuple[tuple[float, ...], ...] | None:
    return TOOL_POINTS_M if criterion == "tool_point" else None


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


# The row that is ours: what `handeye run` does.
OURS = "handeye_run"

# Rows that choose all their views together after the start, and what each makes most of.
BATCHES = {
    "batch": "entropy",
    "batch, hand-eye entropy": "entropy_handeye",
    "batch, tool point": "tool_point",
}

# Rows of this package's model and criteria; the others are what the field does.
OF_OURS: dict[str, PolicyRow] = {
    OURS: partial(driven, "next_best_view", Wish),
    "handeye_run, hand-eye entropy": partial(driven, "next_best_view", _OfHandEye),
    "next_best_view": partial(planned, "next_best_view", "entropy", ModelName.AUTO, None),
    "next_best_view, hand-eye entropy": partial(
        planned, "next_best_view", "entropy_handeye", ModelName.AUTO, None
    ),
    **{
        f"next_best_view, {name.replace('_', ' ')}": partial(
            planned, "next_best_view", name, ModelName.AUTO, None
        )
        for name in ("trace", "eigenvalue_sum", "min_eigenvalue", "tool_point")
    },
    **{name: partial(together, objective) for name, objective in BATCHES.items()},
}

POLICY_ROWS: dict[str, PolicyRow] = {
    **OF_OURS,
    "next_best_view, paper's model": partial(planned, "next_best_view", "entropy", ModelName.PAPER, None),
    "max_distance": partial(planned, "max_distance", "entropy", ModelName.PAPER, None),
    "max_distance, driven": partial(driven, "max_distance", Wish),
    "random": partial(planned, "random", "entropy", ModelName.PAPER, None),
    "random, driven": partial(driven, "random", Wish),
    "sentiac_44": partial(planned, "next_best_view", "entropy", ModelName.PAPER, "sentiac_44"),
    **{name: partial(lattice, name) for name in ("easy_handeye_17", "serpentine", "human")},
}

# Rows that choose all their views together; the others choose one after another.
AT_ONCE = (*BATCHES, "easy_handeye_17", "serpentine", "human")
