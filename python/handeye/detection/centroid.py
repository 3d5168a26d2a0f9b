"""The area centroids of spots, from grey values.

The first moment of the grey values of a spot is the centroid of its area, exactly, as long as every pixel
holds the mean over its square: no edge has to be located. Only pixels near the edge can be partly covered;
the others are taken as inside or outside, so that their noise does not count. The light may change across the
spot. The sums are done in `handeye._core`.
"""

import numpy as np

from handeye import _core
from handeye.detection.base import Image
from handeye.detection.blobs import Spots
from handeye.detection.saddles import sampled
from handeye.types.arrays import FloatArray

# Contrast is that between these shares of the radius, in so many directions.
AT, RAYS = (0.6, 1.35), 8
# Deviation of a pixel in grey values, and the width of the band along the edge in which pixels count.
USUAL_NOISE, BAND_PX = 2.0, 5.0


def gaps(spots: Spots) -> FloatArray:
    """Return the narrowest free distance (N,) in pixels from the edge of each spot to that of another one."""
    return _core.free_gaps(spots.centres, spots.shapes)


def area_centroids(image: Image, spots: Spots, gaps_px: FloatArray | None = None) -> Spots:
    """Return spots where the grey values have them; NaN where the image's edge cuts one, or without contrast.

    Parameters
    ----------
    image
        Grey values.
    spots
        First guesses.
    gaps_px
        (N,) narrowest free distance from the edge of each to that of the next spot; None where these spots
        are all there are.
    """
    free = gaps(spots) if gaps_px is None else gaps_px
    centres, shapes = _core.area_centroids(image, spots.centres, spots.shapes, free)
    return Spots(centres, shapes)


def sigmas_px(image: Image, spots: Spots) -> FloatArray:
    """Return standard deviations (N,) of the centroids of spots, of one coordinate, at a usual noise.

    Noise of the pixels along the edge of a circle of radius r, in a band of width w, shifts its centroid by
    `noise sqrt(w / (pi r)) / contrast`.
    """
    turn = 2 * np.pi * np.arange(RAYS) / RAYS
    unit = np.column_stack([np.cos(turn), np.sin(turn)])
    axes = np.asarray(np.linalg.cholesky(spots.shapes), dtype=np.float64)
    outline = unit @ axes.swapaxes(1, 2)
    inside, outside = (sampled(image, spots.centres[:, np.newaxis] + at * outline) for at in AT)
    contrast = np.abs(inside.mean(axis=1) - outside.mean(axis=1))
    radius = np.sqrt(spots.areas / np.pi)
    return USUAL_NOISE * np.sqrt(BAND_PX / (np.pi * radius)) / np.maximum(contrast, 1.0)
