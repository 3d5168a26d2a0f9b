"""The chessboard: dark at the upper left, as OpenCV draws it."""

import numpy as np

from handeye.printing.boards.base import Board, Ink, Measures, default, mm
from handeye.printing.outline import outline
from handeye.printing.shapes import Area
from handeye.types import Chessboard


def ink(target: Chessboard) -> Ink:
    """Draw the squares; the first inner corner is at the lower right corner of the first square."""
    rows, columns = target.rows + 1, target.columns + 1
    side = target.pitch_m * 1000
    dark = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0
    loops = tuple((loop - 1) * side for loop in outline(dark))
    return Ink((Area(loops),), np.full(2, -side), np.array([columns - 1, rows - 1]) * side, side / 4)


def caption(target: Chessboard) -> str:
    """Describe the board."""
    return (
        f"Chessboard, {target.rows} x {target.columns} inner corners "
        f"({target.rows + 1} x {target.columns + 1} squares), side of a square {mm(target.pitch_m)}"
    )


def usual(scale_m: float, asked: Measures) -> Chessboard:
    """Make a board; its rows and columns are an even and an odd number, so that it has no symmetry."""
    return Chessboard(default(asked.rows, 7), default(asked.columns, 10), scale_m)


BOARD = Board(Chessboard.family, ink, caption, usual)
