"""The ChArUco board: a chessboard with markers in its light squares, numbered row by row."""

import numpy as np

from handeye.pattern import marker_bits
from handeye.printing.boards.base import Board, Ink, Measures, default, mm
from handeye.printing.outline import outline
from handeye.printing.shapes import Area
from handeye.types import Charuco

MARKER_SHARE = 0.75


def ink(target: Charuco) -> Ink:
    """Draw squares and markers; the origin is the first inner corner, one square in from the upper left."""
    side, marker = target.square_m * 1000, target.marker_m * 1000
    light_first = target.legacy_pattern and target.rows % 2 == 0
    parity = np.add.outer(np.arange(target.rows), np.arange(target.columns)) % 2
    dark = parity == (1 if light_first else 0)
    loops = [(loop - 1) * side for loop in outline(dark)]
    light = np.argwhere(~dark)
    bits = marker_bits(target.dictionary, len(light), 1)
    inset = (side - marker) / 2
    for (row, column), pattern in zip(light.tolist(), bits, strict=True):
        corner = np.array([(column - 1) * side + inset, (row - 1) * side + inset])
        loops += [corner + loop * (marker / len(pattern)) for loop in outline(pattern)]
    high = np.array([target.columns - 1, target.rows - 1]) * side
    return Ink((Area(tuple(loops)),), np.full(2, -side), high, side / 4)


def caption(target: Charuco) -> str:
    """Describe the board."""
    legacy = ", layout of OpenCV before 4.6" if target.legacy_pattern else ""
    return (
        f"ChArUco board, {target.rows} rows x {target.columns} columns of squares, side "
        f"{mm(target.square_m)}, markers {mm(target.marker_m)} of {target.dictionary}{legacy}"
    )


def usual(scale_m: float, asked: Measures) -> Charuco:
    """Make a board of the present layout."""
    return Charuco(
        default(asked.rows, 7),
        default(asked.columns, 10),
        scale_m,
        default(asked.marker_m, round(MARKER_SHARE * scale_m, 9)),
        default(asked.dictionary, "DICT_5X5_100"),
    )


BOARD = Board(Charuco.family, ink, caption, usual)
