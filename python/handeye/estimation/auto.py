"""The default model: robot, camera and board are known only roughly, and the views say how roughly.

One linear mixed model (`handeye-core`, room `estimation`): every view is the pose of the target in its image
with that pose's covariance; what is constant is a parameter with a prior, what is new at every station is
noise; all levels are found together by restricted likelihood, and the answer is averaged over what they may
be. See `docs/model.md`.
"""

from dataclasses import dataclass, replace

import numpy as np

from handeye import _core
from handeye.estimation.arm import ArmModel, velocities
from handeye.estimation.attribution import Levels, arm_constants, attribution, noise_of
from handeye.estimation.camera_prior import CameraPrior, camera_prior
from handeye.estimation.estimate import Estimate
from handeye.estimation.initialize import check_views
from handeye.estimation.measurements import Measurements, ViewPose
from handeye.estimation.observability import undetermined
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.types.camera import Camera
from handeye.types.kinematics import Kinematics
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose

# No view's pixel noise is believed to be less. Even on rendered pictures corners err by a hundredth of a
# pixel or so, much of it shared by neighbouring corners: such an error no number of points averages out.
LEAST_PIXEL_SIGMA = 0.01
# Degrees of freedom of the other views' pixel noise that a view's own is drawn to.
PIXEL_PRIOR_DEGREES = 20.0
# Pairs of nodes that the answer is averaged over.
NODE_PAIRS = 16
MOST_LINEARISATIONS = 8
# A mirrored pose is looked at where it fits less than this many times worse than the best.
MIRROR_RATIO = 8.0
# Beyond this, in pixels anywhere in the image, what was measured through the camera is measured again.
LARGEST_CAMERA_SHIFT_PX = 2.0
MOST_CAMERAS = 4


@dataclass(frozen=True)
class AutoOptions:
    """What may be said of a cell beyond its views; nothing needs to be.

    Parameters
    ----------
    kinematics
        The arm, if it is known; every view must then have joint positions.
    camera_fixed
        Whether the camera is held as it is given.
    """

    kinematics: Kinematics | None = None
    camera_fixed: bool = False


@dataclass(frozen=True)
class AutoEstimator:
    """Estimates with the default model."""

    options: AutoOptions = AutoOptions()

    def __call__(self, measurements: Measurements, previous: Estimate | None = None) -> Estimate:
        """Estimate from these measurements, averaged over what the noise may be.

        Raises
        ------
        InputError
            Fewer than three views, or views without the joint positions that the arm needs.
        """
        check_views(measurements)
        prior = camera_prior(measurements.camera, fixed=self.options.camera_fixed)
        if prior.camera is not measurements.camera:
            measurements = measurements.through(prior.camera)
        estimate = self._once(measurements, prior, previous)
        for _ in range(MOST_CAMERAS):
            if _largest_shift_px(prior.camera, estimate.camera) < LARGEST_CAMERA_SHIFT_PX:
                break
            measurements = measurements.through(estimate.camera)
            prior = prior.moved(estimate.camera)
            estimate = self._once(measurements, prior, estimate)
        unmirrored = prefer_consistent_poses(measurements, estimate)
        return estimate if unmirrored is None else self._once(unmirrored, prior, estimate)

    def _once(self, measurements: Measurements, prior: CameraPrior, previous: Estimate | None) -> Estimate:
        arm = None if self.options.kinematics is None else ArmModel.of(self.options.kinematics)
        if arm is not None:
            arm.check(measurements)
        seen = _core.PoseMeasurements(
            measurements.problem,
            measurements.camera_poses,
            free_camera=list(prior.free) or None,
            board_scale=True,
            sigmas_px=[
                None if view.sigmas_px is None else np.hypot(view.sigmas_px, LEAST_PIXEL_SIGMA)
                for view in measurements.views
            ],
        )
        variances = seen.shrunk_variances(prior_degrees=PIXEL_PRIOR_DEGREES, floor_px2=LEAST_PIXEL_SIGMA**2)
        shared = seen.shared_error(variances)
        posterior = self._posterior(
            measurements, prior, arm, (seen, [shared * variance for variance in variances]), previous
        )
        return _estimate(measurements, prior, arm, posterior, np.sqrt(variances), float(np.sqrt(shared)))

    def _posterior(
        self,
        measurements: Measurements,
        prior: CameraPrior,
        arm: ArmModel | None,
        pixels: tuple[_core.PoseMeasurements, list[float]],
        previous: Estimate | None,
    ) -> _core.Posterior:
        in_hand = measurements.mounting is Mounting.EYE_IN_HAND
        count = len(prior.free)
        belief = (prior.information, prior.mean, prior.inflated) if count else None
        seen, variances = pixels
        of_arm = None
        if arm is not None:
            by_joint, by_link = arm.at_flange(measurements.joints)
            of_arm = (by_joint, by_link, arm.scales.tolist(), list(arm.free), list(arm.lengths))
        return _core.estimate_cell(
            np.array([view.T_base_flange.matrix for view in measurements.views]),
            [(in_hand, count, prior.from_these_pixels, belief)],
            [not in_hand],
            [(0, 0, seen, list(range(len(measurements))), variances)],
            velocities=velocities(measurements),
            arm=of_arm,
            board_scale=True,
            start=None if previous is None else (previous.X.matrix[None], previous.Y.matrix[None]),
            pairs=NODE_PAIRS,
            most_rounds=MOST_LINEARISATIONS,
        )


def _estimate(
    measurements: Measurements,
    prior: CameraPrior,
    arm: ArmModel | None,
    posterior: _core.Posterior,
    sigma_px: FloatArray,
    shared: float,
) -> Estimate:
    theta = np.asarray(posterior.theta)
    parameters = np.array(prior.camera.parameters)
    first = 12 + len(prior.free)
    parameters[list(prior.free)] += theta[12:first]
    X, Y = Pose(posterior.x[0]), Pose(posterior.y[0])
    noise = replace(noise_of(posterior, measurements, arm, sigma_px), pixel_shared=shared)
    levels = Levels.of(posterior)
    constants, of_constants = arm_constants(posterior)
    correction = None if arm is None else arm.correction(constants)
    rounds, _, at_rest = posterior.effort
    # What planning predicts with: a lag between clocks is no part of it.
    kept = [
        *range(first + 1),
        *(i for name, a, b in posterior.constants if name in {"joint_offsets", "links"} for i in range(a, b)),
    ]
    return Estimate(
        mounting=measurements.mounting,
        target=measurements.target,
        X=X,
        Y=Y,
        camera=Camera(prior.camera.lens, parameters, *prior.camera.size_px),
        covariance=np.asarray(posterior.covariance)[np.ix_(kept, kept)],
        information=np.asarray(posterior.information)[np.ix_(kept, kept)],
        noise=noise,
        model=ModelName.AUTO,
        start=posterior.origin,
        ending="converged_average" if at_rest else "iteration_limit",
        iterations=rounds,
        candidate_sigma_px=shared * float(np.median(sigma_px)),
        station_noise=levels.station_noise(),
        free_camera=prior.free,
        board_scale=float(theta[first]),
        unobservable=undetermined(measurements, X, Y, noise),
        degrees_of_freedom=posterior.degrees_of_freedom[0],
        arm=arm,
        joint_offsets=() if arm is None else arm.offsets(constants, of_constants),
        link_errors=() if arm is None or correction is None else arm.link_errors(correction.displacements),
        arm_correction=correction,
        attribution=attribution(posterior, measurements, prior, arm, noise),
    )


def _largest_shift_px(before: Camera, after: Camera) -> float:
    """How far pixels move between two cameras of one lens, at most over a grid of rays in the image."""
    width, height = before.size_px
    u, v = np.meshgrid(np.linspace(0, width - 1, 7), np.linspace(0, height - 1, 7))
    fx, fy, cx, cy = before.parameters[:4]
    rays = np.stack([(u.ravel() - cx) / fx, (v.ravel() - cy) / fy, np.ones(u.size)], axis=1)
    first, seen = before.project(rays)
    second, still = after.project(rays)
    both = seen & still
    if not both.any():
        return float("inf")
    return float(np.linalg.norm((second - first)[both], axis=1).max())


def prefer_consistent_poses(measurements: Measurements, estimate: Estimate) -> Measurements | None:
    """Return the measurements with mirrored poses where the chain agrees better with them; None if nowhere.

    A plane seen from afar has two poses that fit almost equally; the other views decide.
    """
    poses: list[ViewPose] = []
    changed = False
    predicted = estimate.X.matrix @ measurements.motions @ estimate.Y.matrix
    for pose, chain in zip(measurements.poses, predicted, strict=True):
        other = pose.mirrored
        if other is not None and pose.ambiguity_ratio < MIRROR_RATIO:
            to_chain = Pose(chain).inverse()
            if (to_chain @ other[0]).rotation_angle_rad < (
                to_chain @ pose.T_camera_target
            ).rotation_angle_rad:
                pose = ViewPose(other[0], other[1], pose.information, (pose.T_camera_target, pose.rmse_px))  # noqa: PLW2901
                changed = True
        poses.append(pose)
    return replace(measurements, poses=tuple(poses)) if changed else None
