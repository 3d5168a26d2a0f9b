"""In which order to take views that are chosen already: the one in which the arm travels least.

The shortest open path from where the arm stands through all of them: exact for a few (Held and Karp 1962),
otherwise the nearest first, then reversals (2-opt, Croes 1958) and moves of short pieces (Or 1976) until none
shortens it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from handeye.codes import Code
from handeye.errors import InputError
from handeye.planning.candidates import Candidate
from handeye.planning.travel import Travel
from handeye.types.arrays import FloatArray, finite_array

# Up to so many views the order is the best of all; the work doubles with each more.
MOST_EXACT = 10
# What a radian of turn counts where only poses are known: about a wrist's distance from its elbow.
METRES_PER_RADIAN = 0.3
SPEED_RAD_S = 0.5
_LONGEST_PIECE = 3
_LEAST_GAIN = 1e-12


class Measure(StrEnum):
    """What travelling little means."""

    MOTION_TIME = "motion_time"
    POSE_DISTANCE = "pose_distance"


@dataclass(frozen=True, eq=False)
class Route:
    """Views in the order in which to take them.

    Parameters
    ----------
    candidates
        All of them, ordered.
    legs
        (k,) what the way to each takes from the one before it, the first from where the arm stands: seconds
        of motion, or metres.
    measure
        Which of the two: seconds where the joints of all are known.
    as_given
        What the whole way takes in the order in which they were given.
    exact
        Whether no order is shorter.
    """

    candidates: tuple[Candidate, ...]
    legs: FloatArray
    measure: Measure
    as_given: float
    exact: bool

    @property
    def total(self) -> float:
        """What the whole way takes."""
        return float(self.legs.sum())


def travel_order(
    candidates: Sequence[Candidate],
    present: Candidate,
    *,
    velocities: ArrayLike | None = None,
    speed_rad_s: float = SPEED_RAD_S,
) -> Route:
    """Order views such that the arm travels little.

    By the time that motions take on straight lines in joint space, where the joints of all are known;
    otherwise by the distance of poses: metres of the flange, plus 0.3 m for each radian of its turn. Whether
    anything is in the way is not looked at.

    Parameters
    ----------
    candidates
        Where to go, at least one.
    present
        Where the arm stands.
    velocities
        (n,) largest speeds of the joints, if they are known.
    speed_rad_s
        No joint moves faster.

    Raises
    ------
    InputError
        Nothing to order, or a speed that is not above zero.
    """
    if not candidates:
        raise InputError("no views to order", code=Code.NO_CANDIDATES)
    places = (present, *candidates)
    joints = [place.joints_rad for place in places if place.joints_rad is not None]
    if len(joints) == len(places) and len({len(values) for values in joints}) == 1:
        measure, costs = Measure.MOTION_TIME, _times(np.array(joints), velocities, speed_rad_s)
    else:
        measure, costs = Measure.POSE_DISTANCE, _distances(places)
    order, exact = shortest_path(costs)
    ways = [0, *order]
    given = range(1, len(places))
    return Route(
        tuple(places[index] for index in order),
        costs[ways[:-1], ways[1:]],
        measure,
        float(costs[[0, *given][:-1], [*given]].sum()),
        exact,
    )


def shortest_path(costs: ArrayLike) -> tuple[list[int], bool]:
    """Return the order of places 1 to k in a short path from place 0, and whether none is shorter.

    Parameters
    ----------
    costs
        (k + 1, k + 1) symmetric costs of ways between places.
    """
    matrix = finite_array(costs, (None, None), "costs")
    if len(matrix) - 1 <= MOST_EXACT:
        return _best_path(matrix), True
    return _improved(matrix, _nearest_first(matrix)), False


def _times(joints: FloatArray, velocities: ArrayLike | None, speed_rad_s: float) -> FloatArray:
    speeds = np.full(joints.shape[1], speed_rad_s)
    if velocities is not None:
        speeds = np.minimum(speeds, np.asarray(velocities, dtype=np.float64))
    rows: list[FloatArray] = []
    for start in joints:
        travel = Travel(start, speeds)
        rows.append(travel.seconds(joints) - travel.look_s)
    return np.array(rows)


def _distances(places: Sequence[Candidate]) -> FloatArray:
    poses = np.array([place.T_base_flange.matrix for place in places])
    metres = np.linalg.norm(poses[:, np.newaxis, :3, 3] - poses[np.newaxis, :, :3, 3], axis=2)
    traces = np.einsum("aij,bij->ab", poses[:, :3, :3], poses[:, :3, :3])
    return metres + METRES_PER_RADIAN * np.arccos(np.clip((traces - 1) / 2, -1, 1))


def _best_path(costs: FloatArray) -> list[int]:
    """Find the cheapest way through each subset of places that ends at each of them, and so through all."""
    count = len(costs) - 1
    cheapest = np.full((1 << count, count), np.inf)
    before = np.zeros((1 << count, count), dtype=np.int64)
    for place in range(count):
        cheapest[1 << place, place] = costs[0, place + 1]
    for subset in range(1, 1 << count):
        ends = cheapest[subset]
        if not np.isfinite(ends).any():
            continue
        onward = ends[:, np.newaxis] + costs[1:, 1:]
        last = onward.argmin(axis=0)
        for place in range(count):
            larger = subset | 1 << place
            if larger != subset and onward[last[place], place] < cheapest[larger, place]:
                cheapest[larger, place] = onward[last[place], place]
                before[larger, place] = last[place]
    subset = (1 << count) - 1
    place = int(cheapest[subset].argmin())
    order: list[int] = []
    while subset:
        order.append(place + 1)
        previous = int(before[subset, place])
        subset &= ~(1 << place)
        place = previous
    return order[::-1]


def _nearest_first(costs: FloatArray) -> list[int]:
    left, order = list(range(1, len(costs))), [0]
    while left:
        nearest = left[int(costs[order[-1], left].argmin())]
        left.remove(nearest)
        order.append(nearest)
    return order[1:]


def _improved(costs: FloatArray, order: list[int]) -> list[int]:
    """Shorten a path until neither reversing nor moving a piece of it helps."""
    length = _length(costs, order)
    improving = True
    while improving:
        improving = False
        for changed in _neighbours(order):
            shorter = _length(costs, changed)
            if shorter < length - _LEAST_GAIN:
                order, length, improving = changed, shorter, True
                break
    return order


def _neighbours(order: list[int]) -> Sequence[list[int]]:
    """Return paths with one piece reversed, or one short piece moved elsewhere, either way round."""
    count = len(order)
    found: list[list[int]] = []
    for i in range(count):
        found += [order[:i] + order[i:j][::-1] + order[j:] for j in range(i + 2, count + 1)]
        for size in range(1, _LONGEST_PIECE + 1):
            piece, rest = order[i : i + size], order[:i] + order[i + size :]
            for k in range(len(rest) + 1):
                found += [rest[:k] + piece + rest[k:], rest[:k] + piece[::-1] + rest[k:]]
    return found


def _length(costs: FloatArray, order: list[int]) -> float:
    path = np.array([0, *order])
    return float(costs[path[:-1], path[1:]].sum())
