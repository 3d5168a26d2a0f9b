"""Corners of the tags of an AprilGrid."""

from functools import lru_cache

import cv2
import numpy as np

from handeye import _core
from handeye.detection.base import Detection, Image, NotFound, Reason, inside, ordered
from handeye.detection.corner_fit import (
    ASTRAY_PX,
    FEW,
    WIDE_PX,
    CornerKind,
    astray,
    fit_corners,
    nearer,
    spread,
)
from handeye.detection.diagnosis import diagnose
from handeye.detection.markers import (
    LEAST_SHARE,
    Bits,
    disagreement,
    find_markers,
    foreign_markers,
    from_neighbours,
)
from handeye.detection.registration import Aligned
from handeye.types import AprilGrid
from handeye.types.arrays import FloatArray, IndexArray

# Our corners of a tag among OpenCV's, see `handeye.types.AprilGrid`.
_OPENCV_CORNERS = [1, 0, 3, 2]
# Part of the space between tags that the window of a corner may take, and of the border that its strips may.
WINDOW_SHARE = 0.8
BAND_SHARE = 0.8
# Sides of a tag that begin at its corners: to the next corner, and to the one before.
_SIDES = np.array([[[1, 0], [0, -1]], [[0, -1], [-1, 0]], [[-1, 0], [0, 1]], [[0, 1], [1, 0]]], dtype=float)
# Tags read where they are expected.
FEWEST_TAGS = 2
# Tried until all tags are found; one leaves the ink as it is.
THINNING_PX = (3, 1, 5)


@lru_cache(maxsize=16)
def _bits(target: AprilGrid) -> Bits:
    return Bits.of(target, target.points[:, :2].reshape(-1, 4, 2), target.dictionary, target.border_bits)


def find(image: Image, target: AprilGrid) -> Detection | NotFound:
    """Find the corners of the tags that are visible."""
    ids, seen = _tags(image, target)
    known = ids < target.rows * target.columns
    if not known.any():
        other = foreign_markers(image, target.dictionary, target.border_bits)
        if other is None and len(find_markers(image, target.dictionary, 3 - target.border_bits)[0]):
            other = NotFound(
                Reason.INCONSISTENT,
                f"the tags have a border of {3 - target.border_bits} bits, expected {target.border_bits}",
            )
        return other or diagnose(image, NotFound(Reason.NO_PATTERN, f"no tag of {target.dictionary}"))
    if (~known).sum() > known.sum():
        return NotFound(
            Reason.INCONSISTENT,
            f"{(~known).sum()} of {len(ids)} tags have numbers that the board described does not have",
        )
    tags, seen = ids[known], seen[known][:, _OPENCV_CORNERS]
    points = tags[:, np.newaxis] * 4 + np.arange(4)
    against = disagreement(target.points[points, :2], seen)
    if against is not None:
        return against
    plane = target.points[points.ravel(), :2]
    # The outline of a tag may run astray where a square touches it; the tags around know better.
    expected = from_neighbours(plane, seen.reshape(-1, 2))
    astray = np.linalg.norm(expected - seen.reshape(-1, 2), axis=1) > ASTRAY_PX
    seen = np.where(astray[:, np.newaxis], expected, seen.reshape(-1, 2)).reshape(-1, 4, 2)
    rough = _measured(image, target, seen, None, rough=True)
    good = np.flatnonzero(np.isfinite(rough[:, 0]))
    lens = _core.PlaneMap.fitted(plane[good], rough[good]) if len(good) >= 4 else None
    if lens is None:
        return NotFound(Reason.INCOMPLETE, f"{len(tags)} tags, but their corners are cut or unclear")
    # Once more: all corners together tell the directions of edges better than a tag does.
    again = np.where(np.isfinite(rough), rough, seen.reshape(-1, 2)).reshape(-1, 4, 2)
    sharp = _measured(image, target, again, lens.steps(plane, 0.1 * target.tag_m))
    good = np.flatnonzero(np.isfinite(rough[:, 0]) & np.isfinite(sharp[:, 0]))
    expected = from_neighbours(plane[good], sharp[good])
    good = good[np.linalg.norm(expected - sharp[good], axis=1) <= ASTRAY_PX]
    if len(good) < 4:
        return NotFound(Reason.INCOMPLETE, f"{len(tags)} tags, but their corners are cut or unclear")
    return ordered(target, points.ravel()[good], sharp[good])


def confirm(image: Image, target: AprilGrid, board: Aligned) -> Detection | None:
    """Return the corners of a grid that was found where it was expected; None unless it is that one."""
    plane = target.points[:, :2]
    places = board.places(plane.reshape(-1, 4, 2))
    expected = inside(image, places.reshape(-1, 2)).reshape(-1, 4).all(axis=1)
    read = expected & _bits(target).readable(board)
    if read.sum() < max(FEWEST_TAGS, LEAST_SHARE * expected.sum()):
        return None
    ids = (4 * np.flatnonzero(read)[:, np.newaxis] + np.arange(4)).ravel()
    corners, plane = places[read].reshape(-1, 2), plane[ids]
    steps = board.steps(plane)
    band = BAND_SHARE * _border(target) * target.tag_m * np.linalg.norm(steps, axis=2).min()
    tags = spread(len(places[read]), FEW // 4 if band >= WIDE_PX else len(places[read]))
    some = (4 * tags[:, np.newaxis] + np.arange(4)).ravel()
    near = _measured(image, target, places[read][tags], steps[some], rough=True)
    # Then it is known well enough where all are, so that where they were put matters no more.
    again, steps = nearer(plane, corners, steps, some, near)
    sharp = _measured(image, target, again.reshape(-1, 4, 2), steps)
    good = ~astray(sharp, corners, target.tag_m * np.linalg.norm(steps, axis=2).min(axis=1))
    if good.sum() < max(4, LEAST_SHARE * 4 * expected.sum()):
        return None
    return ordered(target, ids[good], sharp[good])


def _tags(image: Image, target: AprilGrid) -> tuple[IndexArray, FloatArray]:
    """Return ids (M,) and corners (M, 4, 2) of the tags.

    The squares that Kalibr prints between tags touch them at their corners, so that outlines may merge; in a
    picture with thinner ink they are apart.
    """
    if target.border_bits == 1:
        return find_markers(image, target.dictionary, target.border_bits)
    ids, seen = np.zeros(0, dtype=np.int64), np.zeros((0, 4, 2))
    for size in THINNING_PX:
        kernel = np.ones((size, size), dtype=np.uint8)
        thinned = image if size == 1 else np.asarray(cv2.dilate(image, kernel), dtype=np.uint8)
        more, corners = find_markers(thinned, target.dictionary, target.border_bits)
        new = ~np.isin(more, ids)
        # Its edges have moved inwards by half the size: the corners belong further out on the diagonals.
        outwards = corners - corners.mean(axis=1, keepdims=True)
        outwards /= np.linalg.norm(outwards, axis=2, keepdims=True)
        grown = corners + outwards * (size // 2) * np.sqrt(2.0)
        ids, seen = np.concatenate([ids, more[new]]), np.concatenate([seen, grown[new]])
        if (ids < target.rows * target.columns).sum() == target.rows * target.columns:
            break
    return ids, seen


def _border(target: AprilGrid) -> float:
    """Return what is free of other edges along a tag's, as a share of its side."""
    bits = {"16h5": 4, "25h9": 5}.get(target.dictionary.rsplit("_", 1)[-1], 6)
    return min(target.border_bits / (bits + 2 * target.border_bits), target.spacing_ratio)


def _measured(
    image: Image, target: AprilGrid, tags: FloatArray, steps: FloatArray | None, rough: bool = False
) -> FloatArray:
    """Return the corners (4 M, 2) of tags (M, 4, 2) as fitted, NaN where that fails.

    The directions of the edges are those of the outlines, or, if it is known, those that the pixels
    (4 M, 2, 2) per metre along both axes tell.
    """
    after = np.roll(tags, -1, axis=1) - tags
    before = np.roll(tags, 1, axis=1) - tags
    lengths = np.minimum(np.linalg.norm(after, axis=2), np.linalg.norm(before, axis=2)).reshape(-1)
    directions = np.stack([after, before], axis=2).reshape(-1, 2, 2)
    if steps is not None:
        directions = np.tile(_SIDES, (len(tags), 1, 1)) @ steps
    directions = directions / np.linalg.norm(directions, axis=2, keepdims=True)
    height = lengths * np.abs(np.linalg.det(directions))
    return fit_corners(
        image,
        tags.reshape(-1, 2),
        directions,
        WINDOW_SHARE * target.spacing_ratio * height,
        CornerKind.QUADRANTS,
        bands=BAND_SHARE * _border(target) * height,
        rough=rough,
    )
