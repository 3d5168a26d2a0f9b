"""How well each point was measured: a standard deviation from its own picture and from how all of them lie.

What a point's picture tells (blur, contrast, how obliquely edges cross, how well the fit went) says how good
it is beside the others; how far all of them are off a flat board seen through a lens says how good they are.
The fewer the points, the more what is usual counts.
"""

from dataclasses import dataclass
from math import lgamma

import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import Detection, Image, ordered
from handeye.detection.bent_board import BentBoard
from handeye.types import Target
from handeye.types.arrays import FloatArray, IndexArray

# Variances that corners' own pictures tell are usually right to this factor, up or down. What fewer
# measurements tell is spread without bounds.
USUAL_FACTOR, LEAST_COUNT = 2.0, 3.0
# No point is better.
LEAST_PX = 0.001
# Squared distances over variances of both coordinates that one point in ten thousand exceeds: it lies astray.
# Where fewer coordinates are free than this, nothing tells such points from the others.
ASTRAY, FEWEST_FREE = 18.4, 30
# Points are left out so many times at most; those that are free to less than this share tell nothing of it.
# Of those that fitted so far only such as are nearly as far off as the worst are left out in one round.
ROUNDS, LEAST_FREE, WORST_SHARE = 6, 1e-3, 0.5


@dataclass(frozen=True, eq=False)
class Scatter:
    """How points lie about the view of a flat board that most of them fit best.

    Attributes
    ----------
    factor, freedom
        Mean square over the variances that were expected, and how many coordinates it is of.
    kept
        (N,) which points fit.
    held
        (N,) share of each point's own error that the view follows.
    squares
        (N,) squared distances in px^2 of the points from the view.
    shares
        (K, C) of each column of the board how much is in the view.
    solving
        (K, R) by which the rows of the points, over the deviations that were expected, tell those shares.
    """

    factor: float
    freedom: int
    kept: NDArray[np.bool_]
    held: FloatArray
    squares: FloatArray
    shares: FloatArray
    solving: FloatArray


def scatter(board: BentBoard, sigmas: FloatArray) -> Scatter | None:
    """Return how points with relative deviations (N,) lie; None where nothing is left free."""
    best, kept = None, np.ones(len(sigmas), dtype=np.bool_)
    for _ in range(ROUNDS):
        found = _about(board, sigmas, kept)
        if found is None:
            return best
        best, fits = found
        left_free = best.freedom - 2 * int(kept.sum()) + 2 * int(fits.sum())
        if min(best.freedom, left_free) < FEWEST_FREE or (fits == kept).all():
            return best
        kept = fits
    return best


def _about(
    board: BentBoard, sigmas: FloatArray, kept: NDArray[np.bool_]
) -> tuple[Scatter, NDArray[np.bool_]] | None:
    """Return how points lie about the view that those kept (N,) fit best, and which points fit it."""
    each = len(board.columns) // len(sigmas)
    weights, rows = np.repeat(1 / sigmas, each)[:, np.newaxis], np.repeat(kept, each)
    columns, off = weights * board.columns, weights * board.rows(board.off)
    left, sizes, right = np.linalg.svd(columns[rows], full_matrices=False)
    told = np.asarray(sizes > 1e-12 * sizes[0], dtype=np.bool_)
    solving = np.asarray(right[told].T / sizes[told], dtype=np.float64)
    shares = np.asarray(solving @ (left[:, told].T @ off[rows]), dtype=np.float64)
    # The view follows the points that it was fitted to, as far as they hold it alone.
    held = board.points(np.vecdot(columns @ solving, columns @ solving)).mean(axis=1)
    signs = np.where(kept, -1.0, 1.0)
    free = np.maximum(1 + signs * held, LEAST_FREE)
    squares = (board.points(off - columns @ shares) ** 2).sum(axis=1)
    freedom = 2 * int(kept.sum()) - int(told.sum()) * off.shape[1]
    if freedom <= 0:
        return None
    factor = float(squares[kept].sum()) / freedom
    # The median of squared distances in two dimensions is so many of their variances.
    usual = float(np.median(squares[kept] / free[kept])) / (2 * np.log(2))
    every = np.zeros((len(solving), len(rows)))
    every[:, rows] = solving @ left[:, told].T
    excess = squares / np.maximum(ASTRAY * usual * free, 1e-30)
    found = Scatter(factor, freedom, kept, held, squares * sigmas**2, shares, every)
    # The worst first: it drags those around it.
    return found, excess <= np.where(kept, max(1.0, WORST_SHARE * float(excess[kept].max())), 1.0)


def _scale(found: Scatter, usual_factor: float) -> FloatArray:
    """Return by what (N,) to multiply variances, so that squared errors over them are one on average.

    What is usual and what was found are weighed by how well each is known, their logarithms. A mean square of
    few is spread; an error goes along with it as far as it is left over itself.
    """
    count = max(found.freedom + 2 / np.log(usual_factor) ** 2, LEAST_COUNT)
    share, half = found.freedom / count, found.freedom / 2
    # The mean of a power of a mean square of independent normal errors.
    spread = half**share * np.exp(lgamma(half - share) - lgamma(half))
    left = 1 - found.held.clip(None, 1.0)
    return np.asarray(found.factor**share * spread * (1 - 2 * left / count), dtype=np.float64)


def stated(
    image: Image,
    target: Target,
    point_ids: IndexArray,
    pixels: FloatArray,
    sigmas_px: FloatArray,
    shared_px: FloatArray | float = 0.0,
    usual_factor: float = USUAL_FACTOR,
) -> Detection:
    """Return points (N, 2) as a detection whose standard deviations fit how they lie on the board.

    Up to then those (N,) may be wrong by a factor, the same for all points; usually no further than one of
    their squares. Deviations that all points share, so that they do not show, are added.
    """
    plane, radii = target.points[point_ids, :2], target.radii_m[point_ids]
    board = BentBoard.of(plane, radii, pixels, (image.shape[1], image.shape[0]))
    variances = sigmas_px**2
    found = None if board is None else scatter(board, sigmas_px)
    if found is not None:
        variances = variances * _scale(found, usual_factor)
        # A point that lies astray was measured worse than its picture tells.
        variances = np.where(found.kept, variances, np.maximum(variances, found.squares / 2))
    sigmas = np.maximum(np.sqrt(variances), LEAST_PX)
    return ordered(target, point_ids, pixels, np.hypot(sigmas, shared_px))
