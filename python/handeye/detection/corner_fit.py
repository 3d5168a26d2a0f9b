"""Corners to a hundredth of a pixel: a picture of the corner is fitted to the grey values around it.

Two edges cross, each blurred by a Gaussian (the lens, and the area of a pixel), and divide the window into
four parts of uniform grey. Place, directions, blur and greys are found by least squares on the pixels along
the edges: several times closer to the truth on rendered boards than `cv2.findChessboardCornersSB`. The
fitting itself is done in `handeye._core`.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.detection.base import Image, affine
from handeye.types.arrays import FloatArray, IndexArray

# Half the width of the strip along each edge that is looked at.
BAND_PX = 4.0
# The strip stays away from the next edges by so many deviations of the blur, at least and at most these
# shares of what is free.
AWAY_IN_BLURS, NARROWEST_SHARE, BAND_SHARE = 2.0, 0.2, 0.8
# Corners further than this from where others put them are not what they seem; where a board is near, so that
# a pitch is many pixels, further than a share of it.
ASTRAY_PX, ASTRAY_SHARE = 1.5, 0.06
# Fewer corners do not tell where the others are; so many do.
FEWEST_TOLD, FEW = 6, 16
# Where strips are narrower than this all corners must tell: then it matters most where they lie.
WIDE_PX = 5.0
# Directions are taken over this share of a board.
TOLD_SHARE = 0.02

# Residuals of a corner are larger than those of most by this factor, and than this share of its contrast,
# where there is something else.
MISFIT_RATIO, MISFIT_SHARE = 1.5, 0.04
# Standard deviation s of the Gaussian that smooths the picture; of noise that is independent from pixel to
# pixel it leaves 1 / (2 s sqrt(pi)).
SMOOTHING_PX = 1.0


class CornerKind(Enum):
    """What meets at a corner."""

    CROSSING = "crossing"
    """Two dark and two light squares, diagonally equal; the light may change across the window."""
    QUADRANTS = "quadrants"
    """Four parts of any grey: the corner of a tag, with or without a square that touches it."""


# Noise that was smoothed is alike from pixel to pixel, which is not the same for all that is fitted: of the
# variance that an even share of it would make, so much there is. At a crossing light that changes across the
# window has more than its share. For windows of 8 to 24 px.
ALIKE = {CornerKind.CROSSING: 0.77, CornerKind.QUADRANTS: 0.95}


def astray(found: FloatArray, expected: FloatArray, pitches_px: FloatArray) -> NDArray[np.bool_]:
    """Tell which corners (N, 2) are not there or too far from where they are expected; pitches are (N,)."""
    away = np.linalg.norm(found - expected, axis=1)
    return ~(away <= np.maximum(ASTRAY_PX, ASTRAY_SHARE * pitches_px))


def spread(count: int, few: int) -> IndexArray:
    """Return some of so many numbers, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, few)).round().astype(np.int64))


def nearer(
    plane: FloatArray, expected: FloatArray, steps: FloatArray, some: IndexArray, found: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return where corners (N, 2) are, and the pixels (N, 2, 2) per metre there, as some or all of them tell.

    Parameters
    ----------
    plane, expected, steps
        (N, 2) places on the board and in the image, and (N, 2, 2) pixels per metre along both axes.
    some, found
        (M,) which were looked at, and (M, 2) where they are.
    """
    off = found - expected[some]
    good = np.linalg.norm(off, axis=1) <= ASTRAY_PX
    if good.sum() < FEWEST_TOLD:
        return expected, steps
    if len(some) < len(plane):
        A, b = affine(plane[some[good]], off[good])
        return expected + plane @ A + b, steps + A
    lens = _core.PlaneMap.fitted(plane[good], found[good])
    if lens is None:
        return expected, steps
    directions = lens.steps(plane, TOLD_SHARE * float(np.ptp(plane, axis=0).max()))
    return np.where(good[:, np.newaxis], found, expected), directions


def curvatures(lens: _core.PlaneMap | None, plane: FloatArray, half: float) -> FloatArray:
    """Return the curvatures (N, 2) in 1 / px that straight lines along both axes have in the image.

    They are towards the normals (-sin, cos) of the axes' directions; none without a map of the plane.

    Parameters
    ----------
    lens
        The map.
    plane
        (N, 2) places in metres.
    half
        How far apart the places are by which it is told, in metres.
    """
    if lens is None or not len(plane):
        return np.zeros((len(plane), 2))
    here, bent = lens.pixels(plane), np.zeros((len(plane), 2))
    for axis in range(2):
        step = half * np.eye(2)[axis]
        before, after = lens.pixels(plane - step), lens.pixels(plane + step)
        along, turned = (after - before) / 2, after - 2 * here + before
        cross = along[:, 0] * turned[:, 1] - along[:, 1] * turned[:, 0]
        bent[:, axis] = cross / np.maximum(np.linalg.norm(along, axis=1), 1e-9) ** 3
    return bent


@dataclass(frozen=True, eq=False)
class CornerFits:
    """Corners that were fitted, NaN where that failed.

    Attributes
    ----------
    places
        (N, 2) pixels.
    spreads
        (N, 2, 2) covariances of the places in px^2, for independent residuals of one grey value.
    misfits
        (N,) root mean squares of the residuals, in grey values of the smoothed picture.
    noises
        (N,) the same of those alone that may move a place: of crossings, not those that look the same after
        half a turn, as a camera's gamma makes them.
    contrasts
        (N,) grey steps across the edges.
    blurs
        (N,) standard deviations of the Gaussian that blurs the edges of the smoothed picture, in pixels.
    """

    places: FloatArray
    spreads: FloatArray
    misfits: FloatArray
    noises: FloatArray
    contrasts: FloatArray
    blurs: FloatArray

    @property
    def usual_blur_px(self) -> float:
        """What blurs most of the edges; 0 where no corner was fitted."""
        there = np.isfinite(self.blurs)
        return float(np.median(self.blurs[there])) if there.any() else 0.0

    @property
    def sigmas_px(self) -> FloatArray:
        """(N,) standard deviations of the places, of one coordinate."""
        there = np.isfinite(self.noises)
        usual = float(np.median(self.noises[there])) if there.any() else np.nan
        # Less than is usual in the picture comes of a window of few pixels, not of less noise.
        noise = 2 * np.sqrt(np.pi) * SMOOTHING_PX * np.maximum(self.noises, usual)
        # What moves a place is a bell across the edges, which smoothing makes lower and wider.
        smoothed = self.blurs / np.hypot(self.blurs, SMOOTHING_PX)
        return noise * np.sqrt(smoothed * np.trace(self.spreads, axis1=1, axis2=2) / 2)

    def spoilt(self) -> NDArray[np.bool_]:
        """Tell which corners (N,) were not fitted, or not as well as the others: a shadow's edge or glare."""
        there = np.isfinite(self.misfits)
        if not there.any():
            return ~there
        usual = float(np.median(self.misfits[there]))
        return ~(self.misfits <= np.maximum(MISFIT_RATIO * usual, MISFIT_SHARE * self.contrasts))


def clear_bands(free: FloatArray, blur_px: float) -> FloatArray:
    """Return half the widths (N,) of the strips along edges that are free (N,) of others up to so far.

    They stay away from those by what blurs all edges, but not further than a share of what is free.
    """
    return np.clip(free - AWAY_IN_BLURS * blur_px, NARROWEST_SHARE * free, BAND_SHARE * free)


def corner_fits(
    image: Image,
    corners: FloatArray,
    directions: FloatArray,
    radii: FloatArray,
    kind: CornerKind,
    curvatures: FloatArray | None = None,
    bands: FloatArray | None = None,
    turns: FloatArray | None = None,
    beyonds: FloatArray | None = None,
    rough: bool = False,
) -> CornerFits:
    """Return corners as fitted from first guesses.

    Parameters
    ----------
    corners
        (N, 2) first guesses, off by no more than a pixel or two.
    directions
        (N, 2, 2) directions of the two edges, first guesses.
    radii
        (N,) radius around each corner, in pixels, in which there are no other edges.
    kind
        What meets at the corners.
    curvatures
        (N, 2) curvatures of the two edges in 1 / px, towards their normals (-sin, cos); a lens bends straight
        edges. None for straight ones.
    bands
        (N,) distance from the edges, in pixels, beyond which there is something else; None for nothing.
    turns
        (N,) standard deviations of the directions in radians; None where they are only guesses.
    beyonds
        (N,) the radius beyond each corner, away from where both directions lead; None for the same.
    rough
        Whether to end near the places, as is enough to begin once more from there.
    """
    places, spreads, *others = _core.fit_corners(
        image,
        corners,
        directions,
        np.zeros((len(corners), 2)) if curvatures is None else curvatures,
        radii,
        radii if beyonds is None else beyonds,
        np.full(len(corners), BAND_PX) if bands is None else bands,
        np.full(len(corners), np.inf) if turns is None else turns,
        kind is CornerKind.CROSSING,
        rough,
    )
    return CornerFits(places, ALIKE[kind] * spreads, *others)


def fit_corners(
    image: Image,
    corners: FloatArray,
    directions: FloatArray,
    radii: FloatArray,
    kind: CornerKind,
    curvatures: FloatArray | None = None,
    bands: FloatArray | None = None,
    rough: bool = False,
) -> FloatArray:
    """Return the places (N, 2) of `corner_fits`, NaN where the fit fails."""
    return corner_fits(image, corners, directions, radii, kind, curvatures, bands, rough=rough).places
