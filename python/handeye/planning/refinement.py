"""Better postures near good candidates: climbing the gain over the joints.

Candidates are drawn by chance; the best of some hundreds is near a good view, not at it. From a few of the
best a search by chance climbs (Rastrigin 1963; with steps that adapt their length: Schumer and Steiglitz
1968): all steps of a round are tried at once, they grow where one brings more and shrink where none does. No
derivative is needed, and none would help much: the best views lie where the target touches the border of the
image or the arm its limits.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.planning.candidates import Candidate
from handeye.planning.constraints import ViewConstraints
from handeye.planning.feasibility import FeasiblePool, candidates_at
from handeye.planning.planner import PlannerOptions
from handeye.planning.policies import Policy
from handeye.planning.travel import Travel
from handeye.robots import Arm
from handeye.types.arrays import FloatArray, IndexArray


@dataclass(frozen=True)
class Refinement:
    """How candidates are refined.

    Parameters
    ----------
    seeds
        Number of candidates to climb from: the best one, then the next best that is not near another seed.
    apart_rad
        Seeds differ by so much in a joint at least.
    rounds, steps
        Rounds of the climb, and steps tried from each seed in each.
    radius_rad
        Length of the first steps.
    """

    seeds: int = 4
    apart_rad: float = 0.2
    rounds: int = 12
    steps: int = 10
    radius_rad: float = 0.1


@dataclass(frozen=True, eq=False)
class Refined:
    """A posture that was climbed to.

    Parameters
    ----------
    name
        Its own.
    seed
        Name of the candidate that the climb began at.
    seed_gain
        Gain there.
    joints
        (n,) where it ended.
    """

    name: str
    seed: str
    seed_gain: float
    joints: FloatArray


def refine(
    drawn: FeasiblePool,
    gains: FloatArray,
    options: PlannerOptions,
    random: np.random.Generator,
    refinement: Refinement | None = None,
) -> list[Refined]:
    """Climb from the best candidates; return where it ended, as far as it led anywhere.

    Every posture on the way passes the constraints of the pool and is reached on a free straight path from
    where the arm stands. The climb takes the estimate of X and Y at its word, so what it
    returns is to be scored like any candidate before it is taken.

    Parameters
    ----------
    drawn
        The candidates.
    gains
        (N,) their gains; NaN where a view teaches nothing.
    options
        The policy says what is climbed, and one that weighs no gains has nothing refined; the criterion what
        a view is worth. Where the arm stands and how fast it is must be known.
    random
        Source of chance.
    """
    settings = refinement or Refinement()
    if options.travel is None or len(gains) == 0:
        return []
    names = [candidate.name for candidate in drawn.pool.candidates]
    joints = np.array([drawn.joints[name] for name in names])
    worth = options.policy.worth(gains, options.travel.seconds(joints))
    if worth is None:
        return []
    scorer = _Scorer(drawn.constraints, options.policy, options.criterion, options.travel)
    seeds = _seeds(joints, worth, settings)
    seeds = seeds[scorer.is_free(joints[seeds])]
    if len(seeds) == 0:
        return []
    ends, better = _climbed(joints[seeds], scorer, random, settings)
    return [
        Refined(f"refined_{rank + 1}", names[int(seeds[rank])], float(gains[seeds[rank]]), ends[rank])
        for rank in range(len(seeds))
        if better[rank]
    ]


def offered(refined: Sequence[Refined], arm: Arm) -> tuple[Candidate, ...]:
    """Return refined postures as candidates."""
    if not refined:
        return ()
    names, joints = [one.name for one in refined], np.array([one.joints for one in refined])
    return candidates_at(arm, names, joints).candidates


class _Scorer:
    """Scores postures as the policy weighs them."""

    def __init__(
        self, constraints: ViewConstraints, policy: Policy, criterion: _core.Criterion, travel: Travel
    ) -> None:
        self._constraints, self._policy, self._criterion, self._travel = (
            constraints,
            policy,
            criterion,
            travel,
        )

    def __call__(self, joints: FloatArray) -> FloatArray:
        """(N,) worth of postures (N, n) where the arm can stand; NaN for what cannot be taken anyway."""
        motions = self._constraints.motions(joints)
        passed, _ = self._constraints.passing(joints, motions, body=False)
        worth = np.full(len(joints), np.nan)
        if len(passed) > 0:
            some = joints[passed]
            gains = self._constraints.prediction.gains(self._criterion, motions[passed], some)
            weighed = self._policy.worth(gains, self._travel.seconds(some))
            worth[passed] = gains if weighed is None else weighed
        return worth

    def best_of(
        self, tried: FloatArray, heights: FloatArray, least: FloatArray
    ) -> tuple[IndexArray, FloatArray]:
        """Return the best of postures (S, M, n) where the arm can stand (S,), and how high (S,).

        Asked of the best first, and only above the least (S,): most of the others are never looked at.
        """
        heights, rows = heights.copy(), np.arange(len(tried))
        while True:
            best = heights.argmax(axis=1)
            found = heights[rows, best]
            asked = rows[found > least]
            if len(asked) == 0:
                return best, found
            why = self._constraints.body.obstacles(tried[asked, best[asked]])
            blocked = asked[[reason is not None for reason in why]]
            if len(blocked) == 0:
                return best, found
            heights[blocked, best[blocked]] = -np.inf

    def is_free(self, joints: FloatArray) -> NDArray[np.bool_]:
        """(N,) whether the straight paths to postures (N, n) are free."""
        why = self._constraints.body.obstacles_on_paths(self._travel.start, joints)
        return np.array([reason is None for reason in why], dtype=bool)


def _seeds(joints: FloatArray, worth: FloatArray, settings: Refinement) -> IndexArray:
    """(S,) indices of the best postures that are not near one another, best first."""
    chosen: list[int] = []
    for index in np.argsort(-np.nan_to_num(worth, nan=-np.inf), kind="stable").tolist():
        if np.isnan(worth[index]) or len(chosen) == settings.seeds:
            break
        if all(np.abs(joints[index] - joints[other]).max() >= settings.apart_rad for other in chosen):
            chosen.append(index)
    return np.array(chosen, dtype=np.int64)


def _climbed(
    joints: FloatArray, scorer: _Scorer, random: np.random.Generator, settings: Refinement
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return where climbs from postures (S, n) end (S, n), and which (S,) led anywhere."""
    at, count = joints.copy(), len(joints)
    height = scorer(at)
    radius = np.full(count, settings.radius_rad)
    better = np.zeros(count, dtype=bool)
    onward = np.zeros_like(at)
    rows = np.arange(count)
    for _ in range(settings.rounds):
        steps = random.standard_normal((count, settings.steps, at.shape[1]))
        steps *= radius[:, np.newaxis, np.newaxis] / np.linalg.norm(steps, axis=2, keepdims=True)
        # What was good once more: along it the way often goes on.
        steps[:, 0] = np.where(np.any(onward, axis=1, keepdims=True), onward, steps[:, 0])
        tried = at[:, np.newaxis] + steps
        heights = np.nan_to_num(
            scorer(tried.reshape(-1, at.shape[1])).reshape(count, settings.steps), nan=-np.inf
        )
        best, found = scorer.best_of(tried, heights, height)
        rises = found > height
        rises[rises] = scorer.is_free(tried[rows, best][rises])
        onward = np.where(rises[:, np.newaxis], steps[rows, best], 0.0)
        at = np.where(rises[:, np.newaxis], tried[rows, best], at)
        height = np.where(rises, found, height)
        better |= rises
        radius *= np.where(rises, 1.3, 0.6)
    return at, better
