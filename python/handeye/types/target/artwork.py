"""What is printed on a target: layers of ink in the plane of the target, metres, x right and y down.

A family says this once. `handeye.pattern` turns it into dark and light at any place, for pictures and for the
search where a board is expected; `handeye.printing` turns it into outlines for paper.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye.types.arrays import FloatArray, IndexArray


@dataclass(frozen=True, eq=False)
class Squares:
    """Dark squares on a lattice.

    Attributes
    ----------
    origin
        (2,) upper left corner of the first.
    pitch_m, side_m
        Distance of neighbours, and side of a square; equal on a chessboard.
    dark
        (R, C) which are there.
    """

    origin: FloatArray
    pitch_m: float
    side_m: float
    dark: NDArray[np.bool_]

    @property
    def extent(self) -> tuple[FloatArray, FloatArray]:
        """(2,) upper left and lower right corner of the lattice."""
        return _extent(self.origin, self.pitch_m, self.side_m, self.dark.shape)


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers of a dictionary on a lattice, their black borders included.

    Attributes
    ----------
    origin, pitch_m, side_m
        As of `Squares`.
    ids
        (R, C) number of each in the dictionary, -1 where there is none.
    dictionary
        OpenCV's name.
    border_bits
        Width of the black border.
    on_head
        Whether they are turned by half a turn from how OpenCV draws them.
    """

    origin: FloatArray
    pitch_m: float
    side_m: float
    ids: IndexArray
    dictionary: str
    border_bits: int
    on_head: bool = False

    @property
    def extent(self) -> tuple[FloatArray, FloatArray]:
        """(2,) upper left and lower right corner of the lattice."""
        return _extent(self.origin, self.pitch_m, self.side_m, self.ids.shape)


@dataclass(frozen=True, eq=False)
class Discs:
    """Dark discs on a lattice.

    Attributes
    ----------
    pitch_m
        Distance of neighbouring places; the first place is the origin of the target.
    radii_m
        (R, C) radius at each place, 0 where there is none.
    """

    pitch_m: float
    radii_m: FloatArray

    @property
    def extent(self) -> tuple[FloatArray, FloatArray]:
        """(2,) corners of the lattice, the largest radius around it."""
        reach = float(self.radii_m.max())
        rows, columns = self.radii_m.shape
        high = np.array([columns - 1, rows - 1]) * self.pitch_m
        return np.full(2, -reach), high + reach


Layer = Squares | Markers | Discs


@dataclass(frozen=True, eq=False)
class Artwork:
    """Ink on a light board.

    Attributes
    ----------
    layers
        What is dark; no layer covers another.
    quiet_m
        Light margin that it needs around it to be found.
    inverted
        Whether all of it, margin included, is printed light on dark.
    """

    layers: tuple[Layer, ...]
    quiet_m: float
    inverted: bool = False

    @property
    def low(self) -> FloatArray:
        """(2,) upper left corner of what is printed."""
        return np.min([layer.extent[0] for layer in self.layers], axis=0)

    @property
    def high(self) -> FloatArray:
        """(2,) lower right corner of what is printed."""
        return np.max([layer.extent[1] for layer in self.layers], axis=0)


def chequered(rows: int, columns: int, first: int) -> NDArray[np.bool_]:
    """Return which squares (rows, columns) of a chessboard are dark; the first one is if `first` is 0."""
    return np.add.outer(np.arange(rows), np.arange(columns)) % 2 == first


def _extent(
    origin: FloatArray, pitch_m: float, side_m: float, shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    steps = np.array([shape[1] - 1, shape[0] - 1])
    return origin, origin + steps * pitch_m + side_m
