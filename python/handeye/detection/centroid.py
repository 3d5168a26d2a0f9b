"""The area centroids of spots, from grey values.

The first moment of the grey values of a spot is the centroid of its area, exactly, as long as every pixel
holds the mean over its square: no edge has to be located. Only pixels near the edge can be partly covered;
the others are taken as inside or outside, so that their noise does not count. The light may change across the
spot. The sums are done in `handeye._core`.
"""

from handeye import _core
from handeye.detection.base import Image
from handeye.detection.blobs import Spots
from handeye.types.arrays import FloatArray


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
