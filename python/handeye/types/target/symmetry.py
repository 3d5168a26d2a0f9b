"""Turns of a flat board about its centre that bring its points onto its points.

A permutation `p` of the points stands for a turn: the turned point i lies where point p[i] lay,

    points[p] = R (points - centre) + centre.

From the points alone one cannot tell the board from the turned board: a detection that says point i
may as well mean point p[i]. Only turns matter, not reflections: a board is seen from its front.
"""

from dataclasses import dataclass

import numpy as np

from handeye.types.arrays import FloatArray, IndexArray


@dataclass(frozen=True)
class Turn:
    """A turn of the board about its centre that brings points onto points.

    Attributes
    ----------
    quarters
        Quarter turns, 0 to 3, from the x axis towards the y axis of the target.
    permutation
        (P,) the turned point i lies on point `permutation[i]`.
    """

    quarters: int
    permutation: IndexArray


def turns_onto_itself(points: FloatArray) -> tuple[Turn, ...]:
    """Return the turns by multiples of 90 deg that bring flat points (P, 3) onto themselves, identity first.

    A lattice of squares has no others.
    """
    flat = points[:, :2] - points[:, :2].mean(axis=0)
    # Whole numbers to compare: a millionth of the extent, far below any pitch and far above rounding.
    step = float(np.abs(flat).max()) * 1e-6
    order_here = _sorted_order(flat, step)
    here = np.rint(flat[order_here] / step)
    turns: list[Turn] = []
    turned = flat
    for quarters in range(4):
        order_turned = _sorted_order(turned, step)
        if np.abs(np.rint(turned[order_turned] / step) - here).max() <= 1:
            permutation = np.empty(len(flat), dtype=np.int64)
            permutation[order_turned] = order_here
            permutation.flags.writeable = False
            turns.append(Turn(quarters, permutation))
        turned = np.column_stack([-turned[:, 1], turned[:, 0]])  # a quarter turn is exact
    return tuple(turns)


def _sorted_order(flat: FloatArray, step: float) -> IndexArray:
    """Return the order by x, then y, blind to rounding."""
    coarse = np.rint(flat / (step * 1e3))
    return np.lexsort((coarse[:, 1], coarse[:, 0]))
