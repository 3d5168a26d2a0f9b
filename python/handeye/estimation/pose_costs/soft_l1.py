"""Soft L1 on poses: the loss of robust tools, which grows like the distance, not like its square."""

import numpy as np

from handeye import _core
from handeye.estimation.pose_costs.base import PoseCost, PoseViews, inverse
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
    """One over the variance of the rotations and of the translations, times ``1 / sqrt(1 + s)`` per view.

    Variances are from medians, so that a few bad views do not widen them; s is the mean square of a view in
    units of them.
    """
    halves = np.hsplit(np.abs(residuals), 2)
    sigma = np.array([max(MEDIAN_TO_SIGMA * float(np.median(half)), LEAST_SIGMA) for half in halves]).repeat(
        3
    )
    s = np.mean((residuals / sigma) ** 2, axis=1, keepdims=True)
    # Relative to the rotation's: only the ratio matters, and numbers stay near one.
    return (sigma[3] / sigma) ** 2 / np.sqrt(1 + s)


SOFT_L1 = PoseCost("soft_l1", PAPER, _residuals, _weights)
