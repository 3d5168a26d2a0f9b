"""Corners of a chessboard on the lines of a mesh: which neighbours which, and which are none.

A corner's own edges say where its neighbours lie and, as dark and light change places from corner to corner,
how they look. Those that take each other for neighbours, with one side of the edge between them dark and the
other light, are joined; numbering them from one to the next needs neither perspective nor lens. Then the mesh
is grown where a corner should be and one can be measured, and whatever does not look like a crossing of four
squares is dropped: a board's rim before a dark ground is none.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.detection.base import Image
from handeye.detection.beyond import LEAST_CORRELATION, correlation
from handeye.detection.corner_fit import CornerKind, fit_corners
from handeye.detection.saddles import Saddles, sampled
from handeye.types.arrays import FloatArray, IndexArray

# How far the direction of a neighbour may be off.
OFF_RAD = 0.3
# Least difference between both sides of the edge from corner to corner, as a share of the corners' contrast.
EDGE_SHARE = 0.25
# Fewer corners are no mesh; so many of the largest meshes are looked at.
FEWEST, MOST_TRIED = 4, 8
# Window of a corner in steps to its neighbours, and samples along its side.
REACH, SAMPLES = 0.42, 12
# Least difference of the darkest light quarter and the lightest dark one, as a share of that of their means.
QUARTERS_SHARE = 0.1
# A line of the mesh's rim with fewer of its corners is not one of the board.
LEAST_LINE_SHARE = 0.5
MOST_ROUNDS = 40


@dataclass(frozen=True, eq=False)
class Mesh:
    """Corners by row and column.

    Attributes
    ----------
    places
        (R, C, 2) pixels, NaN where there is no corner. Rows and columns turn as u and v do.
    """

    places: FloatArray

    @property
    def there(self) -> NDArray[np.bool_]:
        """(R, C) where there are corners."""
        return np.isfinite(self.places[..., 0])


def meshes(picture: Image, saddles: Saddles, core: int) -> list[Mesh]:
    """Return the meshes of a picture, largest first, that begin with at least so many corners."""
    found: list[Mesh] = []
    for numbers, cells in _joined(_neighbours(picture, saddles))[:MOST_TRIED]:
        if len(numbers) < core:
            break
        mesh = _grown(picture, _laid(saddles.places[numbers], cells))
        if mesh is not None:
            found.append(mesh)
    return sorted(found, key=lambda mesh: -int(mesh.there.sum()))


def _neighbours(picture: Image, saddles: Saddles) -> IndexArray:
    """Return the neighbour (N, 4) of each crossing along its edges, counted from u towards v; -1 for none."""
    kept = _core.crossing_neighbours(saddles.places, saddles.angles, OFF_RAD)
    start, ray = np.nonzero(kept >= 0)
    is_edge = _is_edge(picture, saddles, start, ray, kept[start, ray])
    kept[start[~is_edge], ray[~is_edge]] = -1
    return kept


def _is_edge(
    picture: Image, saddles: Saddles, start: IndexArray, ray: IndexArray, end: IndexArray
) -> NDArray[np.bool_]:
    """Tell which lines (M,) between crossings are dark on one side and light on the other, all along."""
    a, b = saddles.places[start], saddles.places[end]
    step = b - a
    across = np.column_stack([-step[:, 1], step[:, 0]])
    along = np.array([0.25, 0.4, 0.6, 0.75])
    middle = a[:, np.newaxis] + along[:, np.newaxis] * step[:, np.newaxis]
    aside = 0.16 * across[:, np.newaxis]
    # From u towards v beside the first edge it is dark, beside the second light.
    sign = np.where(ray % 2 == 0, 1.0, -1.0)[:, np.newaxis]
    difference = sign * (sampled(picture, middle - aside) - sampled(picture, middle + aside))
    contrast = np.minimum(saddles.contrasts[start], saddles.contrasts[end])
    return np.asarray(difference.min(axis=1) >= EDGE_SHARE * contrast, dtype=np.bool_)


def _joined(neighbours: IndexArray) -> list[tuple[IndexArray, IndexArray]]:
    """Return numbers (M,), and columns and rows (M, 2), of the crossings of each mesh, largest first."""
    linked = neighbours.tolist()
    steps = ((1, 0), (0, 1), (-1, 0), (0, -1))
    found: list[tuple[IndexArray, IndexArray]] = []
    seen = [False] * len(linked)
    for first in range(len(linked)):
        if seen[first] or max(linked[first]) < 0:
            continue
        seen[first] = True
        cell_of: dict[int, tuple[int, int]] = {first: (0, 0)}
        turn_of = {first: 0}
        taken = {(0, 0)}
        waiting = deque([first])
        while waiting:
            here = waiting.popleft()
            (x, y), turn = cell_of[here], turn_of[here]
            for ray, there in enumerate(linked[here]):
                if there < 0 or seen[there] or here not in linked[there]:
                    continue
                dx, dy = steps[(ray + turn) % 4]
                cell = (x + dx, y + dy)
                if cell in taken:
                    continue
                seen[there] = True
                taken.add(cell)
                cell_of[there] = cell
                turn_of[there] = (ray + turn + 2 - linked[there].index(here)) % 4
                waiting.append(there)
        found.append((np.array(list(cell_of)), np.array(list(cell_of.values()))))
    return sorted(found, key=lambda part: -len(part[0]))


def _laid(places: FloatArray, cells: IndexArray) -> FloatArray:
    """Return a grid (R, C, 2) of places with those columns and rows, NaN elsewhere."""
    cells = cells - cells.min(axis=0)
    grid = np.full((*(cells.max(axis=0)[::-1] + 1), 2), np.nan)
    grid[cells[:, 1], cells[:, 0]] = places
    return grid


def _grown(picture: Image, grid: FloatArray) -> Mesh | None:
    """Return the mesh after corners were added that should be there and are, and others dropped."""
    refused: set[tuple[int, int]] = set()
    shift = np.zeros(2, dtype=np.int64)
    grid = _only(grid, looks_like_corners(picture, grid))
    for _ in range(MOST_ROUNDS):
        if np.isfinite(grid[..., 0]).sum() < FEWEST:
            return None
        grid = np.pad(grid, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
        shift -= 1
        expected, steps = _expected(grid)
        open_cells = np.isnan(grid[..., 0]) & np.isfinite(expected[..., 0])
        cells = [cell for cell in np.argwhere(open_cells) if tuple(cell + shift) not in refused]
        if not cells:
            break
        rows, columns = np.array(cells).T
        found = _measured(picture, expected[rows, columns], steps[rows, columns])
        before = np.isfinite(grid[..., 0])
        grid[rows, columns] = found
        good = looks_like_corners(picture, grid)
        grid = _only(grid, good | before)
        refused |= {tuple(cell + shift) for cell in cells if not good[tuple(cell)]}
        if not good[rows, columns].any():
            break
        filled = np.isfinite(grid[..., 0])
        (top, left), _ = _bounds(filled)
        shift += (top, left)
        grid = _cut(grid)
    grid = _trimmed(_only(grid, looks_like_corners(picture, grid)))
    return Mesh(grid) if np.isfinite(grid[..., 0]).sum() >= FEWEST else None


def _only(grid: FloatArray, good: NDArray[np.bool_]) -> FloatArray:
    return np.where(good[..., np.newaxis], grid, np.nan)


def _bounds(there: NDArray[np.bool_]) -> tuple[IndexArray, IndexArray]:
    cells = np.argwhere(there)
    return cells.min(axis=0), cells.max(axis=0) + 1


def _cut(grid: FloatArray) -> FloatArray:
    (top, left), (bottom, right) = _bounds(np.isfinite(grid[..., 0]))
    return grid[top:bottom, left:right]


def _trimmed(grid: FloatArray) -> FloatArray:
    """Return a grid without lines at its rim that are hardly there."""
    while np.isfinite(grid[..., 0]).any():
        grid = _cut(grid)
        there = np.isfinite(grid[..., 0])
        shares = [there[0].mean(), there[-1].mean(), there[:, 0].mean(), there[:, -1].mean()]
        worst = int(np.argmin(shares))
        if shares[worst] >= LEAST_LINE_SHARE:
            break
        grid = [grid[1:], grid[:-1], grid[:, 1:], grid[:, :-1]][worst]
    return grid


def _steps_along(grid: FloatArray) -> FloatArray:
    """Return the step (R, C, 2) from column to column at each corner, NaN where no neighbour tells."""
    difference = np.diff(grid, axis=1)
    gap = np.full((len(grid), 1, 2), np.nan)
    both = np.stack([np.concatenate([gap, difference], axis=1), np.concatenate([difference, gap], axis=1)])
    there = np.isfinite(both)
    return np.where(there, both, 0).sum(axis=0) / np.where(there.any(axis=0), there.sum(axis=0), np.nan)


def steps(grid: FloatArray) -> FloatArray:
    """Return the steps (R, C, 2, 2) from column to column and from row to row at the corners of a grid."""
    found = np.stack([_steps_along(grid), _steps_along(grid.swapaxes(0, 1)).swapaxes(0, 1)], axis=2)
    for _ in range(2):
        # Where a corner has no neighbour along one axis, those beside it have.
        missing = np.isnan(found).any(axis=(2, 3))
        if not missing.any():
            break
        found = np.where(np.isnan(found), _mean_of_neighbours(found), found)
    return found


def _mean_of_neighbours(values: FloatArray) -> FloatArray:
    """Return the mean of the neighbours' values (R, C, ...), NaN where there are none."""
    padded = np.pad(values, ((1, 1), (1, 1), *[(0, 0)] * (values.ndim - 2)), constant_values=np.nan)
    around = np.stack([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]])
    there = np.isfinite(around)
    return np.where(there, around, 0).sum(axis=0) / np.where(there.any(axis=0), there.sum(axis=0), np.nan)


def _expected(grid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where each cell's corner (R, C, 2) should be, as its neighbours tell, and the steps there."""
    around = steps(grid)
    guesses: list[FloatArray] = []
    weights: list[FloatArray] = []
    for axis in (0, 1):
        for sign in (-1, 1):
            nearest, second = _shifted(grid, axis, sign), _shifted(grid, axis, 2 * sign)
            third = _shifted(grid, axis, 3 * sign)
            # Straight on from two corners, along the bend of three, else by the step of the one beside it.
            by_three = 3 * nearest - 3 * second + third
            by_two = 2 * nearest - second
            step = _shifted(around[:, :, 1 - axis], axis, sign)
            by_one = nearest - sign * step
            guess = np.where(np.isfinite(by_two), by_two, by_one)
            weight = np.where(np.isfinite(by_two[..., 0]), 2.0, 1.0)
            bent = np.isfinite(by_three[..., 0])
            guess = np.where(bent[..., np.newaxis], (by_three + by_two) / 2, guess)
            guesses.append(guess)
            weights.append(np.where(np.isfinite(guess[..., 0]), weight + bent, 0.0))
    stacked, weight = np.stack(guesses), np.stack(weights)[..., np.newaxis]
    total = weight.sum(axis=0)
    place = np.where(weight > 0, stacked, 0) * weight
    expected = place.sum(axis=0) / np.where(total > 0, total, np.nan)
    near = np.where(np.isnan(around), _mean_of_neighbours(around), around)
    expected[np.isnan(near).any(axis=(2, 3))] = np.nan
    return expected, near


def filled(grid: FloatArray) -> FloatArray:
    """Return a grid (R, C, 2) with places where there were none, as their neighbours tell."""
    grid = grid.copy()
    for _ in range(sum(grid.shape[:2])):
        missing = np.isnan(grid[..., 0])
        if not missing.any():
            break
        grid[missing] = _expected(grid)[0][missing]
    return grid


def beside(mesh: Mesh) -> FloatArray:
    """Return the places (N, 2) of the lines of corners next to a mesh, were it larger."""
    grid = np.pad(mesh.places, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    found = _expected(grid)[0]
    found[1:-1, 1:-1] = np.nan
    return found[np.isfinite(found[..., 0])]


def _shifted(values: FloatArray, axis: int, by: int) -> FloatArray:
    """Return the values (R, C, ...) of the cells so many further along an axis, NaN beyond the grid."""
    out = np.full_like(values, np.nan)
    size = values.shape[axis]
    if abs(by) >= size:
        return out
    to = slice(0, size - by) if by > 0 else slice(-by, size)
    source = slice(by, size) if by > 0 else slice(0, size + by)
    if axis == 0:
        out[to] = values[source]
    else:
        out[:, to] = values[:, source]
    return out


def _measured(picture: Image, expected: FloatArray, around: FloatArray) -> FloatArray:
    """Return corners (M, 2) measured where they are expected, NaN where there are none."""
    lengths = np.linalg.norm(around, axis=2)
    directions = around / lengths[..., np.newaxis]
    heights = lengths.min(axis=1) * np.abs(np.linalg.det(directions))
    radii = 0.7 * heights
    found = fit_corners(picture, expected, directions, radii, CornerKind.CROSSING, rough=True)
    astray = np.linalg.norm(found - expected, axis=1) > 0.25 * lengths.min(axis=1)
    found[astray] = np.nan
    return found


def looks_like_corners(picture: Image, grid: FloatArray) -> NDArray[np.bool_]:
    """Tell where in a grid (R, C, 2) of places four squares meet, two dark and two light."""
    around = steps(grid)
    usable = np.isfinite(grid[..., 0]) & np.isfinite(around).all(axis=(2, 3))
    sign = np.zeros(usable.shape)
    if not usable.any():
        return usable
    sign[usable] = _crossing_signs(picture, grid[usable], around[usable])
    # Dark and light change places from corner to corner: the odd ones out are none.
    sign *= np.where(np.add.outer(*map(np.arange, usable.shape)) % 2 == 0, 1.0, -1.0)
    return np.asarray(sign * (np.sign(sign.sum()) or 1.0) > 0, dtype=np.bool_)


def _crossing_signs(picture: Image, places: FloatArray, around: FloatArray) -> FloatArray:
    """Return for places (N, 2) with steps (N, 2, 2) to their neighbours whether four squares meet there.

    1 where the first quarter, towards the neighbours further on, is light, -1 where it is dark, and 0 where
    it is no corner.
    """
    offsets = (np.arange(SAMPLES) + 0.5) / SAMPLES * 2 * REACH - REACH
    window = np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
    seen = sampled(picture, places[:, np.newaxis] + window @ around).reshape(-1, SAMPLES, SAMPLES)
    match = correlation(seen, np.sign(np.multiply.outer(offsets, offsets)))
    half = SAMPLES // 2
    quarters = seen.reshape(-1, 2, half, 2, half).mean(axis=(2, 4))
    sign = np.where(match < 0, -1.0, 1.0)
    same, other = (
        sign[:, np.newaxis] * quarters[:, [0, 1], [0, 1]],
        sign[:, np.newaxis] * quarters[:, [0, 1], [1, 0]],
    )
    apart = same.min(axis=1) - other.max(axis=1)
    whole = same.mean(axis=1) - other.mean(axis=1)
    return np.where((np.abs(match) >= LEAST_CORRELATION) & (apart >= QUARTERS_SHARE * whole), sign, 0.0)
