"""Where the camera lies with a given probability: the ellipsoid behind a covariance."""

from dataclasses import dataclass

import numpy as np

from handeye.evaluation.f_distribution import f_quantile
from handeye.types.arrays import FloatArray
from handeye.types.calibration import MM_PER_M, Calibration


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An ellipsoid around a position.

    Parameters
    ----------
    probability
        Probability that it holds the truth.
    semi_axes_m
        (3,) lengths of its semi-axes, the longest first.
    directions
        (3, 3) their directions in the camera frame, one a row.
    """

    probability: float
    semi_axes_m: FloatArray
    directions: FloatArray

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        return {
            "probability": self.probability,
            "semi_axes_mm": (self.semi_axes_m * MM_PER_M).tolist(),
            "directions": self.directions.tolist(),
            "frame": "camera",
        }


def position_region(calibration: Calibration, probability: float = 0.95) -> Ellipsoid:
    """Return the ellipsoid that holds the true position of the camera with a probability.

    ``rho' C^-1 rho <= 3 F(3, nu)`` over the translation part C of the covariance, nu the degrees of freedom
    of the noise levels behind it.
    """
    variances, vectors = np.linalg.eigh(calibration.covariance[:3, :3])
    scale = 3 * f_quantile(probability, 3, calibration.degrees_of_freedom)
    lengths = np.sqrt(np.clip(variances, 0, None) * scale)
    return Ellipsoid(probability, lengths[::-1].copy(), vectors.T[::-1].copy())
