"""Corners of the bits of a few markers, which tell how far edges have moved where there are no other markers.

Where one of four cells that meet is dark or one is light, there is a corner like those of the marker itself.
Where dark parts come out larger, corners of dark cells go outwards and those of light cells inwards.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from handeye import _core
from handeye.detection.base import Image
from handeye.detection.corner_fit import CornerKind, clear_bands, corner_fits
from handeye.detection.edge_shift import Corners
from handeye.pattern import Pattern
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.target import MarkerCorners
from handeye.types.target.dictionaries import marker_bits

# How much of a cell the window of a corner takes, and the cells that are large enough for one.
WINDOW_SHARE, LEAST_CELL_PX = 0.45, 6.0
# So many corners of bits tell, together with those of the markers.
FEWEST = 8


@dataclass(frozen=True, eq=False)
class CodeCorners:
    """Corners of bits.

    Attributes
    ----------
    plane
        (K, 2) places on the board in metres.
    sides
        (K, 2, 2) unit vectors on the board along the edges of the cell that is alone, away from the corner.
    signs
        (K,) 1 where it is a dark cell, -1 where it is a light one.
    """

    plane: FloatArray
    sides: FloatArray
    signs: FloatArray

    def take(self, which: IndexArray) -> "CodeCorners":
        """Return some of them, in that order."""
        return CodeCorners(self.plane[which], self.sides[which], self.signs[which])


def cell_m(target: MarkerCorners) -> float:
    """Return the side of a bit in metres."""
    side = float(np.linalg.norm(target.points[1] - target.points[0]))
    return side / (marker_bits(target.dictionary) + 2 * target.border_bits)


@lru_cache(maxsize=64)
def _printed(target: MarkerCorners, marker: int) -> CodeCorners:
    """Return the corners of the bits of one marker, and its own."""
    cell, cells = cell_m(target), marker_bits(target.dictionary) + 2 * target.border_bits
    low = target.points[4 * marker : 4 * marker + 4, :2].min(axis=0)
    nodes = low + cell * np.stack(np.meshgrid(*[np.arange(cells + 1)] * 2), axis=-1).reshape(-1, 2)
    # To the upper left, upper right, lower left and lower right.
    around = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
    dark = Pattern(target).is_dark((nodes[:, np.newaxis] + cell / 2 * around).reshape(-1, 2)).reshape(-1, 4)
    count = dark.sum(axis=1)
    alone = np.flatnonzero((count == 1) | (count == 3))
    is_dark = count[alone] == 1
    corner = around[np.argmax(dark[alone] == is_dark[:, np.newaxis], axis=1)]
    sides = corner[:, :, np.newaxis] * np.eye(2)
    return CodeCorners(nodes[alone], sides, np.where(is_dark, 1.0, -1.0))


def code_corners(
    image: Image, target: MarkerCorners, markers: IndexArray, lens: _core.PlaneMap, blur_px: float
) -> Corners | None:
    """Return those corners of the bits of markers (M,) that can be measured; None if there are too few.

    The markers' own corners are among them, measured in windows as small as those of the bits.
    """
    parts = [_printed(target, int(m)) for m in markers]
    corners = CodeCorners(
        *(np.concatenate([getattr(p, name) for p in parts]) for name in ("plane", "sides", "signs"))
    )
    cell, places = cell_m(target), lens.pixels(corners.plane)
    sigmas = np.zeros(0)
    # Twice: a lens moves what lies between the corners of a large marker.
    for is_last in (False, True):
        steps = lens.steps(corners.plane, cell / 2)
        along = corners.sides @ steps
        lengths = np.linalg.norm(along, axis=2)
        directions = along / np.maximum(lengths, 1e-12)[:, :, np.newaxis]
        height = cell * lengths.min(axis=1) * np.abs(np.linalg.det(directions))
        fits = corner_fits(
            image,
            places,
            directions,
            WINDOW_SHARE * height,
            CornerKind.QUADRANTS,
            bands=clear_bands(height, blur_px),
            rough=not is_last,
        )
        good = np.flatnonzero(~fits.spoilt() & (height >= LEAST_CELL_PX))
        corners, places, sigmas = corners.take(good), fits.places[good], fits.sigmas_px[good]
        again = _core.PlaneMap.fitted(corners.plane, places) if len(good) >= 4 else None
        lens = lens if again is None else again
    if len(places) < FEWEST + 4 * len(markers):
        return None
    sides = corners.sides @ lens.steps(corners.plane, cell / 2)
    sides /= np.linalg.norm(sides, axis=2, keepdims=True)
    return Corners(corners.plane, places, sides, corners.signs, sigmas)
