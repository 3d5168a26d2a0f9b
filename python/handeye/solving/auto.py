"""The default model: robot and camera are known only roughly, and the data say how roughly.

Robot noise is marginalised on the flange side, on the base side or not at all; its levels and its side are
weighed by their restricted likelihood and the answer is averaged over them. Camera parameters have the
covariance of their calibration, inflated, as a prior. Every view has its own pixel noise.
"""

from dataclasses import dataclass, replace

import numpy as np

from handeye import _core
from handeye.solving.estimate import Estimate, Hypothesis, side_of_robot
from handeye.solving.initialize import check_views
from handeye.solving.measurements import Measurements, ViewPose
from handeye.solving.observability import undetermined
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName, Noise, RobotSide
from handeye.types.camera import Camera
from handeye.types.pose import Pose

# A camera calibration's covariance is a plain inverse of J'J: too small by about this factor in deviation.
CAMERA_INFLATION = 1.5
# Degrees of freedom below which regions would have no useful quantile.
FEWEST_DEGREES_OF_FREEDOM = 4.5
# A mirrored pose is looked at where it fits less than this many times worse than the best.
MIRROR_RATIO = 8.0
# Without a covariance: relative focal length, principal point as a share of the width, coefficients.
DEFAULT_FOCAL_SIGMA = 0.002
DEFAULT_CENTRE_SIGMA = 0.002
DEFAULT_DISTORTION_SIGMA = 0.02


@dataclass(frozen=True, eq=False)
class CameraPrior:
    """Free camera parameters and the information (n, n) around their calibrated values."""

    free: tuple[int, ...]
    information: FloatArray


def camera_prior(camera: Camera, inflation: float = CAMERA_INFLATION) -> CameraPrior:
    """Return the prior of a camera: its covariance inflated, or what an ordinary calibration reaches."""
    if camera.covariance is None:
        fx, fy, _, _ = camera.parameters[:4]
        centre = DEFAULT_CENTRE_SIGMA * camera.width_px
        deviations = [DEFAULT_FOCAL_SIGMA * fx, DEFAULT_FOCAL_SIGMA * fy, centre, centre]
        deviations += [DEFAULT_DISTORTION_SIGMA] * (len(camera.parameters) - 4)
        covariance = np.diag(np.square(deviations))
        inflation = 1.0
    else:
        covariance = camera.covariance
    free = tuple(int(i) for i in np.flatnonzero(np.diag(covariance) > 0))
    block = covariance[np.ix_(free, free)] * inflation**2
    # Scaled to a correlation, whose inverse is well conditioned whatever the units.
    deviations_free = np.sqrt(np.diag(block))
    correlation = block / np.outer(deviations_free, deviations_free)
    information = np.linalg.pinv(correlation, rcond=1e-12, hermitian=True)
    return CameraPrior(free, information / np.outer(deviations_free, deviations_free))


@dataclass(frozen=True)
class AutoOptions:
    """What may be changed of the default model; nothing needs to be.

    Parameters
    ----------
    exact_robot_probability
        Prior probability that the robot's poses are exact.
    sides
        Sides on which the robot's error may act.
    levels
        Translation (metres) and rotation (radians) deviations of the robot if known; None to find them.
    camera_inflation
        Factor on the deviations of the camera's calibration.
    free_camera
        Whether camera parameters are free at all.
    """

    exact_robot_probability: float = 1 / 3
    sides: tuple[RobotSide, ...] = (RobotSide.FLANGE, RobotSide.BASE)
    levels: tuple[float, float] | None = None
    camera_inflation: float = CAMERA_INFLATION
    free_camera: bool = True


@dataclass(frozen=True)
class AutoEstimator:
    """Estimates with the default model."""

    options: AutoOptions = AutoOptions()

    def __call__(self, measurements: Measurements, previous: Estimate | None = None) -> Estimate:
        """Estimate from these measurements, averaged over what the noise may be.

        Raises
        ------
        InputError
            Fewer than three views.
        """
        check_views(measurements)
        estimate = self._once(measurements, previous)
        unmirrored = prefer_consistent_poses(measurements, estimate)
        return estimate if unmirrored is None else self._once(unmirrored, estimate)

    def _once(self, measurements: Measurements, previous: Estimate | None) -> Estimate:
        options = self.options
        prior = camera_prior(measurements.camera, options.camera_inflation)
        if not options.free_camera:
            prior = CameraPrior((), np.zeros((0, 0)))
        compressed = _core.Compressed(
            measurements.problem, measurements.camera_poses, free_camera=list(prior.free) or None
        )
        mounting = measurements.mounting
        left_first = (
            [RobotSide.FLANGE, RobotSide.BASE]
            if mounting == "eye_in_hand"
            else [RobotSide.BASE, RobotSide.FLANGE]
        )
        sides = [
            name for name, side in zip(("left", "right"), left_first, strict=True) if side in options.sides
        ]
        posterior = compressed.estimate(
            camera_prior=prior.information if prior.free else None,
            start=None if previous is None else (previous.X.matrix, previous.Y.matrix),
            exact_probability=options.exact_robot_probability,
            sides=sides,
            levels=options.levels,
        )
        parameters = np.array(measurements.camera.parameters)
        parameters[list(prior.free)] += posterior.camera_delta
        camera = Camera(measurements.camera.lens, parameters, *measurements.camera.size_px)
        hypotheses = tuple(
            Hypothesis(
                probability, side_of_robot(mounting, side), translation, rotation, posterior.information(i)
            )
            for i, (side, translation, rotation, probability) in enumerate(posterior.hypotheses)
            if probability > 1e-4
        )
        sigma_px = np.sqrt(posterior.variances_px2)
        X, Y = Pose(posterior.x), Pose(posterior.y)
        noise = _noise(sigma_px, hypotheses)
        return Estimate(
            mounting=mounting,
            target=measurements.target,
            X=X,
            Y=Y,
            camera=camera,
            covariance=posterior.covariance,
            hypotheses=hypotheses,
            noise=noise,
            model=ModelName.AUTO,
            start=posterior.origin,
            ending="converged_average",
            iterations=0,
            candidate_sigma_px=float(np.median(sigma_px)),
            free_camera=prior.free,
            unobservable=undetermined(measurements, X, Y, noise),
            degrees_of_freedom=max(posterior.degrees_of_freedom, FEWEST_DEGREES_OF_FREEDOM),
        )


def _noise(sigma_px: FloatArray, hypotheses: tuple[Hypothesis, ...]) -> Noise:
    """Sum the hypotheses up: the likeliest side, and its levels as geometric means."""
    evidence = {side.value: 0.0 for side in RobotSide}
    for hypothesis in hypotheses:
        evidence[hypothesis.robot_side.value] += hypothesis.probability
    side = RobotSide(max(evidence, key=lambda name: evidence[name]))
    pixels = tuple(float(sigma) for sigma in sigma_px)
    if side is RobotSide.NONE:
        return Noise(pixels, evidence=evidence, how="restricted likelihood, averaged over sides and levels")
    own = [h for h in hypotheses if h.robot_side is side]
    weights = np.array([h.probability for h in own])
    translation = np.exp(np.average(np.log([h.robot_translation_m for h in own]), weights=weights))
    rotation = np.exp(np.average(np.log([h.robot_rotation_rad for h in own]), weights=weights))
    return Noise(
        pixels,
        side,
        float(translation),
        float(rotation),
        how="restricted likelihood, averaged over sides and levels",
        evidence=evidence,
    )


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
