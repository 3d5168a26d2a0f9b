"""The uncertainty where it matters: principal axes with names, and points in front of the camera."""

from collections.abc import Sequence

import numpy as np

from handeye.estimation import confidence
from handeye.estimation.confidence import PROBABILITY, radius
from handeye.estimation.f_distribution import f_quantile
from handeye.report.document import AtPoint, PositionAxis, RotationAxis, Within
from handeye.report.wording import direction, figures, in_camera, turning_camera
from handeye.types.arrays import FloatArray
from handeye.types.units import MM_PER_M

# Distances that are shown where nothing is known about the work.
USUAL_DISTANCES_M = (0.3, 0.6, 1.0)


def within(covariance: FloatArray, degrees_of_freedom: float) -> Within:
    """Return the radii within which position and rotation of the camera lie with 95 % probability."""
    known = confidence.within(covariance, degrees_of_freedom)
    return Within(translation_mm=known.translation_mm, rotation_deg=known.rotation_deg)


def position_axes(
    covariance: FloatArray, degrees_of_freedom: float, R_parent_camera: FloatArray, parent: str
) -> list[PositionAxis]:
    """Return the principal axes of the ellipsoid that holds the camera's position, the longest first."""
    axes: list[PositionAxis] = []
    for half_m, in_parent, camera in _axes(covariance[:3, :3], degrees_of_freedom, R_parent_camera):
        half_mm = MM_PER_M * half_m
        axes.append(
            PositionAxis(
                half_length_mm=half_mm,
                direction_in_parent=in_parent.tolist(),
                direction_in_camera=camera.tolist(),
                words=f"±{figures(half_mm, 2)} mm along {direction(in_parent, parent)}: {in_camera(camera)}",
            )
        )
    return axes


def rotation_axes(
    covariance: FloatArray, degrees_of_freedom: float, R_parent_camera: FloatArray, parent: str
) -> list[RotationAxis]:
    """Return the principal axes of the ellipsoid that holds the camera's rotation, the longest first."""
    axes: list[RotationAxis] = []
    for half_rad, in_parent, camera in _axes(covariance[3:, 3:], degrees_of_freedom, R_parent_camera):
        half_deg, line = float(np.rad2deg(half_rad)), direction(in_parent, parent)
        axes.append(
            RotationAxis(
                half_angle_deg=half_deg,
                direction_in_parent=in_parent.tolist(),
                direction_in_camera=camera.tolist(),
                words=f"±{figures(half_deg, 2)} deg about {line}: {turning_camera(camera)}",
            )
        )
    return axes


def _axes(
    covariance: FloatArray, degrees_of_freedom: float, R_parent_camera: FloatArray
) -> list[tuple[float, FloatArray, FloatArray]]:
    """Return the axes of ``rho' C^-1 rho <= 3 F(3, nu)``, as in `handeye.estimation.confidence`.

    Each with its half length and its direction in the parent and in the camera, the longest first.
    """
    variances, vectors = np.linalg.eigh(covariance)
    scale = np.sqrt(3 * f_quantile(PROBABILITY, 3, degrees_of_freedom))
    axes: list[tuple[float, FloatArray, FloatArray]] = []
    for variance, vector in reversed(list(zip(variances, vectors.T, strict=True))):
        in_parent = R_parent_camera @ vector
        # Of the two signs the one that points along the axis that names it.
        sign = 1.0 if in_parent[int(np.argmax(np.abs(in_parent)))] > 0 else -1.0
        axes.append((float(scale * np.sqrt(max(float(variance), 0.0))), sign * in_parent, sign * vector))
    return axes


def at_points(
    covariance: FloatArray, degrees_of_freedom: float, distances_m: Sequence[tuple[float, str]]
) -> list[AtPoint]:
    """Return how well points on the optical axis are known in the parent frame, each with its words."""
    found: list[AtPoint] = []
    for distance, words in distances_m:
        # A twist (rho, phi) moves the point (0, 0, d) by rho + phi x p.
        across = np.array([[0.0, distance, 0.0], [-distance, 0.0, 0.0], [0.0, 0.0, 0.0]])
        jacobian = np.hstack([np.eye(3), across])
        spread = radius(jacobian @ covariance @ jacobian.T, degrees_of_freedom)
        found.append(AtPoint(distance_mm=MM_PER_M * distance, within_95_mm=MM_PER_M * spread, words=words))
    return found
