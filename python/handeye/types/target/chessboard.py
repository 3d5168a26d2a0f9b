"""The chessboard."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from handeye.types.arrays import FloatArray, count, positive
from handeye.types.target.artwork import Artwork, Squares, chequered
from handeye.types.target.base import Target, check_point_count, grid, mm
from handeye.types.target.symmetry import Turn


@dataclass(frozen=True)
class Chessboard(Target):
    """A chessboard; its points are the inner corners, row by row.

    Parameters
    ----------
    rows, columns
        Number of inner corners (not of squares), each 2 to 1000: a board of 10 x 7 squares has 9 columns and
        6 rows.
    pitch_m
        Side of a square in metres.

    Raises
    ------
    InputError
        A number out of its range.

    Examples
    --------
    >>> Chessboard(rows=6, columns=9, pitch_m=0.025).points.shape
    (54, 3)
    """

    family: ClassVar[str] = "chessboard"
    scale: ClassVar[str] = "pitch_m"
    # An even and an odd number of corners, so that it has no symmetry.
    usual_measures: ClassVar[Mapping[str, Any]] = {"rows": 7, "columns": 10}

    rows: int
    columns: int
    pitch_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", count(self.rows, 2, 1000, "chessboard: rows"))
        object.__setattr__(self, "columns", count(self.columns, 2, 1000, "chessboard: columns"))
        object.__setattr__(self, "pitch_m", positive(self.pitch_m, "chessboard: pitch_m"))
        check_point_count(self.rows * self.columns, "chessboard")

    def _layout(self) -> FloatArray:
        return grid(self.rows, self.columns, self.pitch_m)

    def artwork(self) -> Artwork:
        """Return the squares, dark at the upper left as OpenCV draws them; the origin is one square in."""
        dark = chequered(self.rows + 1, self.columns + 1, 0)
        squares = Squares(np.full(2, -self.pitch_m), self.pitch_m, self.pitch_m, dark)
        return Artwork((squares,), self.pitch_m / 4)

    @property
    def caption(self) -> str:
        """The board in one line."""
        return (
            f"Chessboard, {self.rows} x {self.columns} inner corners "
            f"({self.rows + 1} x {self.columns + 1} squares), side of a square {mm(self.pitch_m)}"
        )

    @property
    def spacing_m(self) -> float:
        """Side of a square."""
        return self.pitch_m

    def _looks_the_same(self, turn: Turn) -> bool:
        """Tell whether colours fall on colours.

        Squares are numbered (i, j), 0 to `rows` and 0 to `columns`, and coloured by the parity of i + j.
        Half a turn moves (i, j) to (rows - i, columns - j), whose parity is the same if rows + columns is
        even. A quarter turn of a square board moves (i, j) to (j, rows - i) or (rows - j, i): the same if
        rows is even, that is, with an odd number of squares along each side.
        """
        if turn.quarters in {1, 3}:
            return self.rows % 2 == 0
        return turn.quarters == 0 or (self.rows + self.columns) % 2 == 0
