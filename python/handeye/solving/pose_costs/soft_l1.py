"""Soft L1 on poses: what robust tools of the field minimise, a loss that grows like the distance, not its square."""

import numpy as np

from handeye import _core
from handeye.solving.pose_costs.base import PoseCost, PoseViews, inverse
from handeye.types.arrays import FloatArray

PAPER = (
    'B. Triggs, P. McLauchlan, R. Hartley and A. Fitzgibbon, "Bundle adjustment: a modern synthesis", Vision '
    "Algorithms 1999, section 3; the loss 2 (sqrt(1 + s) - 1) is SciPy's soft_l1"
)
# From a median of absolute values to a standard deviation (Gaussian).
MEDIAN_TO_SIGMA = 1.4826
LEAST_SIGMA = 1e-12


def _residuals(X: FloatArray, Y: FloatArray, views: PoseViews) -> FloatArray:
    """Twists (metres, radians) from the chain to the measured pose."""
    differences = views.C @ inverse(X @ views.A @ Y)
    twists = _core.se3_log(differences.reshape(-1, 4, 4))
    return twists.reshape(*differences.shape[:-2], 6)


def _weights(residuals: FloatArray) -> FloatArray:
    """Weights of the iterated squares: one over the variance, times ``1 / sqrt(1 + s)`` per view."""
    sigma = np.array(
        [max(MEDIAN_TO_SIGMA * float(np.median(np.abs(part))), LEAST_SIGMA) for part in np.hsplit(residuals, 2)]
    ).repeat(3)
    sigma /= sigma[3:].mean()
    unit = np.median(np.sum((residuals / sigma) ** 2, axis=1)) / 5.35 + LEAST_SIGMA**2
    s = np.sum((residuals / sigma) ** 2, axis=1, keepdims=True) / (6 * unit)
    return 1 / (sigma**2 * np.sqrt(1 + s))


SOFT_L1 = PoseCost("soft_l1", PAPER, _residuals, _weights)
