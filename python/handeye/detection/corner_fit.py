"""Corners to a hundredth of a pixel: a picture of the corner is fitted to the grey values around it.

Two edges cross, each blurred by a Gaussian (the lens, and the area of a pixel), and divide the window into
four parts of uniform grey. Place, directions, blur and greys are found by least squares on the pixels along
the edges: several times closer to the truth on rendered boards than `cv2.findChessboardCornersSB`. The
fitting itself is done in `handeye._core`.
"""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.detection.base import Image
from handeye.types.arrays import FloatArray

# Half the width of the strip along each edge that is looked at.
BAND_PX = 4.0
# Corners further than this from where others put them are not what they seem; where a board is near, so that
# a pitch is many pixels, further than a share of it.
ASTRAY_PX, ASTRAY_SHARE = 1.5, 0.06


class CornerKind(Enum):
    """What meets at a corner."""

    CROSSING = "crossing"
    """Two dark and two light squares, diagonally equal; the light may change across the window."""
    QUADRANTS = "quadrants"
    """Four parts of any grey: the corner of a tag, with or without a square that touches it."""


def astray(found: FloatArray, expected: FloatArray, pitches_px: FloatArray) -> NDArray[np.bool_]:
    """Tell which corners (N, 2) are not there or too far from where they are expected; pitches are (N,)."""
    away = np.linalg.norm(found - expected, axis=1)
    return ~(away <= np.maximum(ASTRAY_PX, ASTRAY_SHARE * pitches_px))


def fit_corners(
    image: Image,
    corners: FloatArray,
    directions: FloatArray,
    radii: FloatArray,
    kind: CornerKind,
    curvatures: FloatArray | None = None,
    bands: FloatArray | None = None,
    settle: bool = False,
) -> FloatArray:
    """Return corners (N, 2), NaN where the fit fails.

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
    settle
        Whether windows in which the corner was not in the middle are laid anew around it, so that the guess
        matters little.
    """
    return _core.fit_corners(
        image,
        corners,
        directions,
        np.zeros((len(corners), 2)) if curvatures is None else curvatures,
        radii,
        np.full(len(corners), BAND_PX) if bands is None else bands,
        kind is CornerKind.CROSSING,
        settle,
    )
