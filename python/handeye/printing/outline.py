"""The outline of a pattern of square cells.

Cells drawn one by one show hairlines between neighbours on many screens and printers; one outline around all
of them does not.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from handeye.types.arrays import FloatArray

_Corner = tuple[int, int]


def outline(dark: NDArray[np.bool_]) -> list[FloatArray]:
    """Return closed loops (N, 2) of corners (column, row) around the dark cells (H, W).

    Outer loops turn right with y down, holes left. Cells that touch at a corner only are kept apart.
    """
    leaving: dict[_Corner, list[_Corner]] = {}
    for start, end in _edges(dark):
        leaving.setdefault(start, []).append(end)
    loops: list[FloatArray] = []
    while leaving:
        start = next(iter(leaving))
        loops.append(_without_straight_corners(_follow(leaving, start)))
    return loops


def _edges(dark: NDArray[np.bool_]) -> Iterator[tuple[_Corner, _Corner]]:
    """Yield the edges between dark and light, dark on the right."""
    padded = np.pad(dark, 1)
    for row, column in np.argwhere(dark).tolist():
        x, y = column, row
        above, below = padded[row, column + 1], padded[row + 2, column + 1]
        left, right = padded[row + 1, column], padded[row + 1, column + 2]
        if not above:
            yield (x, y), (x + 1, y)
        if not right:
            yield (x + 1, y), (x + 1, y + 1)
        if not below:
            yield (x + 1, y + 1), (x, y + 1)
        if not left:
            yield (x, y + 1), (x, y)


def _follow(leaving: dict[_Corner, list[_Corner]], start: _Corner) -> list[_Corner]:
    """Follow edges from a corner until they close, taking them away; to the right where there is a choice."""
    path = [start]
    before: _Corner | None = None
    here = start
    while True:
        ends = leaving[here]
        there = ends[0] if before is None else _rightmost(path[-2], path[-1], ends)
        ends.remove(there)
        if not ends:
            del leaving[here]
        if there == start:
            return path
        path.append(there)
        before, here = here, there


def _rightmost(before: _Corner, here: _Corner, ends: list[_Corner]) -> _Corner:
    return max(ends, key=lambda end: _turn(before, here, end))


def _turn(before: _Corner, here: _Corner, there: _Corner) -> int:
    """Return 1 for a turn to the right (y down), -1 to the left, 0 straight on."""
    (ax, ay), (bx, by) = (here[0] - before[0], here[1] - before[1]), (there[0] - here[0], there[1] - here[1])
    return ax * by - ay * bx


def _without_straight_corners(path: list[_Corner]) -> FloatArray:
    kept = [
        here
        for before, here, after in zip([path[-1], *path[:-1]], path, [*path[1:], path[0]], strict=True)
        if _turn(before, here, after) != 0
    ]
    return np.array(kept, dtype=np.float64)
