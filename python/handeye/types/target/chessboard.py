"""The chessboard."""

from dataclasses import dataclass
from typing import ClassVar

from handeye.types.arrays import FloatArray, count, positive
from handeye.types.target.base import Target, check_point_count, grid
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
    """

    family: ClassVar[str] = "chessboard"

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
