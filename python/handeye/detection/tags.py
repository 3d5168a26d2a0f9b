"""Corners of markers: of a grid of AprilTags or ArUco markers, or of a single one."""

from functools import lru_cache

import cv2
import numpy as np

from handeye import _core
from handeye.detection.base import Detection, Image, NotFound, Reason, inside, ordered
from handeye.detection.corner_fit import (
    ASTRAY_PX,
    FEW,
    WIDE_PX,
    CornerFits,
    CornerKind,
    astray,
    corner_fits,
    nearer,
    spread,
)
from handeye.detection.diagnosis import diagnose
from handeye.detection.edge_shift import unknown_shift_px, without_edge_shift
from handeye.detection.marker_lattice import contradiction
from handeye.detection.markers import (
    LEAST_SHARE,
    NO_IDS,
    Bits,
    Seen,
    disagreement,
    find_markers,
    from_neighbours,
)
from handeye.detection.registration import Aligned
from handeye.detection.saddles import sampled
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.target import MarkerCorners
from handeye.types.target.artwork import Squares
from handeye.types.target.dictionaries import marker_bits

# Part of the space between tags that the window of a corner may take, and of the border that its strips may.
WINDOW_SHARE = 0.8
BAND_SHARE = 0.8
# Tags read where they are expected.
FEWEST_TAGS = 2
# A side of a marker is dark on one side of a line, so far from it, at so many of its places, this share of
# the usual step or more.
SIDE_SAMPLES, ASIDE_PX, SIDE_SHARE, SIDE_CONTRAST = 24, 2.0, 0.8, 0.3
# Tried until all tags are found, the last only if some are; one leaves the ink as it is.
THINNING_PX = (3, 1, 5)


@lru_cache(maxsize=16)
def _bits(target: MarkerCorners) -> Bits:
    return Bits.of(target)


def find(image: Image, target: MarkerCorners) -> Detection | NotFound:
    """Find the corners of the markers that are visible."""
    return measured(image, target, _markers(image, target))


def measured(image: Image, target: MarkerCorners, markers: Seen) -> Detection | NotFound:
    """Return the corners of those of some markers that are on the board."""
    found = markers.of_board(target)
    if isinstance(found, NotFound):
        return found
    tags, seen = found
    if not len(tags):
        return diagnose(image, NotFound(Reason.NO_PATTERN, f"no marker of the board, of {target.dictionary}"))
    seen = seen[:, target.corner_order]
    points = tags[:, np.newaxis] * 4 + np.arange(4)
    against = disagreement(target.points[points, :2], seen) or contradiction(target, markers)
    if against is not None:
        return against
    plane = target.points[points.ravel(), :2]
    # The outline of a tag may run astray where a square touches it; the tags around know better.
    expected = from_neighbours(plane, seen.reshape(-1, 2))
    astray = np.linalg.norm(expected - seen.reshape(-1, 2), axis=1) > ASTRAY_PX
    seen = np.where(astray[:, np.newaxis], expected, seen.reshape(-1, 2)).reshape(-1, 4, 2)
    side = _side(target)
    rough = _measured(image, target, tags, seen, None, rough=True).places
    good = np.flatnonzero(np.isfinite(rough[:, 0]))
    lens = _core.PlaneMap.fitted(plane[good], rough[good]) if len(good) >= 4 else None
    if lens is None:
        return NotFound(Reason.INCOMPLETE, f"{len(tags)} tags, but their corners are cut or unclear")
    # Once more: all corners together tell the directions of edges better than a tag does.
    again = np.where(np.isfinite(rough), rough, seen.reshape(-1, 2)).reshape(-1, 4, 2)
    steps = lens.steps(plane, 0.1 * side)
    fits = _measured(image, target, tags, again, steps)
    good = np.flatnonzero(np.isfinite(rough[:, 0]) & ~fits.spoilt())
    expected = from_neighbours(plane[good], fits.places[good])
    good = good[np.linalg.norm(expected - fits.places[good], axis=1) <= ASTRAY_PX]
    if len(good) < 4:
        return NotFound(Reason.INCOMPLETE, f"{len(tags)} tags, but their corners are cut or unclear")
    if len(tags) == 1 and not _has_sides(image, fits.places):
        return NotFound(Reason.INCOMPLETE, "the marker is seen, but something covers a corner of it")
    sharp = without_edge_shift(plane[good], fits.places[good], _sides(target, tags, steps)[good])
    sigmas = np.hypot(fits.sigmas_px[good], unknown_shift_px(len(good)))
    return ordered(target, points.ravel()[good], sharp, sigmas)


def confirm(image: Image, target: MarkerCorners, board: Aligned) -> Detection | None:
    """Return the corners of a grid that was found where it was expected; None unless it is that one."""
    plane, side = target.points[:, :2], _side(target)
    places = board.places(plane.reshape(-1, 4, 2))
    expected = inside(image, places.reshape(-1, 2)).reshape(-1, 4).all(axis=1)
    read = expected & _bits(target).readable(board)
    if read.sum() < max(min(FEWEST_TAGS, len(places)), LEAST_SHARE * expected.sum()):
        return None
    ids = (4 * np.flatnonzero(read)[:, np.newaxis] + np.arange(4)).ravel()
    corners, plane = places[read].reshape(-1, 2), plane[ids]
    steps = board.steps(plane)
    band = BAND_SHARE * _border(target) * side * np.linalg.norm(steps, axis=2).min()
    tags = np.flatnonzero(read)
    few = spread(len(tags), FEW // 4 if band >= WIDE_PX else len(tags))
    some = (4 * few[:, np.newaxis] + np.arange(4)).ravel()
    near = _measured(image, target, tags[few], places[read][few], steps[some], rough=True).places
    # Then it is known well enough where all are, so that where they were put matters no more.
    again, steps = nearer(plane, corners, steps, some, near)
    fits = _measured(image, target, tags, again.reshape(-1, 4, 2), steps)
    good = ~fits.spoilt() & ~astray(fits.places, corners, side * np.linalg.norm(steps, axis=2).min(axis=1))
    if good.sum() < max(4, LEAST_SHARE * 4 * expected.sum()):
        return None
    sharp = without_edge_shift(plane[good], fits.places[good], _sides(target, tags, steps)[good])
    sigmas = np.hypot(fits.sigmas_px[good], unknown_shift_px(len(good)))
    return ordered(target, ids[good], sharp, sigmas)


def _markers(image: Image, target: MarkerCorners) -> Seen:
    """Return the markers of the target's dictionary.

    The squares that Kalibr prints between tags touch them at their corners, so that outlines may merge; in a
    picture with thinner ink they are apart.
    """
    if not any(isinstance(layer, Squares) for layer in target.artwork().layers):
        return find_markers(image, target.dictionary, target.border_bits)
    ids, seen, repeated = NO_IDS, np.zeros((0, 4, 2)), NO_IDS
    for size in THINNING_PX:
        if size == THINNING_PX[-1] and not len(ids):
            break
        kernel = np.ones((size, size), dtype=np.uint8)
        thinned = image if size == 1 else np.asarray(cv2.dilate(image, kernel), dtype=np.uint8)
        more = find_markers(thinned, target.dictionary, target.border_bits)
        new = ~np.isin(more.ids, ids)
        # Its edges have moved inwards by half the size: the corners belong further out on the diagonals.
        outwards = more.corners - more.corners.mean(axis=1, keepdims=True)
        outwards /= np.linalg.norm(outwards, axis=2, keepdims=True)
        grown = more.corners + outwards * (size // 2) * np.sqrt(2.0)
        ids, seen = np.concatenate([ids, more.ids[new]]), np.concatenate([seen, grown[new]])
        repeated = np.union1d(repeated, more.repeated)
        if np.isin(target.marker_ids, ids).all():
            break
    once = ~np.isin(ids, repeated)
    return Seen(ids[once], seen[once], repeated)


def _has_sides(image: Image, corners: FloatArray) -> bool:
    """Tell whether the sides between the corners (4, 2) of a marker are its edges, from corner to corner.

    Other markers would tell that a corner is not where it should be; of a single one the sides do.
    """
    before, after = corners, np.roll(corners, -1, axis=0)
    along = np.linspace(0.05, 0.95, SIDE_SAMPLES)[:, np.newaxis]
    line = before[:, np.newaxis] + along * (after - before)[:, np.newaxis]
    across = (after - before)[:, ::-1] * [1.0, -1.0]
    across *= (ASIDE_PX / np.maximum(np.linalg.norm(across, axis=1), 1e-9))[:, np.newaxis]
    # Outwards, whichever way the corners go around.
    across *= np.sign(((line.mean(axis=1) - corners.mean(axis=0)) * across).sum(axis=1))[:, np.newaxis]
    step = sampled(image, line + across[:, np.newaxis]) - sampled(image, line - across[:, np.newaxis])
    is_edge = step >= SIDE_CONTRAST * max(float(np.median(step)), 0.0)
    return bool((is_edge & (step > 0)).mean(axis=1).min() >= SIDE_SHARE)


def _side(target: MarkerCorners) -> float:
    """Return the side of a marker in metres."""
    return float(np.linalg.norm(target.points[1] - target.points[0]))


def _border(target: MarkerCorners) -> float:
    """Return what is free of other edges along a marker's, as a share of its side."""
    cells = marker_bits(target.dictionary) + 2 * target.border_bits
    return min(target.border_bits / cells, target.gap_m / _side(target))


def _sides(target: MarkerCorners, markers: IndexArray, steps: FloatArray) -> FloatArray:
    """Return the directions (4 M, 2, 2) in the image of both sides that begin at each corner of markers (M,).

    `steps` (4 M, 2, 2) are the pixels per metre along both axes there.
    """
    plane = target.points[:, :2].reshape(-1, 4, 2)[markers]
    sides = np.stack([np.roll(plane, -1, axis=1) - plane, np.roll(plane, 1, axis=1) - plane], axis=2)
    directions = sides.reshape(-1, 2, 2) @ steps
    return directions / np.linalg.norm(directions, axis=2, keepdims=True)


def _measured(
    image: Image,
    target: MarkerCorners,
    markers: IndexArray,
    tags: FloatArray,
    steps: FloatArray | None,
    rough: bool = False,
) -> CornerFits:
    """Return the corners (4 M) of markers (M,) with corners (M, 4, 2) as fitted.

    The directions of the edges are those of the outlines, or, if it is known, those that the pixels
    (4 M, 2, 2) per metre along both axes tell.
    """
    after = np.roll(tags, -1, axis=1) - tags
    before = np.roll(tags, 1, axis=1) - tags
    lengths = np.minimum(np.linalg.norm(after, axis=2), np.linalg.norm(before, axis=2)).reshape(-1)
    directions = np.stack([after, before], axis=2).reshape(-1, 2, 2)
    directions = directions / np.linalg.norm(directions, axis=2, keepdims=True)
    if steps is not None:
        directions = _sides(target, markers, steps)
    height = lengths * np.abs(np.linalg.det(directions))
    return corner_fits(
        image,
        tags.reshape(-1, 2),
        directions,
        WINDOW_SHARE * target.gap_m / _side(target) * height,
        CornerKind.QUADRANTS,
        bands=BAND_SHARE * _border(target) * height,
        rough=rough,
    )
