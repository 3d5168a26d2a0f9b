"""Inner corners of a ChArUco board, each known by the markers beside it."""

from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np

from handeye import _core
from handeye.detection.base import (
    Detection,
    Image,
    NotFound,
    Reason,
    inside,
)
from handeye.detection.corner_fit import (
    ASTRAY_PX,
    BAND_SHARE,
    FEW,
    WIDE_PX,
    CornerFits,
    CornerKind,
    astray,
    clear_bands,
    corner_fits,
    curvatures,
    nearer,
    spread,
)
from handeye.detection.diagnosis import diagnose
from handeye.detection.marker_lattice import contradiction
from handeye.detection.markers import (
    LEAST_SHARE,
    Bits,
    Seen,
    dictionary,
    disagreement,
    from_neighbours,
    parameters,
)
from handeye.detection.noise import calmed
from handeye.detection.quality import stated
from handeye.detection.registration import LEAST_LIKENESS, Aligned
from handeye.types import Charuco
from handeye.types.arrays import FloatArray

FEWEST_CORNERS = 4
# Markers read where they are expected.
FEWEST_MARKERS = 2
# Part of a square that the window of a corner may take.
WINDOW_SHARE = 0.7
# A corner is off from where those around it put it by no more than this share of a square.
OFF_SHARE = 0.02
# What the wrong one of two layouts looks like.
_MAY_BE_LAYOUT = (Reason.INCONSISTENT, Reason.INCOMPLETE)


@lru_cache(maxsize=16)
def _board(target: Charuco) -> cv2.aruco.CharucoBoard:
    """Return OpenCV's board."""
    board = cv2.aruco.CharucoBoard(
        (target.columns, target.rows),
        target.square_m,
        target.marker_m,
        dictionary(target.dictionary),
        target.marker_ids.astype(np.int32),
    )
    board.setLegacyPattern(target.legacy_pattern)
    return board


@lru_cache(maxsize=16)
def _bits(target: Charuco) -> Bits:
    return Bits.of(target)


def find(image: Image, target: Charuco) -> Detection | NotFound:
    """Find the corners that are visible, at least four.

    A board of an even number of rows has another layout since OpenCV 4.6, with the same corners: where the
    one described is not there, the other is tried, and the detection says so.
    """
    found = _find(image, target)
    if isinstance(found, Detection) or found.reason not in _MAY_BE_LAYOUT or target.rows % 2:
        return found
    other = replace(target, legacy_pattern=not target.legacy_pattern)
    instead = _find(image, other)
    if isinstance(instead, NotFound):
        return found
    since = "since OpenCV 4.6" if target.legacy_pattern else "of OpenCV before 4.6"
    note = f"the board has the layout {since}: legacy_pattern = {str(other.legacy_pattern).lower()}"
    return replace(instead, note=note)


def _find(image: Image, target: Charuco) -> Detection | NotFound:
    detector = cv2.aruco.CharucoDetector(
        _board(target), cv2.aruco.CharucoParameters(), parameters(target.border_bits)
    )
    found, found_ids, marker_corners, marker_ids = detector.detectBoard(calmed(image))
    seen_markers = Seen.of(marker_ids, marker_corners)
    of_board = seen_markers.of_board(target)
    if isinstance(of_board, NotFound):
        return of_board
    markers, seen = of_board
    if not len(markers):
        return diagnose(image, NotFound(Reason.NO_PATTERN, f"no marker of the board, of {target.dictionary}"))
    places = target.outlines[markers]
    against = disagreement(places, seen) or contradiction(target, seen_markers)
    if against is not None:
        return against
    # OpenCV gives None where it finds nothing, whatever its types say.
    number = 0 if found_ids is None else len(found_ids)  # pyright: ignore[reportUnnecessaryComparison]
    if number >= FEWEST_CORNERS:
        corners = np.asarray(found, dtype=np.float64).reshape(-1, 2)
        numbers = np.asarray(found_ids, dtype=np.int64).ravel()
        steps = _steps(corners, places, seen)
        near = _measured(image, target, corners, steps, rough=True)
        rough = near.places
        good = np.isfinite(rough).all(axis=1)
        numbers, rough, steps = numbers[good], rough[good], steps[good]
        # Once more: all corners together tell the directions of edges better than a marker does.
        plane = target.points[numbers, :2]
        lens = _core.PlaneMap.fitted(plane, rough) if len(rough) >= FEWEST_CORNERS else None
        if lens is not None:
            steps = lens.steps(plane, 0.1 * target.square_m)
        bends = curvatures(lens, plane, target.square_m)
        sharp = _measured(image, target, rough, steps, bends, near.usual_blur_px)
        good = np.flatnonzero(~sharp.spoilt())
        # What lies in front of the board has edges, too: markers and corners around know better.
        around = np.concatenate([sharp.places[good], seen.reshape(-1, 2)])
        expected = from_neighbours(np.concatenate([plane[good], places.reshape(-1, 2)]), around)[: len(good)]
        pitches = target.square_m * np.linalg.norm(steps[good], axis=2).min(axis=1)
        away = np.linalg.norm(sharp.places[good] - expected, axis=1)
        good = good[away <= np.maximum(ASTRAY_PX, OFF_SHARE * pitches)]
        number = len(good)
        if number >= FEWEST_CORNERS:
            return stated(image, target, numbers[good], sharp.places[good], sharp.sigmas_px[good])
    return seen_markers.twice(target) or NotFound(
        Reason.INCOMPLETE,
        f"{number} of {target.point_count} corners by {len(markers)} markers; {FEWEST_CORNERS} are needed",
    )


def confirm(image: Image, target: Charuco, board: Aligned) -> Detection | None:
    """Return the corners of a board that was found where it was expected; None unless it is that one."""
    outlines = target.outlines
    markers = board.places(outlines)
    expected = inside(image, markers.reshape(-1, 2)).reshape(-1, 4).all(axis=1)
    read = expected & _bits(target).readable(board)
    if read.sum() < max(FEWEST_MARKERS, LEAST_SHARE * expected.sum()):
        return None
    plane = target.points[:, :2]
    corners = board.places(plane)
    away = np.linalg.norm(plane[:, np.newaxis] - outlines[read].mean(axis=1), axis=2)
    known = away.min(axis=1) < target.square_m
    seen = inside(image, corners)
    ids = np.flatnonzero(known & seen & (board.likeness(plane) >= LEAST_LIKENESS))
    if len(ids) < FEWEST_CORNERS:
        return None
    corners, plane = corners[ids], plane[ids]
    steps = board.steps(plane)
    band = BAND_SHARE * (target.square_m - target.marker_m) / 2 * np.linalg.norm(steps, axis=2).min()
    some = spread(len(corners), FEW if band >= WIDE_PX else len(corners))
    near = _measured(image, target, corners[some], steps[some], rough=True)
    # Then it is known well enough where all are, so that where they were put matters no more.
    again, steps = nearer(plane, corners, steps, some, near.places)
    bends = curvatures(_core.PlaneMap.fitted(plane, again), plane, target.square_m)
    sharp = _measured(image, target, again, steps, bends, near.usual_blur_px)
    good = ~sharp.spoilt() & ~astray(
        sharp.places, corners, target.square_m * np.linalg.norm(steps, axis=2).min(axis=1)
    )
    if good.sum() < max(FEWEST_CORNERS, LEAST_SHARE * seen.sum()):
        return None
    return stated(image, target, ids[good], sharp.places[good], sharp.sigmas_px[good])


def _steps(corners: FloatArray, places: FloatArray, markers: FloatArray) -> FloatArray:
    """Return the pixels (N, 2, 2) per metre along both axes at corners (N, 2), as the nearest marker tells.

    Markers (M, 4, 2) are at places (M, 4, 2) of the board.
    """
    centres = markers.mean(axis=1)
    nearest = np.argmin(np.linalg.norm(corners[:, np.newaxis] - centres, axis=2), axis=1)
    # The affine map of each marker's own corners, least squares.
    flat = places - places.mean(axis=1, keepdims=True)
    inverse = np.asarray(np.linalg.pinv(flat), dtype=np.float64)
    return (inverse @ (markers - centres[:, np.newaxis]))[nearest]


def _measured(
    image: Image,
    target: Charuco,
    corners: FloatArray,
    steps: FloatArray,
    bends: FloatArray | None = None,
    blur_px: float = 0.0,
    rough: bool = False,
) -> CornerFits:
    """Return the corners (N) as fitted; `bends` (N, 2) are the curvatures of the edges along both axes."""
    lengths = np.linalg.norm(steps, axis=2)
    # Where a marker's corners coincide there are no directions: NaN, which is never fitted.
    with np.errstate(invalid="ignore"):
        directions = steps / lengths[:, :, np.newaxis]
        sine = np.abs(np.linalg.det(directions))
    scale = lengths.min(axis=1) * sine  # pixels per metre across the edges
    free = (target.square_m - target.marker_m) / 2
    return corner_fits(
        image,
        corners,
        directions,
        WINDOW_SHARE * target.square_m * scale,
        CornerKind.CROSSING,
        bends,
        bands=clear_bands(free * scale, blur_px),
        rough=rough,
    )
