"""Where the sides of a marker meet, each followed from corner to corner.

Many markers tell each other where a corner must be; one or two do not. There the sides do: each is an edge,
a little bent by the lens, dark towards the middle of the marker. Where most of it is seen its corners are
known, also those that something covers or touches.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import Image, inside
from handeye.detection.saddles import sampled
from handeye.types.arrays import FloatArray

# An edge is looked for across a side at places about so far apart, of which there are at least and at most
# so many; the ends belong to the corners.
EVERY_PX, FEWEST, MOST, ENDS = 4.0, 16, 80, 0.06
# How far off the straight line between two corners, as a share of its length and in pixels.
REACH_SHARE, LEAST_REACH_PX = 0.04, 2.5
# Steps of the profile across, and how far to both sides of an edge grey values are compared.
FINE_PX, ASIDE_PX = 0.5, 2.0
# A place has an edge if the step is this share of the usual one, and it is on the side if it is so near.
STEP_SHARE, NEAR_PX = 0.3, 1.0
# So many of the places must be on the side, fewer to begin with, and the one next to a corner no further from
# it than this share.
SEEN_SHARE, BEGUN_SHARE, NEXT_SHARE = 0.6, 0.4, 0.25
# The sum of distances is minimised by weighing so many times (Weiszfeld 1937); less than this is none.
WEIGHINGS, FINEST_PX = 8, 0.05
# A parabola follows a side that a lens bends to this.
BENT_PX = 0.05
# A corner of an outline is off by this share of the shortest side, at most.
AWAY_SHARE = 0.15
# What is known worse than this is not known.
LARGEST_SIGMA_PX = 0.25
# Sides meet at a corner once lines are followed to each other so many times.
MEETINGS = 4


@dataclass(frozen=True, eq=False)
class Meetings:
    """Where sides meet.

    Attributes
    ----------
    places
        (M, 4, 2) corners in pixels, NaN where a side is not seen well enough.
    sigmas_px
        (M, 4) standard deviations of one coordinate.
    """

    places: FloatArray
    sigmas_px: FloatArray


@dataclass(frozen=True, eq=False)
class _Side:
    """A parabola: pixels outwards of the line between two corners, at shares -1 to 1 of its way."""

    powers: FloatArray
    covariance: FloatArray
    reaches: tuple[bool, bool]

    def at(self, share: float) -> FloatArray:
        return np.array([1.0, share, share * share])

    def variance(self, share: float) -> float:
        return float(self.at(share) @ self.covariance @ self.at(share))


def side_meetings(image: Image, corners: FloatArray, free_px: float) -> Meetings:
    """Return where the sides of markers meet.

    Parameters
    ----------
    image
        The picture (H, W), in which markers are dark on light.
    corners
        (M, 4, 2) about where they are, in order around each marker.
    free_px
        How far off a side there are no other edges.
    """
    places = np.full(corners.shape, np.nan)
    sigmas = np.full(corners.shape[:2], np.nan)
    for marker, quad in enumerate(corners):
        # Twice: where an outline leaves out a corner, the line to it runs away from the side.
        near = quad.copy()
        for is_last in (False, True):
            share = SEEN_SHARE if is_last else BEGUN_SHARE
            sides = [_followed(image, near, k, free_px, share) for k in range(4)]
            begun = near.copy()
            for k in range(4):
                before, after = sides[k - 1], sides[k]
                if before is None or after is None:
                    continue
                place, sigma = _meeting(begun, k, before, after)
                if is_last and before.reaches[1] and after.reaches[0]:
                    places[marker, k], sigmas[marker, k] = place, sigma
                elif not is_last and np.linalg.norm(place - begun[k]) <= AWAY_SHARE * _shortest(begun):
                    near[k] = place
    there = inside(image, np.nan_to_num(places.reshape(-1, 2), nan=-1.0)).reshape(-1, 4)
    there &= sigmas <= LARGEST_SIGMA_PX
    return Meetings(np.where(there[..., np.newaxis], places, np.nan), np.where(there, sigmas, np.nan))


def _shortest(quad: FloatArray) -> float:
    return float(np.linalg.norm(np.roll(quad, -1, axis=0) - quad, axis=1).min())


def _frame(quad: FloatArray, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the middle of a side, half of it, and the unit vector outwards."""
    first, second = quad[k], quad[(k + 1) % 4]
    middle, half = (first + second) / 2, (second - first) / 2
    outwards = np.array([half[1], -half[0]]) / max(float(np.hypot(*half)), 1e-9)
    return middle, half, outwards * np.sign((middle - quad.mean(axis=0)) @ outwards)


def _followed(image: Image, quad: FloatArray, k: int, free_px: float, share: float) -> _Side | None:
    """Return one side as most of its places have it, None where less than a share of them is seen."""
    middle, half, outwards = _frame(quad, k)
    length = 2 * float(np.hypot(*half))
    count = int(np.clip(length / EVERY_PX, FEWEST, MOST))
    shares = np.linspace(-1 + 2 * ENDS, 1 - 2 * ENDS, count)
    reach = max(min(REACH_SHARE * length, free_px - ASIDE_PX), LEAST_REACH_PX)
    offsets = np.arange(-reach - ASIDE_PX, reach + ASIDE_PX + FINE_PX / 2, FINE_PX)
    line = middle + shares[:, np.newaxis] * half
    where = line[:, np.newaxis] + offsets[:, np.newaxis] * outwards
    aside = round(ASIDE_PX / FINE_PX)
    total = np.cumsum(np.pad(sampled(image, where), ((0, 0), (1, 0))), axis=1)
    means = (total[:, aside:] - total[:, :-aside]) / aside
    steps = means[:, aside:] - means[:, :-aside]  # outside less inside
    best = steps.argmax(axis=1)
    strengths = steps[np.arange(count), best]
    across = _peaks(steps, best) * FINE_PX + offsets[0] + (aside - 0.5) * FINE_PX
    seen = inside(image, line) & (strengths > 0) & (best > 0) & (best < steps.shape[1] - 1)
    if seen.sum() < share * count:
        return None
    seen &= strengths >= STEP_SHARE * float(np.median(strengths[seen]))
    return _parabola(shares, across, seen, share)


def _peaks(values: FloatArray, best: NDArray[np.int_]) -> FloatArray:
    """Return where (N,) each row has its peak, between the columns."""
    middle = best.clip(1, values.shape[1] - 2)
    before, here, after = (values[np.arange(len(best)), middle + k] for k in (-1, 0, 1))
    bend = np.minimum(before - 2 * here + after, -1e-9)
    return middle + np.clip((before - after) / (2 * bend), -1.0, 1.0)


def _parabola(shares: FloatArray, across: FloatArray, seen: NDArray[np.bool_], share: float) -> _Side | None:
    """Return the parabola that most places are on; None where there are too few."""
    columns = np.stack([np.ones_like(shares), shares, shares**2], axis=1)
    weights = seen.astype(np.float64)
    powers = np.zeros(3)
    for _ in range(WEIGHINGS):
        root = np.sqrt(weights)
        powers = np.linalg.lstsq(root[:, np.newaxis] * columns, root * across, rcond=None)[0]
        weights = seen / np.maximum(np.abs(across - columns @ powers), FINEST_PX)
    on = seen & (np.abs(across - columns @ powers) <= NEAR_PX)
    if on.sum() < share * len(shares):
        return None
    powers = np.linalg.lstsq(columns[on], across[on], rcond=None)[0]
    off = across[on] - columns[on] @ powers
    variance = float(off @ off) / max(int(on.sum()) - 3, 1)
    covariance = variance * np.asarray(np.linalg.pinv(columns[on].T @ columns[on]), dtype=np.float64)
    reaches = (bool(shares[on][0] <= -1 + 2 * NEXT_SHARE), bool(shares[on][-1] >= 1 - 2 * NEXT_SHARE))
    return _Side(np.asarray(powers, dtype=np.float64), covariance, reaches)


def _meeting(quad: FloatArray, k: int, before: _Side, after: _Side) -> tuple[FloatArray, float]:
    """Return where two sides meet at a corner, and the deviation of that."""
    frames = _frame(quad, (k - 1) % 4), _frame(quad, k)
    normals, halves = np.stack([f[2] for f in frames]), [f[1] for f in frames]
    place, shares = quad[k], (1.0, -1.0)
    for _ in range(MEETINGS):
        shares = tuple(
            float((place - middle) @ half / (half @ half))
            for (middle, _, _), half in zip(frames, halves, strict=True)
        )
        lines = [
            float(side.at(share) @ side.powers + middle @ outwards)
            for side, share, (middle, _, outwards) in zip((before, after), shares, frames, strict=True)
        ]
        try:
            place = np.asarray(np.linalg.solve(normals, np.array(lines)), dtype=np.float64)
        except np.linalg.LinAlgError:
            return np.full(2, np.nan), np.nan
    inverse = np.asarray(np.linalg.inv(normals), dtype=np.float64)
    variances = [
        side.variance(share) + BENT_PX**2 for side, share in zip((before, after), shares, strict=True)
    ]
    return place, float(np.sqrt(((inverse**2) @ np.array(variances)).mean()))
