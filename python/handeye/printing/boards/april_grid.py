"""The grid of AprilTags, as Kalibr prints it: with a border of two bits also its squares between the tags."""

import numpy as np

from handeye.pattern import marker_bits
from handeye.printing.boards.base import Board, Ink, Measures, default, mm
from handeye.printing.outline import outline
from handeye.printing.shapes import Area, rectangle
from handeye.types import AprilGrid
from handeye.types.arrays import FloatArray


def ink(target: AprilGrid) -> Ink:
    """Draw the tags; tag 0 is at the lower left and the origin is its lower left corner."""
    side, gap = target.tag_m * 1000, target.tag_m * target.spacing_ratio * 1000
    # OpenCV draws these tags on their head.
    tags = marker_bits(target.dictionary, target.rows * target.columns, target.border_bits)[:, ::-1, ::-1]
    loops: list[FloatArray] = []
    for tag, pattern in enumerate(tags):
        row, column = divmod(tag, target.columns)
        corner = np.array([column * (side + gap), -row * (side + gap) - side])
        loops += [corner + loop * (side / len(pattern)) for loop in outline(pattern)]
    points = target.points[:, :2] * 1000
    low, high = points.min(axis=0), points.max(axis=0)
    if target.border_bits == 2 and target.spacing_ratio < 1:
        for row in range(target.rows + 1):
            for column in range(target.columns + 1):
                loops.append(rectangle(column * (side + gap) - gap, -row * (side + gap), gap, gap))
        low, high = low - gap, high + gap
    return Ink((Area(tuple(loops)),), low, high, max(gap, side / tags.shape[1]) / 2)


def caption(target: AprilGrid) -> str:
    """Describe the grid."""
    bits = "one bit" if target.border_bits == 1 else "two bits"
    return (
        f"AprilGrid, {target.rows} rows x {target.columns} columns of tags, side {mm(target.tag_m)}, spacing "
        f"{target.spacing_ratio:g} of it, {target.dictionary}, border of {bits}"
    )


def usual(scale_m: float, asked: Measures) -> AprilGrid:
    """Make a grid as Kalibr prints it."""
    return AprilGrid(
        default(asked.rows, 6),
        default(asked.columns, 6),
        scale_m,
        default(asked.spacing_ratio, 0.3),
        default(asked.dictionary, "DICT_APRILTAG_36h11"),
        default(asked.border_bits, 2),
    )


BOARD = Board(AprilGrid.family, ink, caption, usual)
