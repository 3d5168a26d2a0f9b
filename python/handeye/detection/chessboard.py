"""Corners of a chessboard.

Found by Duda and Frese, "Accurate detection and localization of checkerboard corners for calibration" (BMVC
2018), as in `cv2.findChessboardCornersSB`, then measured by fitting a picture of a corner, see `corner_fit`.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from cv2.typing import MatLike

from handeye.detection.base import (
    Detection,
    Image,
    NotFound,
    Reason,
    is_mirrored,
    ordered,
)
from handeye.detection.beyond import goes_on
from handeye.detection.corner_fit import CornerKind, astray, fit_corners
from handeye.detection.diagnosis import diagnose
from handeye.detection.part import Part
from handeye.detection.registration import LEAST_LIKENESS, Aligned
from handeye.types import Chessboard
from handeye.types.arrays import FloatArray

# Searching takes time with the number of pixels; a board that fills the image is found at this size too.
SEARCH_SIDE_PX = 2000
# Part of a square's height that the window of a corner may take.
WINDOW_SHARE = 0.8


def find(image: Image, target: Chessboard) -> Detection | NotFound:
    """Find all inner corners of a chessboard.

    Point 0 is chosen so that the square between the first corners of the first two rows is dark, if the board
    can be turned so: the board stands as it is usually drawn, with a dark square at the upper left. (OpenCV's
    `findChessboardCornersSB` begins at the light one.)
    """
    coarse = _search(image, target)
    if coarse is None:
        return _explain(image, target)
    corners, _ = _measured(image, target, _labeled(image, target, coarse))
    return ordered(target, np.arange(target.point_count), corners)


def confirm(image: Image, target: Chessboard, board: Aligned) -> Detection | None:
    """Return the corners of a chessboard that was found where it was expected, None unless all are there."""
    plane = target.points[:, :2]
    if board.likeness(plane).min() < LEAST_LIKENESS or goes_on(target, board):
        return None
    places = board.places(plane)
    corners, complete = _measured(image, target, places)
    if not complete or astray(corners, places, _edges(target, places).heights).any():
        return None
    return ordered(target, np.arange(target.point_count), corners)


def _measured(image: Image, target: Chessboard, corners: FloatArray) -> tuple[FloatArray, bool]:
    """Return corners (P, 2) from first guesses, and whether all of them could be fitted."""
    complete = True
    # Twice: what the corners found tell about their edges is better than what those of the search told.
    for _ in range(2):
        edges = _edges(target, corners)
        fitted = fit_corners(
            image,
            corners,
            edges.directions,
            WINDOW_SHARE * edges.heights,
            CornerKind.CROSSING,
            edges.curvatures,
        )
        good = np.isfinite(fitted)
        complete = complete and bool(good.all())
        # Where glare or a shadow's edge spoils the picture, what the search found is still the corner.
        corners = np.where(good, fitted, corners)
    return corners, complete


def _search(image: Image, target: Chessboard) -> FloatArray | None:
    """Return corners (P, 2) in the order OpenCV gives them, cheap attempts first."""
    longest = max(image.shape)
    if longest > SEARCH_SIDE_PX:
        found = _within(Part.whole(image, SEARCH_SIDE_PX / longest), target)
        if found is not None:
            return found
    found = _corners(image, target, 0)
    if found is None:
        found = _corners(image, target, cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE)
    return found


def _within(part: Part, target: Chessboard) -> FloatArray | None:
    found = _corners(part.picture, target, 0)
    return None if found is None else part.places(found)


@dataclass(frozen=True)
class _Edges:
    """Edges of corners: directions (P, 2, 2), curvatures (P, 2) in 1 / px, least heights (P,) of squares."""

    directions: FloatArray
    curvatures: FloatArray
    heights: FloatArray


def _edges(target: Chessboard, corners: FloatArray) -> _Edges:
    """Return what the neighbours of each corner tell about its edges."""
    grid = corners.reshape(target.rows, target.columns, 2)
    along_rows = _along(grid)
    along_columns = [part.swapaxes(0, 1) for part in _along(grid.swapaxes(0, 1))]
    directions = np.stack([along_rows[0], along_columns[0]], axis=2).reshape(-1, 2, 2)
    curvatures = np.stack([along_rows[1], along_columns[1]], axis=2).reshape(-1, 2)
    lengths = np.minimum(along_rows[2], along_columns[2]).ravel()
    first, second = directions[:, 0], directions[:, 1]
    sine = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    return _Edges(directions, curvatures, lengths * sine)


def _along(grid: FloatArray) -> list[FloatArray]:
    """Return directions (R, C, 2), curvatures and least steps (R, C) along the rows of a grid (R, C, 2)."""
    steps = np.diff(grid, axis=1)
    before = np.concatenate([steps[:, :1], steps], axis=1)
    after = np.concatenate([steps, steps[:, -1:]], axis=1)
    chord = before + after
    length = np.linalg.norm(chord, axis=2)
    direction = chord / length[:, :, np.newaxis]
    bent = after - before
    left = direction[..., 0] * bent[..., 1] - direction[..., 1] * bent[..., 0]
    curvature = left / (length / 2) ** 2
    # Ends take that of their neighbours; noise is averaged over three corners of each line.
    curvature[:, 0], curvature[:, -1] = curvature[:, 1], curvature[:, -2]
    padded = np.pad(curvature, ((0, 0), (1, 1)), mode="edge")
    smooth = (padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]) / 3
    shortest = np.minimum(np.linalg.norm(before, axis=2), np.linalg.norm(after, axis=2))
    return [direction, smooth, shortest]


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
