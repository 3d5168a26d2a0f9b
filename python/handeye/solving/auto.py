"""The default model: robot and camera are known only roughly, and the data say how roughly.

Robot noise is marginalised on the flange side, on the base side or not at all; its levels and its side are
weighed by their restricted likelihood and the answer is averaged over them. Camera parameters have the
covariance of their calibration, inflated, as a prior. Every view has its own pixel noise. Where the arm's
kinematics are known, noise of its joints and joints displaced on their links are further hypotheses, and
offsets of its joints are parameters.
"""

from dataclasses import dataclass, replace

import numpy as np

from handeye import _core
from handeye.solving.estimate import Estimate, Hypothesis, side_of_robot
from handeye.solving.initialize import check_views
from handeye.solving.joints import JointModel
from handeye.solving.links import LinkModel
from handeye.solving.measurements import Measurements, ViewPose
from handeye.solving.observability import undetermined
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName, Noise, RobotSide
from handeye.types.camera import Camera
from handeye.types.kinematics import Kinematics
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose

# A camera calibration's covariance is a plain inverse of J'J: too small by about this factor in deviation.
CAMERA_INFLATION = 1.1
# No view's pixel noise is believed to be less. Even on rendered pictures corners err by a hundredth of a
# pixel or so, much of it shared by neighbouring corners: such an error no number of points averages out.
LEAST_PIXEL_SIGMA = 0.01
# Degrees of freedom below which regions would have no useful quantile.
FEWEST_DEGREES_OF_FREEDOM = 4.5
# Flange poses further apart than this have little of a smooth error in common; a chord of 2 is half a turn.
LIKENESS_M, LIKENESS_CHORD = 1.0, 2.0
# A mirrored pose is looked at where it fits less than this many times worse than the best.
MIRROR_RATIO = 8.0
# Hypotheses about the noise that are less likely are left aside.
LEAST_PROBABILITY = 1e-4
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


def posture_likeness(measurements: Measurements) -> FloatArray:
    """Return how far a smooth error of the robot is the same in two views, (K, K) correlations.

    It falls off as a Gaussian of the distance between the flange's positions and of the chord between its
    rotations, 2 sin(angle / 2); of the angle itself it would be no correlation.
    """
    poses = np.array([view.T_base_flange.matrix for view in measurements.views]).reshape(-1, 4, 4)
    positions, rotations = poses[:, :3, 3], poses[:, :3, :3]
    squared_m2 = ((positions[:, np.newaxis] - positions) ** 2).sum(axis=2)
    squared_chord = np.maximum(3 - np.einsum("iab,jab->ij", rotations, rotations), 0)
    likeness = np.exp(-0.5 * (squared_m2 / LIKENESS_M**2 + squared_chord / LIKENESS_CHORD**2))
    np.fill_diagonal(likeness, 1.0)
    return likeness


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
    smooth
        Whether the robot's error may be one that changes smoothly with the posture.
    kinematics
        The arm, if it is known; every view must then have joint positions.
    links
        Whether the joints of a known arm may be displaced on their links. Not where any level is given.
    joint_noise_rad
        Standard deviation of the noise of the joints if known; the robot then errs in nothing else. None to
        find it, and to weigh it against noise of flange and base.
    joint_offset_rad
        Standard deviation of the offsets of the joints if known, zero for none; None to find it.
    """

    exact_robot_probability: float = 1 / 3
    sides: tuple[RobotSide, ...] = (RobotSide.FLANGE, RobotSide.BASE)
    levels: tuple[float, float] | None = None
    camera_inflation: float = CAMERA_INFLATION
    free_camera: bool = True
    smooth: bool = True
    kinematics: Kinematics | None = None
    links: bool = True
    joint_noise_rad: float | None = None
    joint_offset_rad: float | None = None

    @property
    def weighs_links(self) -> bool:
        """Whether joints displaced on their links are among the hypotheses."""
        known = (self.levels, self.joint_noise_rad, self.joint_offset_rad)
        return self.links and self.kinematics is not None and known == (None, None, None)


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
        arm = None if options.kinematics is None else JointModel.of(options.kinematics, measurements)
        links = None
        if options.kinematics is not None and options.weighs_links:
            links = LinkModel.of(options.kinematics, measurements)
        posterior = compressed.estimate(
            camera_prior=prior.information if prior.free else None,
            start=None if previous is None else (previous.X.matrix, previous.Y.matrix),
            exact_probability=options.exact_robot_probability,
            sides=sides,
            levels=options.levels,
            joints=None if arm is None else arm.errors(options.joint_noise_rad, options.joint_offset_rad),
            links=None if links is None else links.errors(),
            likeness=None if options.levels or not options.smooth else posture_likeness(measurements),
            floor_px2=LEAST_PIXEL_SIGMA**2,
        )
        parameters = np.array(measurements.camera.parameters)
        parameters[list(prior.free)] += posterior.camera_delta
        camera = Camera(measurements.camera.lens, parameters, *measurements.camera.size_px)
        weighed = enumerate(zip(posterior.hypotheses, posterior.joint_levels, strict=True))
        hypotheses = tuple(
            _hypothesis(given, joint_rad, posterior.information(rank), mounting, arm, links)
            for rank, (given, (joint_rad, _)) in weighed
            if given[3] > LEAST_PROBABILITY
        )
        sigma_px = np.sqrt(posterior.variances_px2)
        X, Y = Pose(posterior.x), Pose(posterior.y)
        noise = replace(_noise(sigma_px, hypotheses, arm), smooth_probability=posterior.smooth_probability)
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
            kinematics=options.kinematics,
            free_joints=() if arm is None else arm.free,
            joint_offsets=() if arm is None else arm.offsets(posterior.joint_offsets, posterior.covariance),
            link_errors=() if links is None else links.named(np.array(posterior.link_twists)),
            arm_correction=None
            if arm is None
            else arm.correction(posterior.joint_offsets, posterior.link_twists),
        )


def _hypothesis(
    given: tuple[str, float, float, float],
    joint_rad: float,
    information: FloatArray,
    mounting: Mounting,
    arm: JointModel | None,
    links: LinkModel | None,
) -> Hypothesis:
    side, translation, rotation, probability = given
    deviations: tuple[float, ...] = ()
    if arm is not None and joint_rad > 0:
        translation, rotation = arm.lever_m * joint_rad, arm.turn * joint_rad
        deviations = arm.deviations(joint_rad)
    if links is not None and side == RobotSide.LINKS:
        translation, rotation = links.at_flange(translation, rotation)
    return Hypothesis(
        probability, side_of_robot(mounting, side), translation, rotation, information, deviations
    )


def _noise(sigma_px: FloatArray, hypotheses: tuple[Hypothesis, ...], arm: JointModel | None) -> Noise:
    """Sum the hypotheses up: the likeliest side, and its levels as geometric means."""
    of_arms = (RobotSide.JOINTS, RobotSide.LINKS)
    evidence = {side.value: 0.0 for side in RobotSide if side not in of_arms or arm is not None}
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
        joint_rad=float(translation) / arm.lever_m if arm is not None and side is RobotSide.JOINTS else 0.0,
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
