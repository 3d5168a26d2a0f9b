"""How well each point was measured: a standard deviation from its own picture and from how all of them lie.

What a point's picture tells (blur, contrast, how obliquely edges cross, how well the fit went) says how good
it is beside the others; how far all of them are off a flat board seen through a lens says how good they are.
The fewer the points, the more what is usual counts.
"""

import cv2
import numpy as np

from handeye.detection.base import Detection
from handeye.detection.part import mapped
from handeye.types import Target
from handeye.types.arrays import FloatArray

# Numbers of a homography; a lens adds polynomials in the image, those of its distortion, of a degree that so
# many points tell.
OF_HOMOGRAPHY, POINTS_OF_DEGREE = 8, {5: 36, 4: 26, 3: 16}
# What is usual counts as one measurement.
USUAL_COUNT = 1.0
# No point is better.
LEAST_PX = 0.001
# The largest of the squares are left out, as a few points may lie elsewhere; the mean of the others of a
# Gaussian is this share of its variance.
TRIMMED, OF_VARIANCE = 0.03, 0.831
# Squared distances over variances of both coordinates that one point in ten thousand exceeds.
ASTRAY = 18.4


def off_plane(
    plane: FloatArray, pixels: FloatArray, moves: FloatArray | None = None
) -> tuple[FloatArray, int, FloatArray] | None:
    """Return by how much (N, 2) points in an image are off those of a flat board seen through a lens.

    Also how many of their coordinates such a view leaves free, and what of some moves (N, K) of the points,
    each of one coordinate, no view of a flat board makes; None where there is no such view.
    """
    # OpenCV gives None where it finds none, whatever its types say.
    found, _ = cv2.findHomography(plane, pixels, 0)
    if found is None:  # pyright: ignore[reportUnnecessaryComparison]
        return None
    off = pixels - mapped(np.asarray(found, dtype=np.float64), plane)
    off = off if moves is None else np.concatenate([off, moves], axis=1)
    for degree, fewest in POINTS_OF_DEGREE.items():
        if len(plane) >= fewest:
            powers = [(i, k) for i in range(degree + 1) for k in range(degree + 1 - i)]
            low, high = pixels.min(axis=0), pixels.max(axis=0)
            x, y = ((2 * pixels - low - high) / np.maximum(high - low, 1e-12)).T
            columns = np.stack([x**i * y**k for i, k in powers], axis=1)
            # What another homography would change is in the polynomials, too.
            left = off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]
            return left[:, :2], 2 * (len(plane) - len(powers)), left[:, 2:]
    return off[:, :2], 2 * len(plane) - OF_HOMOGRAPHY, off[:, 2:]


def scaled(target: Target, detection: Detection) -> Detection:
    """Return a detection whose standard deviations fit how its points lie on the board.

    Up to then they may be wrong by a factor, the same for all points.
    """
    if detection.sigmas_px is None:
        return detection
    # A larger circle lies elsewhere in perspective than its neighbours say, which is no error of it.
    radii = target.radii_m[detection.point_ids]
    told = radii == np.median(radii)
    relative = detection.sigmas_px
    off = off_plane(target.points[detection.point_ids[told], :2], detection.pixels[told])
    variances = relative**2
    if off is not None and off[1] > 0:
        residuals, freedom, _ = off
        sorted_squares = np.sort(((residuals / relative[told, np.newaxis]) ** 2).ravel())
        kept = sorted_squares[: round((1 - TRIMMED) * len(sorted_squares))]
        variance = float(kept.mean()) / OF_VARIANCE * residuals.size / freedom
        # What is usual may be wrong by a power of ten, up or down, so it is logarithms that are weighed.
        variances *= variance ** (freedom / (freedom + USUAL_COUNT))
        # A point that lies further off than chance brings it was measured worse than its picture tells.
        squares = (residuals**2).sum(axis=1)
        variances[told] = np.where(squares > ASTRAY * variances[told], squares / 2, variances[told])
    return detection.with_sigmas(np.maximum(np.sqrt(variances), LEAST_PX))
