"""Spots on a lattice of squares seen in perspective: which neighbours which, and where a grid lies in it.

The image of a circle shows how the plane is foreshortened there, and the lattice around it is foreshortened
in the same way. So from one spot its neighbours are looked for in coordinates in which it is round, and from
there the lattice grows step by step, each step bent a little by what was found: neither perspective nor the
lens matters.
"""

from collections import deque
from dataclasses import dataclass

import cv2
import numpy as np

from handeye.detection.blobs import Spots
from handeye.types.arrays import FloatArray, IndexArray

# How far from where it is expected a neighbour may lie, as a share of the step.
TOLERANCE = 0.25
# Largest ratio between the areas of neighbours: a marked circle is larger, and perspective changes a little.
AREA_RATIO = 7.0
SEED_AREA_RATIO = 1.6
# Neighbours are foreshortened alike: largest ratio of squared axes of one ellipse where the other is round.
ROUND_RATIO = 2.0
SEEDS = 300
_STEPS = ((1, 0), (-1, 0), (0, 1), (0, -1))


@dataclass(frozen=True)
class Lattice:
    """Spots with places on a lattice.

    Attributes
    ----------
    places
        (N, 2) whole numbers, right-handed as the image is: turning the first axis towards the second turns x
        towards y.
    spots
        (N,) indices of the spots there.
    """

    places: IndexArray
    spots: IndexArray

    def __len__(self) -> int:
        return len(self.spots)


def grow(spots: Spots, enough: int) -> Lattice:
    """Return the largest lattice found, or the first with at least so many spots."""
    best = Lattice(np.zeros((0, 2), dtype=np.int64), np.zeros(0, dtype=np.int64))
    tried = np.zeros(len(spots), dtype=bool)
    for seed in range(min(len(spots), SEEDS)):
        if tried[seed]:
            continue
        tried[seed] = True
        basis = _basis(spots, seed)
        if basis is None:
            continue
        lattice = _grown(spots, seed, basis)
        # A spot of this lattice would only find it again.
        if len(lattice) > 3:
            tried[lattice.spots] = True
        if len(lattice) > len(best):
            best = lattice
        if len(best) >= enough:
            break
    return best


def _basis(spots: Spots, seed: int) -> FloatArray | None:
    """Return the steps (2, 2) to two neighbours of a spot, right-handed; None if there are none."""
    areas = spots.areas
    alike = np.abs(np.log(areas / areas[seed])) < np.log(SEED_AREA_RATIO)
    alike[seed] = False
    if alike.sum() < 2:
        return None
    offsets = spots.centres[alike] - spots.centres[seed]
    half = np.asarray(np.linalg.cholesky(spots.shapes[seed]), dtype=np.float64)
    round_in = np.asarray(np.linalg.inv(half), dtype=np.float64)
    seen_round = offsets @ round_in.T  # the spot's radius is 1 here
    distance = np.hypot(*seen_round.T)
    distance[distance < 2] = np.inf  # circles do not overlap
    nearest = int(np.argmin(distance))
    if not np.isfinite(distance[nearest]):
        return None
    across = np.array([-seen_round[nearest, 1], seen_round[nearest, 0]])
    for sign in (1.0, -1.0):
        miss = np.hypot(*(seen_round - sign * across).T)
        second = int(np.argmin(miss))
        if miss[second] < TOLERANCE * distance[nearest]:
            # Neighbours on the other side stand for a step back.
            return np.array([offsets[nearest], sign * offsets[second]])
    return None


def _grown(spots: Spots, seed: int, basis: FloatArray) -> Lattice:
    if np.linalg.det(basis) < 0:
        basis = basis * [[1.0], [-1.0]]
    areas = spots.areas
    inverses = np.linalg.inv(spots.shapes)
    place_of: dict[int, tuple[int, int]] = {seed: (0, 0)}
    spot_at: dict[tuple[int, int], int] = {(0, 0): seed}
    waiting = deque([(seed, basis)])
    while waiting:
        spot, steps = waiting.popleft()
        i, j = place_of[spot]
        for di, dj in _STEPS:
            if (i + di, j + dj) in spot_at:
                continue
            step = di * steps[0] + dj * steps[1]
            miss = np.hypot(*(spots.centres - spots.centres[spot] - step).T)
            other = int(np.argmin(miss))
            ratio = areas[other] / areas[spot]
            if (
                other in place_of
                or miss[other] > TOLERANCE * np.hypot(*step)
                or not 1 / AREA_RATIO < ratio < AREA_RATIO
                or _axes_ratio(inverses[spot] @ spots.shapes[other]) > ROUND_RATIO
            ):
                continue
            place_of[other] = (i + di, j + dj)
            spot_at[i + di, j + dj] = other
            taken = spots.centres[other] - spots.centres[spot]
            bent = steps.copy()
            bent[0 if di else 1] = (di + dj) * taken
            waiting.append((other, bent))
    return Lattice(
        np.array(list(place_of.values()), dtype=np.int64), np.array(list(place_of), dtype=np.int64)
    )


def _axes_ratio(relative: FloatArray) -> float:
    """Return the ratio of the eigenvalues of a (2, 2) matrix that has the eigenvalues of a definite one."""
    mean, determinant = float(np.trace(relative)) / 2, float(np.linalg.det(relative))
    spread = np.sqrt(max(mean * mean - determinant, 0.0))
    return float((mean + spread) / max(mean - spread, 1e-12))


@dataclass(frozen=True)
class Placement:
    """A grid laid on a lattice.

    Attributes
    ----------
    spots
        (P,) spot at each point of the grid, -1 where there is none.
    beside
        Number of other spots of the lattice that neighbour one of the grid's.
    """

    spots: IndexArray
    beside: int

    @property
    def found(self) -> int:
        """Number of points of the grid where there is a spot."""
        return int((self.spots >= 0).sum())


def placements(lattice: Lattice, grid: IndexArray) -> list[Placement]:
    """Return the best way to lay a grid on a lattice for each of the four turns, the best first.

    Parameters
    ----------
    lattice
        Where there are spots.
    grid
        (P, 2) places of the points of the grid in whole numbers from 0, x to the right and y down.
    """
    results: list[Placement] = []
    places = lattice.places
    for _ in range(4):
        results.append(_placed(places, lattice.spots, grid))
        places = np.column_stack([-places[:, 1], places[:, 0]])
    return sorted(results, key=lambda placement: -placement.found)


def _placed(places: IndexArray, spots: IndexArray, grid: IndexArray) -> Placement:
    """Return the grid shifted to where it covers most spots."""
    extent = grid.max(axis=0) + 1
    # As much empty room around the lattice as the grid is large, so that it may stick out.
    low = places.min(axis=0) - extent - 1
    room = np.full(tuple(places.max(axis=0) - low + extent + 2), -1, dtype=np.int64)
    room[tuple((places - low).T)] = spots
    wanted = np.zeros(tuple(extent), dtype=np.float32)
    wanted[tuple(grid.T)] = 1
    covered = cv2.filter2D(
        (room >= 0).astype(np.float32), -1, wanted, anchor=(0, 0), borderType=cv2.BORDER_CONSTANT
    )
    shift = np.unravel_index(int(np.argmax(np.rint(covered))), covered.shape)
    at = tuple((grid + shift).T)
    taken = np.zeros(room.shape, dtype=np.uint8)
    taken[at] = room[at] >= 0
    around = cv2.dilate(taken, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
    beside = (room >= 0) & (around > 0)
    beside[at] = False
    return Placement(room[at], int(beside.sum()))
