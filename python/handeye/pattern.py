"""What is printed on a target: dark or light at any place of its plane."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.errors import InputError
from handeye.types import AprilGrid, Charuco, Chessboard, CircleGrid, Target
from handeye.types.arrays import FloatArray, IndexArray

Mask = NDArray[np.bool_]


class Pattern(ABC):
    """Ink on a light board.

    Attributes
    ----------
    low, high
        (2,) corners of the printed part in the plane of the target, metres.
    finest_m
        Size of the smallest detail.
    """

    def __init__(self, low: FloatArray, high: FloatArray, finest_m: float) -> None:
        self.low = low
        self.high = high
        self.finest_m = finest_m

    @abstractmethod
    def is_dark(self, plane: FloatArray) -> Mask:
        """Tell where (N,) there is ink, at places (N, 2) of the plane of the target in metres."""


class Squares(Pattern):
    """A chessboard whose outer square at the upper left is dark; point 0 is the first inner corner."""

    def __init__(self, rows: int, columns: int, side_m: float, *, first_is_dark: bool = True) -> None:
        """Take the number of squares."""
        self._shape = np.array([columns, rows])
        self._side = side_m
        self._parity = 0 if first_is_dark else 1
        super().__init__(np.full(2, -side_m), (self._shape - 1.0) * side_m, side_m)

    def square(self, plane: FloatArray) -> tuple[IndexArray, FloatArray, Mask]:
        """Return column and row (N, 2) of squares, places (N, 2) in them, and which are on the board.

        Places in a square run from 0 to 1.
        """
        scaled = plane / self._side + 1.0
        index = np.floor(scaled).astype(np.int64)
        column, row = index.T
        inside = (column >= 0) & (row >= 0) & (column < self._shape[0]) & (row < self._shape[1])
        return index, scaled - index, inside

    def is_dark(self, plane: FloatArray) -> Mask:
        """Tell where there is ink."""
        index, _, inside = self.square(plane)
        return inside & (index.sum(axis=1) % 2 == self._parity)


class Circles(Pattern):
    """A grid of circles."""

    def __init__(self, target: CircleGrid) -> None:
        self._target = target
        self._radii = target.radii_m
        reach = float(self._radii.max())
        points = target.points[:, :2]
        super().__init__(points.min(axis=0) - reach, points.max(axis=0) + reach, 2 * target.radius_m)

    def is_dark(self, plane: FloatArray) -> Mask:
        """Tell where there is ink."""
        dark = np.zeros(len(plane), dtype=bool)
        above = np.floor(plane[:, 1] / self._target.pitch_m).astype(np.int64)
        for row in (above, above + 1):
            dark |= self._in_row(plane, row)
        return dark

    def _in_row(self, plane: FloatArray, row: IndexArray) -> Mask:
        """Tell which places are in the nearest circle of a row of the grid, one row for each place."""
        target = self._target
        row = row.clip(0, target.rows - 1)
        step, shift = (2, row % 2) if target.asymmetric else (1, np.zeros_like(row))
        column = np.rint((plane[:, 0] / target.pitch_m - shift) / step).astype(np.int64)
        column = column.clip(0, target.columns - 1)
        centre = np.column_stack([step * column + shift, row]) * target.pitch_m
        radius = self._radii[row * target.columns + column]
        return ((plane - centre) ** 2).sum(axis=1) < radius**2


class CharucoSquares(Squares):
    """A chessboard with markers in its light squares."""

    def __init__(self, target: Charuco) -> None:
        light_first = target.legacy_pattern and target.rows % 2 == 0
        super().__init__(target.rows, target.columns, target.square_m, first_is_dark=not light_first)
        self._share = target.marker_m / target.square_m
        number = target.rows * target.columns // 2 + 1
        self._markers = marker_bits(target.dictionary, number, 1)
        self._columns = target.columns
        self.finest_m = target.marker_m / self._markers.shape[1]

    def is_dark(self, plane: FloatArray) -> Mask:
        """Tell where there is ink."""
        index, place, inside = self.square(plane)
        black = index.sum(axis=1) % 2 == self._parity
        # Markers are numbered row by row over the light squares.
        serial = index[:, 1] * self._columns + index[:, 0]
        first_is_light = self._parity == 1
        marker = (serial + 1) // 2 if first_is_light else serial // 2
        if self._columns % 2 == 0:
            marker = serial // 2
        cell = (place - 0.5) / self._share + 0.5
        return inside & (black | self._in_marker(marker, cell))

    def _in_marker(self, marker: IndexArray, cell: FloatArray) -> Mask:
        return look_up(self._markers, marker, cell)


class Tags(Pattern):
    """A grid of AprilTags as Kalibr prints it; with a border of two bits also the squares between tags."""

    def __init__(self, target: AprilGrid) -> None:
        number = target.rows * target.columns
        # For OpenCV Kalibr's tags stand on their head.
        self._tags = marker_bits(target.dictionary, number, target.border_bits)[:, ::-1, ::-1]
        self._target = target
        self._pitch = target.tag_m * (1 + target.spacing_ratio)
        gap = target.tag_m * target.spacing_ratio
        self._has_squares = target.border_bits == 2 and target.spacing_ratio < 1
        reach = gap if self._has_squares else 0.0
        points = target.points[:, :2]
        finest = min(target.tag_m / self._tags.shape[1], gap)
        super().__init__(points.min(axis=0) - reach, points.max(axis=0) + reach, finest)

    def is_dark(self, plane: FloatArray) -> Mask:
        """Tell where there is ink."""
        target = self._target
        # In units of a tag: x to the right from the left edge, y up from the lower edge.
        place = np.column_stack([plane[:, 0], -plane[:, 1]])
        index = np.floor(place / self._pitch).astype(np.int64)
        inner = (place - index * self._pitch) / target.tag_m
        on_grid = np.all((index >= 0) & (index < [target.columns, target.rows]), axis=1)
        tag = index[:, 1] * target.columns + index[:, 0]
        cell = np.column_stack([inner[:, 0], 1 - inner[:, 1]])
        dark = on_grid & look_up(self._tags, tag.clip(0, len(self._tags) - 1), cell)
        if self._has_squares:
            in_square = np.all(inner >= 1, axis=1)
            beside = np.all((index >= -1) & (index < [target.columns, target.rows]), axis=1)
            dark |= in_square & beside
        return dark


def look_up(bits: Mask, which: IndexArray, cell: FloatArray) -> Mask:
    """Tell which places (N, 2), 0 to 1 over a marker (x right, y down), are dark bits of markers (N,)."""
    size = bits.shape[1]
    inside = np.all((cell >= 0) & (cell < 1), axis=1)
    column, row = np.floor(cell * size).astype(np.int64).clip(0, size - 1).T
    return inside & bits[which.clip(0, len(bits) - 1), row, column]


@cache
def marker_bits(dictionary: str, number: int, border: int) -> Mask:
    """Return the dark bits (number, side, side) of the first markers of a dictionary, border included."""
    markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    side = markers.markerSize + 2 * border
    available = min(number, len(markers.bytesList))
    drawn = [
        cv2.aruco.generateImageMarker(markers, i, side, borderBits=border) < 128 for i in range(available)
    ]
    return np.array(drawn, dtype=bool)


_PATTERNS: dict[type[Target], Callable[[Any], Pattern]] = {
    Chessboard: lambda target: Squares(target.rows + 1, target.columns + 1, target.pitch_m),
    CircleGrid: Circles,
    Charuco: CharucoSquares,
    AprilGrid: Tags,
}


def pattern_of(target: Target) -> Pattern:
    """Return what is printed on a target.

    Raises
    ------
    InputError
        A family of targets that nobody has drawn.
    """
    make = _PATTERNS.get(type(target))
    if make is None:
        raise InputError(f"target: no picture of the family {target.family}", code="unknown_target")
    return make(target)
