"""Whether a grid goes on beside the one that is asked for."""

from functools import lru_cache

import numpy as np

from handeye.detection.registration import Aligned
from handeye.types import Chessboard, CircleGrid
from handeye.types.arrays import FloatArray

# Samples along a side of the window around a place, and half that side in distances of neighbours.
SAMPLES, REACH = 11, 0.45
# Least correlation of a place beside the grid with a point of it. At the rim of a chessboard the outer
# squares make 0.58.
LEAST_CORRELATION = 0.75
# Of the shorter side, beside the grid; a few may be anything.
SHARE, FEWEST = 0.5, 2


@lru_cache(maxsize=16)
def _beside(target: Chessboard | CircleGrid) -> tuple[FloatArray, FloatArray]:
    """Return places (N, H, W, 2) around points that would be beside the grid, and how one looks (H, W)."""
    rows, columns = np.meshgrid(
        np.arange(-1, target.rows + 1), np.arange(-1, target.columns + 1), indexing="ij"
    )
    outside = (rows < 0) | (rows >= target.rows) | (columns < 0) | (columns >= target.columns)
    x, y = columns[outside], rows[outside]
    offsets = np.stack(np.meshgrid(*[np.linspace(-REACH, REACH, SAMPLES)] * 2), axis=-1)
    if isinstance(target, Chessboard):
        point = np.sign(offsets).prod(axis=-1)
    else:
        if target.asymmetric:
            x = 2 * x + y % 2
            offsets = offsets * np.sqrt(2.0)
        point = (np.linalg.norm(offsets, axis=-1) * target.pitch_m > target.radius_m).astype(np.float64)
    return (np.column_stack([x, y])[:, np.newaxis, np.newaxis] + offsets) * target.pitch_m, point


def goes_on(target: Chessboard | CircleGrid, board: Aligned) -> bool:
    """Tell whether there are points beside the grid, so that it is larger or lies elsewhere."""
    places, point = _beside(target)
    found = correlation(board.seen(places), point)
    if isinstance(target, Chessboard):
        found = np.abs(found)
    return int((found > LEAST_CORRELATION).sum()) >= max(FEWEST, SHARE * min(target.rows, target.columns))


def correlation(seen: FloatArray, drawn: FloatArray) -> FloatArray:
    """Return the correlation (N,) of windows (N, H, W) with what is drawn, (H, W) or (N, H, W)."""
    a = seen - seen.mean(axis=(-2, -1), keepdims=True)
    b = drawn - drawn.mean(axis=(-2, -1), keepdims=True)
    size = np.vecdot(_rows(a), _rows(a)) * np.vecdot(_rows(b), _rows(b))
    return np.asarray(np.vecdot(_rows(a), _rows(b)) / np.sqrt(np.maximum(size, 1e-9)), dtype=np.float64)


def _rows(windows: FloatArray) -> FloatArray:
    return windows.reshape(*windows.shape[:-2], -1)
