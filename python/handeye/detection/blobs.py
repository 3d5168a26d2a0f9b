"""Elliptical spots, dark or light, as candidates for the circles of a grid."""

from dataclasses import dataclass

import cv2
import numpy as np

from handeye.detection.base import Image
from handeye.types.arrays import FloatArray, IndexArray

LEVELS = 12
SMALLEST_AREA_PX = 12.0
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
    return np.pi * np.sqrt(np.linalg.det(shapes))


def find_spots(image: Image) -> tuple[Spots, Spots]:
    """Return the dark spots and the light spots of an image.

    The image is cut at several grey levels, so that light may change across it; a spot shows at
    several levels.
    """
    smooth = cv2.GaussianBlur(image, (3, 3), 0)
    low, high = (float(v) for v in np.percentile(smooth[::4, ::4], [1, 99]))
    dark: list[FloatArray] = []
    light: list[FloatArray] = []
    for level in np.linspace(low, high, LEVELS + 2)[1:-1]:
        binary = cv2.threshold(smooth, level, 255, cv2.THRESH_BINARY)[1]
        outlines, hierarchy = cv2.findContours(binary, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        for index, outline in enumerate(outlines):
            # In OpenCV's two-level hierarchy an outline with a parent is the edge of a hole: dark in light.
            is_hole = hierarchy[0, index, 3] >= 0
            spot = _spot(np.asarray(outline, dtype=np.float64)[:, 0], is_hole, image.size)
            if spot is not None:
                (dark if is_hole else light).append(spot)
    return _merged(dark), _merged(light)


def _spot(outline: FloatArray, is_hole: bool, pixels: int) -> FloatArray | None:
    """Return centre, shape and roundness (6,) of an outline (N, 2), None if it is no ellipse."""
    if len(outline) < 8:
        return None
    moments = cv2.moments(outline.astype(np.float32)[:, np.newaxis])
    area = moments["m00"]
    if not SMALLEST_AREA_PX <= area <= LARGEST_SHARE * pixels:
        return None
    xx, xy, yy = moments["mu20"] / area, moments["mu11"] / area, moments["mu02"] / area
    determinant = xx * yy - xy * xy
    if determinant <= 0:
        return None
    roundness = area / (4 * np.pi * np.sqrt(determinant))
    mean, spread = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    if roundness < ROUNDNESS or mean + spread > LONGEST_AXIS_RATIO**2 * (mean - spread):
        return None
    # Outlines run through the middles of the light pixels of an edge: half a pixel outside a dark spot, half
    # a pixel inside a light one.
    radius = np.sqrt(area / np.pi)
    grown = (1 + (-0.5 if is_hole else 0.5) / radius) ** 2
    shape = 4 * grown * np.array([xx, xy, yy])
    centre = moments["m10"] / area, moments["m01"] / area
    return np.array([*centre, *shape, min(roundness, 1.0)])


def _merged(found: list[FloatArray]) -> Spots:
    """Take outlines of one spot together; the one of median area stands for it."""
    rows = np.array(found).reshape(-1, 6)
    rows = rows[np.argsort(-rows[:, 5], kind="stable")]
    radii = np.sqrt(np.sqrt(np.maximum(rows[:, 2] * rows[:, 4] - rows[:, 3] ** 2, 1e-12)))
    free = np.ones(len(rows), dtype=bool)
    kept: list[int] = []
    levels: list[int] = []
    for index in range(len(rows)):
        if not free[index]:
            continue
        distance = np.hypot(*(rows[:, :2] - rows[index, :2]).T)
        same = free & (distance <= SAME_SPOT * np.minimum(radii, radii[index]))
        same &= np.abs(np.log(radii / radii[index])) <= np.log(SAME_RADIUS)
        free &= ~same
        members = np.flatnonzero(same)
        if len(members) >= FEWEST_LEVELS:
            kept.append(int(members[np.argsort(radii[members])[len(members) // 2]]))
            levels.append(len(members))
    chosen = rows[kept][np.argsort(-np.array(levels, dtype=np.int64), kind="stable")]
    return Spots(chosen[:, :2], chosen[:, [2, 3, 3, 4]].reshape(-1, 2, 2))
