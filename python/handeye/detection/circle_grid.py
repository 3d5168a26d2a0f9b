"""Circles of a grid, dark on light or light on dark, with or without a larger one.

Spots are found at several grey levels, joined to a lattice, and the grid is laid on the lattice; then the
area centroid of each circle is measured from grey values. The solver predicts area centroids, too.
"""

import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.detection.base import Detection, Image, NotFound, Reason
from handeye.detection.beyond import goes_on
from handeye.detection.blobs import Spots, areas, find_spots
from handeye.detection.centroid import area_centroids, gaps, sigmas_px
from handeye.detection.diagnosis import diagnose
from handeye.detection.lattice import Placement, grow, placements
from handeye.detection.markers import from_neighbours
from handeye.detection.part import Part
from handeye.detection.quality import stated
from handeye.detection.registration import LEAST_LIKENESS, Aligned
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
# Circles of a smaller radius are measured twice, if there are enough.
SMALL_PX, FEWEST_TOGETHER = 8.0, 8
# How much larger a marked circle of unknown size is guessed to be.
LARGER = 1.5
# A circle may be off from where those around it put it by this much, or this share of the way to the next;
# one that something covers in part is off by more. Of the circles so many must be measured well.
OFF_PX, OFF_SHARE, LEAST_MEASURED = 0.6, 0.02, 0.6
# Its area may differ by this share from what those of the others tell, or by so many times what is usual.
SIZE_OFF, SIZE_OFF_SPREADS, FEWEST_FOR_SIZES = 0.015, 5.0, 16
# What circles' pictures tell of their variances may be wrong by so much, up or down: it knows no noise.
USUAL_FACTOR = 10.0
# A circle further from where it was expected, as a share of the root of its area, or of another size, is
# something else.
ASTRAY_SHARE, AREA_RATIO = 0.3, 1.5


def find(image: Image, target: CircleGrid) -> Detection | NotFound:
    """Find the circles of a grid; a few that are hidden or cut by the image's edge are left out."""
    grid = _places(target)
    seen = 0
    for here in (Part.whole(image, scale) for scale in _scales(image)):
        placed, spots = _best(here.picture, grid)
        placed = [p for p in placed if p.found == placed[0].found]
        seen = placed[0].found if placed else 0
        if placed and _is_certain(target, placed[0].spots >= 0):
            full = Spots(here.places(spots.centres), here.shapes(spots.centres, spots.shapes))
            return _measured(image, target, full, placed)
    if seen > 0.5 * target.point_count:
        return NotFound(Reason.INCOMPLETE, f"{seen} of {target.point_count} circles found")
    return diagnose(
        image, NotFound(Reason.NO_PATTERN, f"no grid of {target.columns} x {target.rows} circles")
    )


def confirm(image: Image, target: CircleGrid, board: Aligned) -> Detection | None:
    """Return the circles of a grid that was found where it was expected; None unless it is that one."""
    there = board.likeness(target.points[:, :2]) >= LEAST_LIKENESS
    unknown = target.marked if target.marked_diameter_m is None else None
    if unknown is not None:
        there[unknown] = True
    if not _is_certain(target, there) or goes_on(target, board):
        return None
    ids = np.flatnonzero(there)
    expected = _expected(target, board, ids)
    if unknown is not None:
        _measure_first(image, expected, int(np.flatnonzero(ids == unknown)[0]))
    found = _centroids(image, expected, target.points[ids, :2])
    moved = np.linalg.norm(found.centres - expected.centres, axis=1)
    ratio = np.abs(np.log(found.areas / expected.areas))
    good = (moved <= ASTRAY_SHARE * np.sqrt(expected.areas)) & (ratio < np.log(AREA_RATIO))
    there[ids] = good
    if not _is_certain(target, there):
        return None
    good[good] = _fit_others(target, ids[good], found.take(np.flatnonzero(good)))
    if target.marked is not None:
        spots = np.full(target.point_count, -1)
        spots[ids[good]] = np.flatnonzero(good)
        if _marked_ratio(target, spots, found.shapes) < MARKED_RATIO:
            return None
    kept = found.take(np.flatnonzero(good))
    return stated(image, target, ids[good], kept.centres, sigmas_px(image, kept), usual_factor=USUAL_FACTOR)


def _fit_others(target: CircleGrid, ids: IndexArray, circles: Spots) -> NDArray[np.bool_]:
    """Tell which circles (N,) of a target lie where those around put them and are as large as the others."""
    plane, pixels = target.points[ids, :2], circles.centres
    away = np.linalg.norm(pixels[:, np.newaxis] - pixels, axis=2)
    np.fill_diagonal(away, np.inf)
    off = np.linalg.norm(from_neighbours(plane, pixels) - pixels, axis=1)
    fits = np.asarray(off <= np.maximum(OFF_PX, OFF_SHARE * away.min(axis=1)), dtype=np.bool_)
    whole = _core.PlaneMap.fitted(plane, pixels) if len(ids) >= FEWEST_FOR_SIZES else None
    if whole is not None:
        # Of a small grid neighbours are far away, and a strong lens bends what lies between.
        fits |= np.linalg.norm(whole.pixels(plane) - pixels, axis=1) <= OFF_PX / 2
    # At the rim of the grid neighbours tell little, but a cover adds to the size or takes from it.
    alike = np.flatnonzero(fits & (ids != (-1 if target.marked is None else target.marked)))
    lens = _core.PlaneMap.fitted(plane[alike], pixels[alike]) if len(alike) >= FEWEST_FOR_SIZES else None
    if lens is not None:
        outlines = _outlines(pixels[alike], lens.steps(plane[alike], 1e-3 * np.ptp(plane)))
        sizes = np.log(circles.areas[alike] / outlines.areas)
        # What the map does not know of a strong lens is smooth.
        x, y = ((plane[alike] - plane.mean(axis=0)) / np.ptp(plane)).T
        columns = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
        sizes = np.abs(sizes - columns @ np.linalg.lstsq(columns, sizes, rcond=None)[0])
        fits[alike] = sizes <= max(SIZE_OFF, SIZE_OFF_SPREADS * 1.4826 * float(np.median(sizes)))
    return fits


def _measure_first(image: Image, expected: Spots, which: int) -> None:
    """Put the shape of a circle of unknown size where it is expected; its neighbours depend on it, too."""
    spot, gap = expected.take(np.array([which])), gaps(expected)[[which]]
    spot.shapes[:] *= LARGER**2
    for _ in range(2):
        spot = area_centroids(image, spot, gap)
        if not np.isfinite(spot.centres).all():
            return
    expected.shapes[which] = spot.shapes[0]


def _centroids(image: Image, circles: Spots, plane: FloatArray) -> Spots:
    """Return circles at places of the board as measured from first guesses, NaN where they cannot be.

    Of small ones each pixel counts: they are measured once more from where all together put them, so that the
    first guesses do not matter.
    """
    found = area_centroids(image, circles)
    good = np.flatnonzero(np.isfinite(found.centres[:, 0]))
    if len(good) < FEWEST_TOGETHER or np.median(found.areas[good]) > np.pi * SMALL_PX**2:
        return found
    lens = _core.PlaneMap.fitted(plane[good], found.centres[good])
    if lens is None:
        return found
    # A circle of one metre, then of the size that it has.
    outlines = _outlines(lens.pixels(plane[good]), lens.steps(plane[good], 1e-3 * np.ptp(plane)))
    sizes = found.areas[good] / outlines.areas
    usual = float(np.median(sizes))
    sizes = np.where(np.abs(np.log(sizes / usual)) < np.log(AREA_RATIO), usual, sizes)
    again = Spots(outlines.centres, outlines.shapes * sizes[:, np.newaxis, np.newaxis])
    again = area_centroids(image, again)
    found.centres[good], found.shapes[good] = again.centres, again.shapes
    return found


def _expected(target: CircleGrid, board: Aligned, ids: IndexArray) -> Spots:
    """Return the outlines that circles should have."""
    plane = target.points[ids, :2]
    steps = board.steps(plane) * target.radii_m[ids, np.newaxis, np.newaxis]
    return _outlines(board.places(plane), steps)


def _outlines(centres: FloatArray, axes: FloatArray) -> Spots:
    """Return ellipses at centres (N, 2) that are images of circles with radii (N, 2, 2) along both axes."""
    return Spots(centres, axes.swapaxes(1, 2) @ axes)


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


def _is_certain(target: CircleGrid, there: NDArray[np.bool_]) -> bool:
    """Tell whether so many of the circles (P,) are there that the grid cannot lie one line further."""
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
    # All placements use the same spots: the first one says where they are on the board.
    plane = target.points[np.flatnonzero(placed[0].spots >= 0), :2]
    measured = _centroids(image, circles, plane)
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
    ids = ids[_fit_others(target, ids, Spots(pixels[chosen[ids]], shapes[chosen[ids]]))]
    if len(ids) < LEAST_MEASURED * target.point_count:
        return NotFound(Reason.INCOMPLETE, f"only {len(ids)} of {target.point_count} circles can be measured")
    kept = Spots(pixels[chosen[ids]], shapes[chosen[ids]])
    return stated(image, target, ids, kept.centres, sigmas_px(image, kept), usual_factor=USUAL_FACTOR)


def _marked_ratio(target: CircleGrid, chosen: IndexArray, shapes: FloatArray) -> float:
    """Return the area of the circle that would be the marked one over that of the circles around it."""
    assert target.marked is not None  # noqa: S101 - asked only then
    if chosen[target.marked] < 0:
        return 0.0
    away = np.linalg.norm(target.points - target.points[target.marked], axis=1)
    around = chosen[np.argsort(away)[1:6]]
    return float(areas(shapes[[chosen[target.marked]]])[0] / np.median(areas(shapes[around[around >= 0]])))
