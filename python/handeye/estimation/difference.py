"""How two calibrations of one camera differ, and whether that is more than chance."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.estimation.f_distribution import f_cumulative
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose
from handeye.types.units import MM_PER_M

# A difference less likely than this by chance is said to be one.
UNLIKELY = 0.05


@dataclass(frozen=True, eq=False)
class Difference:
    """From one calibration to another.

    Parameters
    ----------
    translation_m
        (3,) how far the camera's centre moved, in the frame that it is fixed to.
    rotation_rad
        (3,) its turn, a rotation vector in the camera frame.
    covariance
        (6, 6) of the twist between both, camera frame: the sum of both covariances.
    p_value
        Chance of a difference as large where nothing moved.
    """

    translation_m: FloatArray
    rotation_rad: FloatArray
    covariance: FloatArray
    p_value: float

    @property
    def sentence(self) -> str:
        """Say it in words."""
        far = MM_PER_M * float(np.linalg.norm(self.translation_m))
        turned = float(np.rad2deg(np.linalg.norm(self.rotation_rad)))
        sigma = MM_PER_M * float(np.sqrt(np.trace(self.covariance[:3, :3])))
        verdict = "more than chance" if self.p_value < UNLIKELY else "no more than chance"
        return (
            f"the camera differs by {far:.3g} mm and {turned:.2g} deg, where {sigma:.2g} mm are usual: "
            f"{verdict} (p = {self.p_value:.2g})"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, with units in the keys."""
        return {
            "translation_mm": (MM_PER_M * self.translation_m).tolist(),
            "distance_mm": MM_PER_M * float(np.linalg.norm(self.translation_m)),
            "rotation_deg": np.rad2deg(self.rotation_rad).tolist(),
            "angle_deg": float(np.rad2deg(np.linalg.norm(self.rotation_rad))),
            "sigma_translation_mm": MM_PER_M * float(np.sqrt(np.trace(self.covariance[:3, :3]))),
            "sigma_rotation_deg": float(np.rad2deg(np.sqrt(np.trace(self.covariance[3:, 3:])))),
            "p_value": self.p_value,
            "sentence": self.sentence,
        }


def difference(first: tuple[Pose, FloatArray, float], second: tuple[Pose, FloatArray, float]) -> Difference:
    """Compare two calibrations, each the camera's pose in its parent, its covariance and degrees of freedom.

    The covariances (6, 6) are of the twist of X, in the camera frame. The two count as independent, as from
    other views. What they share, such as one calibration of the lens, makes a real difference look smaller.
    """
    (a, of_a, freedom_a), (b, of_b, freedom_b) = first, second
    # With X = inverse of the pose: X_b = exp(xi) X_a.
    twist = (b.inverse() @ a).log()
    covariance = of_a + of_b
    squared = float(twist @ np.linalg.solve(covariance, twist))
    freedom = min(freedom_a, freedom_b)
    return Difference(
        b.translation - a.translation,
        -twist[3:],
        covariance,
        1.0 - f_cumulative(squared / 6, 6, freedom),
    )
