"""Inner corners of a ChArUco board, each known by the markers beside it."""

import cv2
import numpy as np

from handeye.detection.base import (
    NOT_HERE,
    Detection,
    Image,
    NotFound,
    Reason,
    ordered,
)
from handeye.detection.corner_fit import CornerKind, fit_corners
from handeye.detection.diagnosis import diagnose
from handeye.detection.markers import dictionary, disagreement, foreign_markers, parameters, unique
from handeye.detection.part import Part
from handeye.types import Charuco
from handeye.types.arrays import FloatArray

FEWEST_CORNERS = 4
# Part of a square that the window of a corner may take, and of the way to a marker that its strips may.
WINDOW_SHARE = 0.7
BAND_SHARE = 0.8


def find(image: Image, target: Charuco, part: Part | None = None) -> Detection | NotFound:
    """Find the corners that are visible, at least four; with a part of the image, by one attempt there."""
    board = cv2.aruco.CharucoBoard(
        (target.columns, target.rows), target.square_m, target.marker_m, dictionary(target.dictionary)
    )
    board.setLegacyPattern(target.legacy_pattern)
    here = part or Part.whole(image)
    detector = cv2.aruco.CharucoDetector(board, cv2.aruco.CharucoParameters(), parameters(1))
    found, found_ids, marker_corners, marker_ids = detector.detectBoard(here.picture)
    ids, seen = unique(marker_ids, marker_corners)
    seen = here.places(seen)
    on_board = np.asarray(board.getIds()).ravel()
    places = np.asarray(board.getObjPoints(), dtype=np.float64)[:, :, :2]
    known = np.isin(ids, on_board)
    against = disagreement(places[ids[known]], seen[known])
    if against is not None:
        return against
    if len(ids) >= FEWEST_CORNERS and known.mean() < 0.5:
        return NotFound(
            Reason.INCONSISTENT,
            f"{(~known).sum()} of {len(ids)} markers have numbers that the board described does not have",
        )
    if part is not None and not known.any():
        return NOT_HERE
    if not known.any():
        other = foreign_markers(image, target.dictionary, 1)
        return other or diagnose(image, NotFound(Reason.NO_PATTERN, f"no marker of {target.dictionary}"))
    # OpenCV gives None where it finds nothing, whatever its types say.
    number = 0 if found_ids is None else len(found_ids)  # pyright: ignore[reportUnnecessaryComparison]
    if number >= FEWEST_CORNERS:
        corners = here.places(np.asarray(found, dtype=np.float64).reshape(-1, 2))
        sharp = _measured(image, target, corners, places[ids[known]], seen[known])
        good = np.isfinite(sharp).all(axis=1)
        number = int(good.sum())
        if number >= FEWEST_CORNERS:
            return ordered(target, np.asarray(found_ids).ravel()[good], sharp[good])
    return NotFound(
        Reason.INCOMPLETE,
        f"{number} of {target.point_count} corners by {known.sum()} markers; {FEWEST_CORNERS} are needed",
    )


def _measured(
    image: Image, target: Charuco, corners: FloatArray, places: FloatArray, markers: FloatArray
) -> FloatArray:
    """Return the corners (N, 2) as fitted, NaN where that fails; the nearest marker tells the directions."""
    centres = markers.mean(axis=1)
    nearest = np.argmin(np.linalg.norm(corners[:, np.newaxis] - centres, axis=2), axis=1)
    # The affine map of each marker's own corners, least squares.
    flat = places - places.mean(axis=1, keepdims=True)
    inverse = np.asarray(np.linalg.pinv(flat), dtype=np.float64)
    steps = (inverse @ (markers - centres[:, np.newaxis]))[nearest]
    lengths = np.linalg.norm(steps, axis=2)
    directions = steps / lengths[:, :, np.newaxis]
    sine = np.abs(np.linalg.det(directions))
    scale = lengths.min(axis=1) * sine  # pixels per metre across the edges
    free = (target.square_m - target.marker_m) / 2
    return fit_corners(
        image,
        corners,
        directions,
        WINDOW_SHARE * target.square_m * scale,
        CornerKind.CROSSING,
        bands=BAND_SHARE * free * scale,
    )
