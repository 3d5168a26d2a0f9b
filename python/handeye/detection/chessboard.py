"""Corners of a chessboard.

Crossings of edges are found in a small picture and joined to a mesh, see `saddles` and `mesh`, then measured
in the image by fitting a picture of a corner, see `corner_fit`.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import Detection, Image, NotFound, Reason, inside
from handeye.detection.beyond import goes_on
from handeye.detection.corner_fit import CornerFits, CornerKind, astray, corner_fits
from handeye.detection.diagnosis import diagnose
from handeye.detection.markers import from_neighbours
from handeye.detection.mesh import FEWEST, Mesh, beside, filled, meshes, steps
from handeye.detection.part import Part
from handeye.detection.quality import stated
from handeye.detection.registration import LEAST_LIKENESS, Aligned
from handeye.detection.saddles import find_saddles
from handeye.types import Chessboard
from handeye.types.arrays import FloatArray

# The search begins in a picture of about this size and goes on in ones twice as large, up to the image or the
# largest one in which squares are looked for.
COARSEST_SIDE_PX, LARGEST_SIDE_PX, SMALLEST_SIDE_PX = 500, 2800, 24
# A third of a board's corners, or so many, must be joined before it is grown; of a board of any size so many.
LARGE_CORE, FEWEST_CORE = 12, 6
# Part of a square's height that the window of a corner may take.
WINDOW_SHARE = 0.8
# Fewer lines of corners may be any pattern.
FEWEST_LINES = 3
# Corners may be hidden or spoilt, but so many must be there, and so many of each outermost line: else the
# board might lie one line off.
LEAST_SHARE = 0.8
LEAST_LINE_SHARE = 0.6
# Of the corners so many must be measured well.
LEAST_MEASURED = 0.4
# A corner may be off from where those around it put it by this much, or this share of a square.
OFF_PX, OFF_SHARE = 0.6, 0.02


def find(image: Image, target: Chessboard) -> Detection | NotFound:
    """Find the inner corners of a chessboard; a few that are hidden or spoilt are left out.

    Point 0 is chosen so that the square between the first corners of the first two rows is dark, if the board
    can be turned so: the board stands as it is usually drawn, with a dark square at the upper left.
    """
    spoilt: NotFound | None = None
    core = max(FEWEST, min(target.point_count // 3, LARGE_CORE))
    for part in _parts(image):
        laid = [_laid(target, mesh) for mesh in meshes(part.picture, find_saddles(part.picture), core)]
        boards = [board for board in laid if board is not None]
        for board in boards:
            found = _measured(image, target, _labeled(image, target, part.places(board)))
            if isinstance(found, Detection):
                if any(_is_elsewhere(board, other) for other in boards):
                    return NotFound(Reason.REPEATED, "the board is in the picture twice")
                return found
            spoilt = spoilt or found
    return spoilt or diagnose(
        image,
        NotFound(Reason.NO_PATTERN, f"no chessboard with {target.columns} x {target.rows} inner corners"),
    )


def _parts(image: Image) -> Iterator[Part]:
    """Return the image at sizes from coarse to fine."""
    largest = Part.halved(image, LARGEST_SIDE_PX).picture
    halvings = max(0, round(np.log2(max(image.shape) / COARSEST_SIDE_PX)))
    for power in range(halvings, -1, -1):
        part = Part.whole(image, 0.5**power)
        if max(part.picture.shape) > max(largest.shape):
            return
        if min(part.picture.shape) >= SMALLEST_SIDE_PX:
            yield part


def _laid(target: Chessboard, mesh: Mesh) -> FloatArray | None:
    """Return corners (P, 2), NaN where there are none, if a mesh has the size of the board."""
    grid = mesh.places
    if grid.shape[:2] != (target.rows, target.columns):
        grid = np.rot90(grid)
    if grid.shape[:2] != (target.rows, target.columns) or not _is_certain(np.isfinite(grid[..., 0])):
        return None
    return grid.reshape(-1, 2)


def _is_elsewhere(board: FloatArray, other: FloatArray) -> bool:
    """Tell whether the corners (P, 2) of another board are all outside of the box around those of a board."""
    low, high = np.nanmin(board, axis=0), np.nanmax(board, axis=0)
    return not ((other >= low) & (other <= high)).all(axis=1).any()


def _is_certain(there: NDArray[np.bool_]) -> bool:
    """Tell whether so many of the corners (R, C) are there that the board cannot lie one line further."""
    lines = (there[0], there[-1], there[:, 0], there[:, -1])
    return bool(there.mean() >= LEAST_SHARE and all(line.mean() >= LEAST_LINE_SHARE for line in lines))


def sizes(image: Image) -> Iterator[tuple[int, int]]:
    """Yield rows and columns of corners of the chessboards that an image shows whole."""
    for part in _parts(image):
        for mesh in meshes(part.picture, find_saddles(part.picture), FEWEST_CORE):
            rows, columns = mesh.there.shape
            if min(rows, columns) >= FEWEST_LINES and _is_certain(mesh.there) and _is_whole(part, mesh):
                yield rows, columns


def _is_whole(part: Part, mesh: Mesh) -> bool:
    """Tell whether the next line of corners on each side would be in the picture, too."""
    return bool(inside(part.picture, beside(mesh)).all())


def confirm(image: Image, target: Chessboard, board: Aligned) -> Detection | None:
    """Return the corners of a chessboard that was found where it was expected, None unless all are there."""
    plane = target.points[:, :2]
    if board.likeness(plane).min() < LEAST_LIKENESS or goes_on(target, board):
        return None
    places = board.places(plane)
    fits = _fitted(image, target, places)
    if astray(fits.places, places, _edges(target, places).heights).any():
        return None
    return stated(image, target, np.arange(target.point_count), fits.places, fits.sigmas_px)


def _measured(image: Image, target: Chessboard, corners: FloatArray) -> Detection | NotFound:
    """Return the corners from first guesses (P, 2), without those that are none or cannot be measured."""
    fits = _fitted(image, target, corners)
    fitted = fits.places
    good = np.flatnonzero(~fits.spoilt())
    if len(good) >= FEWEST:
        plane = target.points[good, :2]
        off = np.linalg.norm(from_neighbours(plane, fitted[good]) - fitted[good], axis=1)
        pitch = np.linalg.norm(steps(fitted.reshape(target.rows, target.columns, 2)), axis=-1).min(axis=-1)
        good = good[off <= np.maximum(OFF_PX, OFF_SHARE * pitch.ravel()[good])]
    if len(good) < max(FEWEST, LEAST_MEASURED * target.point_count):
        return NotFound(
            Reason.INCOMPLETE, f"only {len(good)} of {target.point_count} corners can be measured"
        )
    return stated(image, target, good, fitted[good], fits.sigmas_px[good])


def _fitted(image: Image, target: Chessboard, corners: FloatArray) -> CornerFits:
    """Return the corners (P) as fitted from first guesses (P, 2)."""
    fits: CornerFits | None = None
    # Twice: what the corners found tell about their edges is better than what those of the search told.
    for rough in (True, False):
        guesses = filled(corners.reshape(target.rows, target.columns, 2)).reshape(-1, 2)
        edges = _edges(target, guesses)
        fits = corner_fits(
            image,
            guesses,
            edges.directions,
            WINDOW_SHARE * edges.heights,
            CornerKind.CROSSING,
            edges.curvatures,
            rough=rough,
        )
        corners = fits.places
    return fits


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


def _labeled(image: Image, target: Chessboard, corners: FloatArray) -> FloatArray:
    """Return the corners turned so that the first square is dark, if a turn does that."""
    for turn in target.turns:
        turned = np.empty_like(corners)
        turned[turn.permutation] = corners
        if _first_square_is_dark(image, target, turned):
            return turned
    return corners


def _first_square_is_dark(image: Image, target: Chessboard, corners: FloatArray) -> bool:
    grid = filled(corners.reshape(target.rows, target.columns, 2))
    middles = (grid[:-1, :-1] + grid[1:, 1:] + grid[1:, :-1] + grid[:-1, 1:]) / 4
    columns, rows = np.rint(middles).astype(int).transpose(2, 0, 1)
    height, width = image.shape
    grey = image[rows.clip(0, height - 1), columns.clip(0, width - 1)].astype(np.float64)
    even = np.add.outer(np.arange(target.rows - 1), np.arange(target.columns - 1)) % 2 == 0
    # One square alone (2 x 2 corners) has no neighbour; the image as a whole stands in.
    others = grey[~even].mean() if (~even).any() else float(image.mean())
    return bool(grey[even].mean() < others)
