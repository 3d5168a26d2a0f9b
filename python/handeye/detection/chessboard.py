"""Corners of a chessboard.

Duda and Frese, "Accurate detection and localization of checkerboard corners for calibration" (BMVC 2018), as
in `cv2.findChessboardCornersSB`: it fits a model of the corner to the filtered image and is about twice as
accurate as iterating on gradients.
"""

import cv2
import numpy as np
from cv2.typing import MatLike

from handeye.detection.base import Detection, Image, NotFound, Reason, bounding_box, is_mirrored, ordered
from handeye.detection.diagnosis import diagnose
from handeye.types import Chessboard
from handeye.types.arrays import FloatArray

# Searching takes time with the number of pixels; a board that fills the image is found at this size too.
SEARCH_SIDE_PX = 2000
# Share of the board's extent left around it when corners are measured.
MARGIN = 0.15
# Two measurements of one corner further apart than this (RMS) are not of the same corners.
AGREE_PX = 2.0


def find(image: Image, target: Chessboard) -> Detection | NotFound:
    """Find all inner corners of a chessboard.

    Point 0 is chosen so that the square between the first corners of the first two rows is dark, if the board
    can be turned so: the board stands as it is usually drawn, with a dark square at the upper left. (OpenCV's
    `findChessboardCornersSB` begins at the light one.)
    """
    coarse = _search(image, target)
    if coarse is None:
        return _explain(image, target)
    coarse = _labeled(image, target, coarse)
    fine = _measured(image, target, coarse)
    return ordered(target, np.arange(target.point_count), coarse if fine is None else fine)


def _search(image: Image, target: Chessboard) -> FloatArray | None:
    """Return corners (P, 2) in the order OpenCV gives them, cheap attempts first."""
    longest = max(image.shape)
    if longest > SEARCH_SIDE_PX:
        scale = SEARCH_SIDE_PX / longest
        small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        found = _corners(small, target, 0)
        if found is not None:
            factor = np.array(image.shape[::-1]) / small.shape[::-1]
            return (found + 0.5) * factor - 0.5
    found = _corners(image, target, 0)
    if found is None:
        found = _corners(image, target, cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE)
    return found


def _measured(image: Image, target: Chessboard, coarse: FloatArray) -> FloatArray | None:
    """Return the corners measured around the board only, which takes a fifth of the time."""
    rows, columns = bounding_box(coarse, MARGIN, 20, image.shape)
    part = np.ascontiguousarray(image[rows, columns])
    found = _corners(part, target, cv2.CALIB_CB_ACCURACY)
    if found is None:
        found = _corners(part, target, cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE)
    if found is None:
        return None
    fine = found + np.array([columns.start, rows.start])
    for turn in target.turns:  # the search may have begun at another end
        turned = np.empty_like(fine)
        turned[turn.permutation] = fine
        if np.sqrt(((turned - coarse) ** 2).sum(axis=1).mean()) < AGREE_PX:
            return turned
    return None


def _corners(image: MatLike, target: Chessboard, flags: int) -> FloatArray | None:
    if min(image.shape) < 8:
        return None
    found, corners = cv2.findChessboardCornersSB(image, (target.columns, target.rows), flags=flags)
    if not found or len(corners) != target.point_count:
        return None
    corners = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    if not np.isfinite(corners).all():
        return None
    if is_mirrored(target.points[:, :2], corners):
        corners = corners.reshape(target.rows, target.columns, 2)[:, ::-1].reshape(-1, 2)
    return corners


def _labeled(image: Image, target: Chessboard, corners: FloatArray) -> FloatArray:
    """Return the corners turned so that the first square is dark, if a turn does that."""
    for turn in target.turns:
        turned = np.empty_like(corners)
        turned[turn.permutation] = corners
        if _first_square_is_dark(image, target, turned):
            return turned
    return corners


def _first_square_is_dark(image: Image, target: Chessboard, corners: FloatArray) -> bool:
    grid = corners.reshape(target.rows, target.columns, 2)
    middles = (grid[:-1, :-1] + grid[1:, 1:] + grid[1:, :-1] + grid[:-1, 1:]) / 4
    columns, rows = np.rint(middles).astype(int).transpose(2, 0, 1)
    height, width = image.shape
    grey = image[rows.clip(0, height - 1), columns.clip(0, width - 1)].astype(np.float64)
    even = np.add.outer(np.arange(target.rows - 1), np.arange(target.columns - 1)) % 2 == 0
    # One square alone (2 x 2 corners) has no neighbour; the image as a whole stands in.
    others = grey[~even].mean() if (~even).any() else float(image.mean())
    return bool(grey[even].mean() < others)


def _explain(image: Image, target: Chessboard) -> NotFound:
    """Look for a board of another size."""
    wanted = f"{target.columns} x {target.rows}"
    found, _, meta = cv2.findChessboardCornersSBWithMeta(
        image, (3, 3), cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
    )
    if found:
        rows, columns = meta.shape[:2]
        if {rows, columns} != {target.rows, target.columns}:
            return NotFound(
                Reason.WRONG_SIZE,
                f"a chessboard with {columns} x {rows} inner corners is visible, expected {wanted}",
            )
    return diagnose(image, NotFound(Reason.NO_PATTERN, f"no chessboard with {wanted} inner corners"))
