"""Pose measurements as plain arrays that hypotheses about data faults can be tried on.

Where the robot stood, which image was taken there and the pose that it shows. A hypothesis changes the
arrays: it turns labels, or pairs images and poses again.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from handeye import _core
from handeye.estimation.camera_prior import CameraPrior, camera_prior
from handeye.estimation.measurements import Measurements
from handeye.estimation.pixels import LEAST_PIXEL_SIGMA, PIXEL_PRIOR_DEGREES
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.mounting import Mounting
from handeye.types.target import Target


@dataclass(frozen=True, eq=False)
class Stations:
    """Where the robot stood and what was seen there.

    Parameters
    ----------
    mounting
        Tells on which side of A the flange is.
    robot
        (K, 4, 4) `T_base_flange`.
    images
        (K,) which image was taken there.
    poses
        (K, 4, 4) `T_camera_target` that it shows.
    seen
        All images as pose measurements, at 1 px.
    variances_px2
        Variance of the pixels of each image, as the estimate has it.
    camera
        What is believed of the camera.
    centre_m
        (3,) centre of the points in the frame of the target.
    """

    mounting: Mounting
    robot: FloatArray
    images: IndexArray
    poses: FloatArray
    seen: _core.PoseMeasurements
    variances_px2: list[float]
    camera: CameraPrior
    centre_m: FloatArray

    @classmethod
    def of(cls, measurements: Measurements) -> "Stations":
        """Take the stations of measurements, one image each."""
        prior = camera_prior(measurements.camera)
        measurements = measurements.with_camera(prior.camera)
        seen = _core.PoseMeasurements(
            measurements.problem,
            measurements.camera_poses,
            free_camera=list(prior.free) or None,
            board_scale=True,
        )
        variances = seen.shrunk_variances(prior_degrees=PIXEL_PRIOR_DEGREES, floor_px2=LEAST_PIXEL_SIGMA**2)
        shared = seen.shared_error(variances)
        return cls(
            mounting=measurements.mounting,
            robot=np.array([view.T_base_flange.matrix for view in measurements.views]),
            images=np.arange(len(measurements)),
            poses=measurements.camera_poses,
            seen=seen,
            variances_px2=[shared * variance for variance in variances],
            camera=prior,
            centre_m=target_centre(measurements.target),
        )

    def __len__(self) -> int:
        return len(self.robot)

    @cached_property
    def motions(self) -> FloatArray:
        """(K, 4, 4) A of the chain."""
        return inverted(self.robot) if self.mounting is Mounting.EYE_IN_HAND else self.robot

    @cached_property
    def distance_m(self) -> float:
        """Median distance from the camera to the centre of the target."""
        return float(np.median(np.linalg.norm(centres(self.poses, self.centre_m), axis=1)))

    def with_poses(self, poses: FloatArray) -> "Stations":
        """Return them with the same images read as other poses (K, 4, 4)."""
        return replace(self, poses=poses)

    def paired(self, images: IndexArray, stations: IndexArray) -> "Stations":
        """Return the pairs of what was seen at `images[n]` with the robot at `stations[n]`."""
        return replace(self, robot=self.robot[stations], images=self.images[images], poses=self.poses[images])


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
