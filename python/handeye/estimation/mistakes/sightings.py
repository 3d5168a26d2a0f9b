"""What images and robot say of every view, as plain arrays that hypotheses can be tried on.

The robot's motion `A_k`, the pose `C_k` of the target in the image with its covariance from the pixels, and
how that pose depends on the camera's parameters. A hypothesis changes the arrays: it turns labels, pairs
again, scales.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from handeye import _core
from handeye.estimation.camera_prior import camera_prior
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.mounting import Mounting
from handeye.types.target import Target
from handeye.types.view import View

# Degrees of freedom with which the pixel noise of a view is drawn to the median of all views.
PRIOR_DEGREES = 20.0
# Errors of corners below this are shared by neighbours, however well they are found.
SMALLEST_VARIANCE_PX2 = 0.01**2
# The points of one image err together (blur, light, what the lens model leaves): more than so many do not
# average the error of the pose further down.
INDEPENDENT_POINTS = 20.0


@dataclass(frozen=True, eq=False)
class Sightings:
    """Views as poses.

    Parameters
    ----------
    mounting
        Tells on which side of A the flange is.
    motions
        (K, 4, 4) A of the chain.
    poses
        (K, 4, 4) `T_camera_target` from each image alone.
    covariances
        (K, 6, 6) of their left twists, from the noise of the pixels.
    sensitivities
        (K, 6, n): a change `dc` of the camera's parameters moves a pose to ``exp(-sensitivity dc) C``.
    camera_information, camera_gradient
        (n, n) and (n,): what calibration and images say of `dc`, whatever the robot did.
    centre_m
        (3,) centre of the points in the frame of the target.
    """

    mounting: Mounting
    motions: FloatArray
    poses: FloatArray
    covariances: FloatArray
    sensitivities: FloatArray
    camera_information: FloatArray
    camera_gradient: FloatArray
    centre_m: FloatArray

    @classmethod
    def of(cls, measurements: Measurements) -> "Sightings":
        """Take the sightings of measurements."""
        variances = pixel_variances(measurements)
        prior = camera_prior(measurements.camera)
        measurements = measurements.with_camera(prior.camera)
        free = list(prior.free)
        covariances: list[FloatArray] = []
        sensitivities: list[FloatArray] = []
        information, gradient = prior.information.copy(), np.zeros(len(free))
        for view, pose, variance in zip(measurements.views, measurements.poses, variances, strict=True):
            in_pose, in_camera, residual = _jacobians(measurements, view, pose.T_camera_target.matrix)
            in_camera = in_camera[:, free]
            covariance = np.linalg.inv(in_pose.T @ in_pose)
            sensitivity = covariance @ (in_pose.T @ in_camera)
            unexplained = in_camera - in_pose @ sensitivity
            information += unexplained.T @ unexplained / variance
            gradient += unexplained.T @ residual / variance
            covariances.append(covariance * variance * max(1.0, len(view) / INDEPENDENT_POINTS))
            sensitivities.append(sensitivity)
        count = len(measurements)
        return cls(
            mounting=measurements.mounting,
            motions=measurements.motions,
            poses=measurements.camera_poses,
            covariances=np.array(covariances).reshape(count, 6, 6),
            sensitivities=np.array(sensitivities).reshape(count, 6, len(free)),
            camera_information=information,
            camera_gradient=gradient,
            centre_m=target_centre(measurements.target),
        )

    def __len__(self) -> int:
        return len(self.motions)

    @cached_property
    def distance_m(self) -> float:
        """Median distance from the camera to the centre of the target."""
        return float(np.median(np.linalg.norm(centres(self.poses, self.centre_m), axis=1)))

    def with_motions(self, motions: FloatArray) -> "Sightings":
        """Return them with other motions (K, 4, 4) of the robot."""
        return replace(self, motions=motions)

    def with_poses(self, poses: FloatArray) -> "Sightings":
        """Return them with the same images read as other poses (K, 4, 4)."""
        return replace(self, poses=poses)

    def scaled(self, factor: float) -> "Sightings":
        """Return them with the target made larger by a factor."""
        scale = np.array([factor] * 3 + [1.0] * 3)
        poses = self.poses.copy()
        poses[:, :3, 3] *= factor
        return replace(
            self,
            poses=poses,
            covariances=self.covariances * np.outer(scale, scale),
            sensitivities=self.sensitivities * scale[:, np.newaxis],
            centre_m=self.centre_m * factor,
        )

    def paired(self, images: IndexArray, motions: IndexArray) -> "Sightings":
        """Return the pairs of `images[n]` with the robot pose of view `motions[n]`."""
        return replace(
            self,
            motions=self.motions[motions],
            poses=self.poses[images],
            covariances=self.covariances[images],
            sensitivities=self.sensitivities[images],
        )


def pixel_variances(measurements: Measurements) -> FloatArray:
    """(K,) variance of the pixels of each view in px^2, from its own residuals, drawn to the median."""
    points = measurements.point_counts
    degrees = np.maximum(2 * points - 6, 0.0)
    squared = np.array([pose.rmse_px**2 for pose in measurements.poses]) * points
    known = degrees > 0
    if not known.any():
        return np.full(len(measurements), 0.1**2)
    median = float(np.median(squared[known] / degrees[known]))
    shrunk = (squared + PRIOR_DEGREES * median) / (degrees + PRIOR_DEGREES)
    return np.maximum(shrunk, SMALLEST_VARIANCE_PX2)


def target_centre(target: Target) -> FloatArray:
    """(3,) centre of the points in the frame of the target, about which its turns are."""
    return target.points.mean(axis=0)


def centres(poses: FloatArray, centre_m: FloatArray) -> FloatArray:
    """(..., 3) the target's centre as seen at poses (..., 4, 4)."""
    return poses[..., :3, :3] @ centre_m + poses[..., :3, 3]


def inverted(poses: FloatArray) -> FloatArray:
    """(..., 4, 4) inverses of rigid transforms."""
    rotations = np.swapaxes(poses[..., :3, :3], -1, -2)
    inverse = np.zeros_like(poses)
    inverse[..., :3, :3] = rotations
    inverse[..., :3, 3] = -np.einsum("...ij,...j->...i", rotations, poses[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse


def twists(poses: FloatArray) -> FloatArray:
    """(..., 6) logarithms of transforms (..., 4, 4)."""
    return _core.se3_log(poses.reshape(-1, 4, 4)).reshape(*poses.shape[:-2], 6)


def _jacobians(
    measurements: Measurements, view: View, pose: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives of the pixels in the left twist (2N, 6) and the camera (2N, n), and residuals (2N,)."""
    camera, target = measurements.camera, measurements.target
    points, radii = target.points[view.point_ids], target.radii_m[view.point_ids]
    seen = points @ pose[:3, :3].T + pose[:3, 3]
    _, in_point, in_camera, _ = _core.project_jacobians(camera.lens, camera.parameters, seen)
    projected, _ = _core.project_features(camera.lens, camera.parameters, pose, points, radii)
    cross = np.zeros((len(seen), 3, 3))  # d(point)/d(left twist) = [I, -[point]x]
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = seen[:, 2], -seen[:, 1], seen[:, 0]
    cross -= np.swapaxes(cross, 1, 2)
    in_pose = np.concatenate([in_point, in_point @ cross], axis=2).reshape(-1, 6)
    return in_pose, in_camera.reshape(len(in_pose), -1), (view.pixels - projected).reshape(-1)
