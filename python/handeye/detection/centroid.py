"""The area centroid of a spot, from grey values.

The first moment of the grey values of a spot is the centroid of its area, exactly, as long as every pixel
holds the mean over its square: no edge has to be located. Only pixels near the edge can be partly covered;
the others are taken as inside or outside, so that their noise does not count.
"""

import numpy as np

from handeye.detection.base import Image
from handeye.types.arrays import FloatArray

# Half the width of the band around the edge in which pixels are partly covered: the pixel itself, and blur.
BAND_PX = 2.5
SMALLEST_BAND_PX = 1.0
PASSES = 3
# Grey values between a spot and what is around it.
LEAST_CONTRAST = 3.0


def area_centroid(
    image: Image, centre: FloatArray, shape: FloatArray, gap_px: float
) -> tuple[FloatArray, FloatArray] | None:
    """Return centroid (2,) and shape (2, 2) of the spot near a centre.

    Parameters
    ----------
    image
        Grey values.
    centre, shape
        First guess, as in `handeye.detection.blobs.Spots`.
    gap_px
        Narrowest free distance from its edge to that of the next spot.

    Returns
    -------
    tuple or None
        None where the spot is cut by the image's edge, or has no contrast.
    """
    for _ in range(PASSES):
        measured = _measure(image, centre, shape, gap_px)
        if measured is None:
            return None
        centre, shape = measured
    return centre, shape


def _measure(
    image: Image, centre: FloatArray, shape: FloatArray, gap_px: float
) -> tuple[FloatArray, FloatArray] | None:
    axes = np.sqrt(np.linalg.eigvalsh(shape))  # half axes, the shorter first
    # Up to half way to the next spot: an inner part for the transition, the rest for the level outside.
    reach = max(2 * SMALLEST_BAND_PX, min(2 * BAND_PX, 0.5 * gap_px))
    band = min(BAND_PX, max(SMALLEST_BAND_PX, 0.6 * reach))
    half = np.ceil(np.sqrt(np.diag(shape)) * (1 + reach / axes[0])).astype(int) + 1
    own = np.sqrt(np.diag(shape)) + SMALLEST_BAND_PX
    if (centre - own < 0).any() or (centre + own > np.array(image.shape[::-1]) - 1).any():
        return None
    left, top = np.maximum(np.rint(centre).astype(int) - half, 0)
    right, bottom = np.minimum(np.rint(centre).astype(int) + half + 1, image.shape[::-1])
    grey = image[top:bottom, left:right].astype(np.float64)
    v, u = np.mgrid[int(top) : int(bottom), int(left) : int(right)]
    offset = np.stack([u, v], axis=-1) - centre
    # Signed distance from the edge, to first order: (q - 1) / |grad q| with q the elliptical radius.
    solved = offset @ np.linalg.inv(shape)
    q = np.sqrt(np.maximum((solved * offset).sum(axis=-1), 1e-12))
    distance = (q - 1) * q / np.maximum(np.hypot(solved[..., 0], solved[..., 1]), 1e-12)
    outside = (distance > band) & (distance <= reach)
    inside = distance < -min(band, 0.5 * axes[0])
    if outside.sum() < 8 or not inside.any():
        return None
    covered = _coverage(grey, offset, outside, inside)
    if covered is None:
        return None
    covered[distance > band] = 0.0
    covered[distance < -band] = 1.0
    area = covered.sum()
    if area <= 0:
        return None
    shift = (covered[..., np.newaxis] * offset).sum(axis=(0, 1)) / area
    spread = offset - shift
    moments = np.einsum("ij,ija,ijb->ab", covered, spread, spread) / area
    # A pixel is a square, not a point: its own second moment is 1 / 12.
    moments = moments + np.eye(2) / 12
    if np.hypot(*shift) > axes[1] or np.linalg.det(moments) <= 0:
        return None
    return centre + shift, 4 * moments


def _coverage(
    grey: FloatArray, offset: FloatArray, outside: np.ndarray, inside: np.ndarray
) -> FloatArray | None:
    """Return the share (H, W) of each pixel that the spot covers; the light may change across the spot."""
    bright, dim = float(grey[outside].mean()), float(grey[inside].mean())
    # Ink and paper get the same light, `level (1 + slope' x)`: one slope from both, by least squares.
    information, right = np.full((2, 2), 0.0), np.zeros(2)
    for part, level in ((outside, bright), (inside, dim)):
        x = offset[part] - offset[part].mean(axis=0)
        information += level**2 * x.T @ x
        right += level * x.T @ grey[part]
    slope = np.asarray(np.linalg.solve(information + 1e-9 * np.eye(2), right), dtype=np.float64)
    light = 1 + offset @ slope
    bright, dim = (float((grey[part] / light[part]).mean()) for part in (outside, inside))
    if abs(bright - dim) < LEAST_CONTRAST or light.min() <= 0.1:
        return None
    return (bright - grey / light) / (bright - dim)
