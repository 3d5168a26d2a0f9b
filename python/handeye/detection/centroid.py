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
from handeye.types.arrays import FloatArray


def area_centroids(image: Image, spots: Spots, gaps_px: FloatArray) -> Spots:
    """Return spots where the grey values have them; NaN where the image's edge cuts one, or without contrast.

    Parameters
    ----------
    image
        Grey values.
    spots
        First guesses.
    gaps_px
        (N,) narrowest free distance from the edge of each to that of the next spot.
    """
    centres, shapes = _core.area_centroids(
        np.ascontiguousarray(image, dtype=np.uint8), spots.centres, spots.shapes, gaps_px
    )
    return Spots(centres, shapes)
