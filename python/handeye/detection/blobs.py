"""Elliptical spots, dark or light, as candidates for the circles of a grid."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import Image
from handeye.detection.noise import calmed
from handeye.types.arrays import FloatArray, IndexArray

LEVELS = 12
# Grey values that an image must span, those of strong noise, and outlines looked at: noise has very many.
LEAST_RANGE, LEAST_OF_NOISE, MOST_OUTLINES = 8.0, 16.0, 6000
SMALLEST_AREA_PX = 12.0
FEWEST_EDGE_PX = 8
# Largest share of the image that one circle may cover.
LARGEST_SHARE = 0.1
# Area over that of the ellipse with the same second moments: 1 for an ellipse, 0.955 for a rectangle, less
# for anything ragged or hollow; small circles of few pixels are ragged.
ROUNDNESS = 0.93
LONGEST_AXIS_RATIO = 6.0
# Two outlines with centres closer than this share of the smaller one's radius are of one spot.
SAME_SPOT = 0.5
SAME_RADIUS = 2.0
# A spot shows at more than one level; what shows at one only is mostly noise.
FEWEST_LEVELS = 2


@dataclass(frozen=True)
class Spots:
    """Spots of one polarity.

    Attributes
    ----------
    centres
        (N, 2) pixels.
    shapes
        (N, 2, 2) matrices S of the outlines: `x' S^-1 x = 1` for x from the centre to the edge, in px^2.
        Those with most contrast come first.
    """

    centres: FloatArray
    shapes: FloatArray

    def __len__(self) -> int:
        return len(self.centres)

    def take(self, indices: IndexArray) -> "Spots":
        """Return some of the spots."""
        return Spots(self.centres[indices], self.shapes[indices])

    @property
    def areas(self) -> FloatArray:
        """(N,) areas in px^2."""
        return areas(self.shapes)


def areas(shapes: FloatArray) -> FloatArray:
    """Return the areas (N,) of ellipses of shapes (N, 2, 2)."""
    determinants = shapes[:, 0, 0] * shapes[:, 1, 1] - shapes[:, 0, 1] * shapes[:, 1, 0]
    return np.asarray(np.pi * np.sqrt(np.maximum(determinants, 0)), dtype=np.float64)


def find_spots(image: Image) -> tuple[Spots, Spots]:
    """Return the dark spots and the light spots of an image.

    The image is cut at several grey levels, so that light may change across it; a spot shows at
    several levels.
    """
    calm = calmed(image)
    smooth = cv2.GaussianBlur(calm, (3, 3), 0)
    low, high = (float(v) for v in np.percentile(smooth[::4, ::4], [1, 99]))
    rows: list[tuple[float, ...]] = []
    if high - low < (LEAST_RANGE if calm is image else LEAST_OF_NOISE):
        return _merged(np.zeros((0, 6))), _merged(np.zeros((0, 6)))
    for level in np.linspace(low, high, LEVELS + 2)[1:-1]:
        binary = cv2.threshold(smooth, level, 255, cv2.THRESH_BINARY)[1]
        outlines, hierarchy = cv2.findContours(binary, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        for index, outline in enumerate(outlines):
            if len(outline) >= FEWEST_EDGE_PX:
                m = cv2.moments(outline)
                # In OpenCV's two-level hierarchy an outline with a parent is the edge of a hole: dark.
                is_hole = hierarchy[0, index, 3] >= 0
                rows.append((m["m00"], m["m10"], m["m01"], m["mu20"], m["mu11"], m["mu02"], is_hole))
    found, is_dark = _elliptical(np.array(rows, dtype=np.float64).reshape(-1, 7), image.size)
    return _merged(found[is_dark]), _merged(found[~is_dark])


def _elliptical(moments: FloatArray, pixels: int) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return centre, shape and roundness (N, 6) of those outlines that are ellipses, and which are holes."""
    moments = moments[(moments[:, 0] >= SMALLEST_AREA_PX) & (moments[:, 0] <= LARGEST_SHARE * pixels)]
    area = moments[:, 0]
    xx, xy, yy = (moments[:, 3:6] / area[:, np.newaxis]).T
    determinant = xx * yy - xy * xy
    flat = determinant <= 0
    roundness = area / (4 * np.pi * np.sqrt(np.where(flat, np.inf, determinant)))
    mean, spread = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    good = ~flat & (roundness >= ROUNDNESS) & (mean + spread <= LONGEST_AXIS_RATIO**2 * (mean - spread))
    is_hole = moments[:, 6] > 0
    # Outlines run through the middles of the light pixels of an edge: half a pixel outside a dark spot, half
    # a pixel inside a light one.
    grown = (1 + np.where(is_hole, -0.5, 0.5) / np.sqrt(area / np.pi)) ** 2
    centres = moments[:, 1:3] / area[:, np.newaxis]
    shapes = (4 * grown)[:, np.newaxis] * np.column_stack([xx, xy, yy])
    return np.column_stack([centres, shapes, np.minimum(roundness, 1.0)])[good], is_hole[good]


def _merged(rows: FloatArray) -> Spots:
    """Take outlines of one spot together; the one of median area stands for it."""
    if len(rows) > MOST_OUTLINES:
        # What noise draws is small.
        areas_squared = rows[:, 2] * rows[:, 4] - rows[:, 3] ** 2
        rows = rows[np.sort(np.argsort(-areas_squared, kind="stable")[:MOST_OUTLINES])]
    rows = rows[np.argsort(-rows[:, 5], kind="stable")]
    radii = np.sqrt(np.sqrt(np.maximum(rows[:, 2] * rows[:, 4] - rows[:, 3] ** 2, 1e-12)))
    free = np.ones(len(rows), dtype=bool)
    kept: list[int] = []
    levels: list[int] = []
    # Only those beside it in x can be the same.
    by_x = np.argsort(rows[:, 0], kind="stable")
    x, reach = rows[by_x, 0], SAME_SPOT * radii
    first, last = np.searchsorted(x, rows[:, 0] - reach), np.searchsorted(x, rows[:, 0] + reach, "right")
    for index in range(len(rows)):
        if not free[index]:
            continue
        near = by_x[first[index] : last[index]]
        near = np.sort(near[free[near]])
        distance = np.hypot(*(rows[near, :2] - rows[index, :2]).T)
        same = distance <= np.minimum(reach[near], reach[index])
        same &= np.abs(np.log(radii[near] / radii[index])) <= np.log(SAME_RADIUS)
        members = near[same]
        free[members] = False
        if len(members) >= FEWEST_LEVELS:
            kept.append(int(members[np.argsort(radii[members])[len(members) // 2]]))
            levels.append(len(members))
    chosen = rows[kept][np.argsort(-np.array(levels, dtype=np.int64), kind="stable")]
    return Spots(chosen[:, :2], chosen[:, [2, 3, 3, 4]].reshape(-1, 2, 2))
