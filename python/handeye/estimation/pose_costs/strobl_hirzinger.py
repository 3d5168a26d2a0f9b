"""Strobl and Hirzinger: rotation and translation weighted by the noise that the residuals themselves show."""

import numpy as np

from handeye.estimation.pose_costs.base import PoseCost, PoseViews, inverse, rotation_vectors
from handeye.types.arrays import FloatArray

PAPER = (
    'K. H. Strobl and G. Hirzinger, "Optimal hand-eye calibration", IEEE/RSJ International Conference on '
    "Intelligent Robots and Systems (IROS), 2006"
)
# Least variance, square radians or metres: where there is no noise the weights must end somewhere.
LEAST_VARIANCE = 1e-24


def _residuals(X: FloatArray, Y: FloatArray, views: PoseViews) -> FloatArray:
    """Angle and translation of the two sides of ``C inv(Y) = X A``, radians and metres side by side."""
    seen, chain = views.C @ inverse(Y), X @ views.A
    turned = rotation_vectors(np.swapaxes(chain[..., :3, :3], -1, -2) @ seen[..., :3, :3])
    return np.concatenate([turned, seen[..., :3, 3] - chain[..., :3, 3]], axis=-1)


def _weights(residuals: FloatArray) -> FloatArray:
    """One over the variance of the rotations and of the translations, from the residuals of this step.

    The fixed point is the maximum of the likelihood in X, Y and both variances: the metric of SE(3) adapts
    itself to the cell.
    """
    rotation = max(float(np.mean(residuals[:, :3] ** 2)), LEAST_VARIANCE)
    translation = max(float(np.mean(residuals[:, 3:] ** 2)), LEAST_VARIANCE)
    weights = np.ones_like(residuals)
    # Relative to the rotation's: only the ratio matters, and numbers stay near one.
    weights[:, 3:] = rotation / translation
    return weights


STROBL_HIRZINGER = PoseCost("strobl_hirzinger", PAPER, _residuals, _weights)
