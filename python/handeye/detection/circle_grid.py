"""Circles of a grid, dark on light or light on dark, with or without a larger one.

Spots are found at several grey levels, joined to a lattice, and the grid is laid on the lattice; then the
area centroid of each circle is measured from grey values. The solver predicts area centroids, too.
"""

import numpy as np

from handeye.detection.base import NOT_HERE, Detection, Image, NotFound, Reason, ordered
from handeye.detection.blobs import Spots, areas, find_spots
from handeye.detection.centroid import area_centroids
from handeye.detection.diagnosis import diagnose
from handeye.detection.lattice import Placement, grow, placements
from handeye.detection.part import Part
from handeye.types import CircleGrid
from handeye.types.arrays import FloatArray, IndexArray

SEARCH_SIDE_PX = 2000
# The marked circle is at least this much larger than those around it, by area.
MARKED_RATIO = 1.3
# A line beside the grid that is filled so far says that the board is larger.
LARGER_SHARE = 0.7
# Circles may be hidden or cut, but so many must be there, and so many of each outermost line: else the grid
# might be laid one line off.
LEAST_SHARE = 0.8
LEAST_LINE_SHARE = 0.6


def find(image: Image, target: CircleGrid, part: Part | None = None) -> Detection | NotFound:
    """Find the circles of a grid; a few that are hidden or cut by the image's edge are left out.

    With a part of the image, by one quick attempt there.
    """
    grid = _places(target)
    seen = 0
    parts = (Part.whole(image, scale) for scale in _scales(image)) if part is None else [part]
    for here in parts:
        placed, spots = _best(here.picture, grid)
        placed = [p for p in placed if p.found == placed[0].found]
        seen = placed[0].found if placed else 0
        if placed and _is_certain(target, placed[0]):
            full = Spots(here.places(spots.centres), here.shapes(spots.centres, spots.shapes))
            return _measured(image, target, full, placed)
    if part is not None:
        return NOT_HERE
    if seen > 0.5 * target.point_count:
        return NotFound(Reason.INCOMPLETE, f"{seen} of {target.point_count} circles found")
    return diagnose(
        image, NotFound(Reason.NO_PATTERN, f"no grid of {target.columns} x {target.rows} circles")
    )


def _scales(image: Image) -> list[float]:
    longest = max(image.shape)
    return [1.0] if longest <= SEARCH_SIDE_PX else [SEARCH_SIDE_PX / longest, 1.0]


def _places(target: CircleGrid) -> IndexArray:
    """Return the places (P, 2) of the circles on a lattice of squares.

    An asymmetric grid is one whose axes run diagonally, to the lower right and to the lower left.
    """
    row, column = np.divmod(np.arange(target.point_count), target.columns)
    if not target.asymmetric:
        return np.column_stack([column, row])
    x = 2 * column + row % 2
    places = np.column_stack([(x + row) // 2, (row - x) // 2])
    return places - places.min(axis=0)


def _best(image: Image, grid: IndexArray) -> tuple[list[Placement], Spots]:
    """Return the placements of the grid among the dark or the light spots, whichever it fits better."""
    best: tuple[list[Placement], Spots] = ([], Spots(np.zeros((0, 2)), np.zeros((0, 2, 2))))
    for spots in find_spots(image):
        lattice = grow(spots, len(grid))
        if len(lattice) < 4:
            continue
        placed = placements(lattice, grid)
        if not best[0] or placed[0].found > best[0][0].found:
            best = placed, spots
    return best


def _is_certain(target: CircleGrid, placement: Placement) -> bool:
    """Tell whether so many circles are there that the grid cannot lie one line further."""
    there = placement.spots >= 0
    x, y = target.points[:, 0], target.points[:, 1]
    near = target.pitch_m / 2
    lines = (x < x.min() + near, x > x.max() - near, y < y.min() + near, y > y.max() - near)
    return bool(there.mean() >= LEAST_SHARE and all(there[line].mean() >= LEAST_LINE_SHARE for line in lines))


def _measured(
    image: Image, target: CircleGrid, spots: Spots, placed: list[Placement]
) -> Detection | NotFound:
    """Measure the circles of a grid and say which is which; all placements use the same spots."""
    if min(p.beside for p in placed) >= max(3, LARGER_SHARE * min(target.rows, target.columns)):
        return NotFound(
            Reason.WRONG_SIZE,
            f"a grid of {target.columns} x {target.rows} circles is visible, but it goes on beside them",
        )
    used = placed[0].spots[placed[0].spots >= 0]
    pixels = np.full((len(spots), 2), np.nan)
    shapes = spots.shapes.copy()
    circles = spots.take(used)
    measured = area_centroids(image, circles, _gaps(circles))
    pixels[used] = measured.centres
    good = np.isfinite(pixels[:, 0])
    shapes[used] = np.where(good[used, np.newaxis, np.newaxis], measured.shapes, circles.shapes)
    if good[used].sum() < LEAST_SHARE * target.point_count:
        return NotFound(Reason.LOW_CONTRAST, f"only {good[used].sum()} circles have enough contrast")
    chosen = placed[0].spots
    if target.marked is not None:
        sizes = [_marked_ratio(target, p.spots, shapes) for p in placed]
        chosen = placed[int(np.argmax(sizes))].spots
        if max(sizes) < MARKED_RATIO:
            return NotFound(
                Reason.INCONSISTENT, "no circle where the marked one may be is larger than the others"
            )
    ids = np.flatnonzero((chosen >= 0) & good[chosen])
    return ordered(target, ids, pixels[chosen[ids]])


def _marked_ratio(target: CircleGrid, chosen: IndexArray, shapes: FloatArray) -> float:
    """Return the area of the circle that would be the marked one over that of the circles around it."""
    assert target.marked is not None  # noqa: S101 - asked only then
    if chosen[target.marked] < 0:
        return 0.0
    away = np.linalg.norm(target.points - target.points[target.marked], axis=1)
    around = chosen[np.argsort(away)[1:6]]
    return float(areas(shapes[[chosen[target.marked]]])[0] / np.median(areas(shapes[around[around >= 0]])))


def _gaps(circles: Spots) -> FloatArray:
    """Return the narrowest free distance (N,) of each circle to another one."""
    offset = circles.centres[np.newaxis] - circles.centres[:, np.newaxis]
    distance = np.linalg.norm(offset, axis=2)
    np.fill_diagonal(distance, np.inf)
    nearest = np.argsort(distance, axis=1)[:, :4]
    inverse = np.linalg.inv(circles.shapes)
    gaps = np.full(len(circles), np.inf)
    for other in nearest.T:
        index = np.arange(len(circles))
        d = distance[index, other]
        u = offset[index, other] / d[:, np.newaxis]
        own = 1 / np.sqrt(np.einsum("na,nab,nb->n", u, inverse, u))
        its = 1 / np.sqrt(np.einsum("na,nab,nb->n", u, inverse[other], u))
        gaps = np.minimum(gaps, d - own - its)
    return np.maximum(gaps, 1.0)
