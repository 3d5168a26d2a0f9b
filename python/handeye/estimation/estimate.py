"""What is believed after some views: a value that planning and reporting build on."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from handeye import _core
from handeye.errors import DegenerateError
from handeye.estimation.arm import ArmModel
from handeye.estimation.confidence import Within, within
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import (
    ArmCorrection,
    Finding,
    JointOffset,
    LinkError,
    ModelName,
    Noise,
    RobotSide,
    Unobservable,
)
from handeye.types.camera import Camera
from handeye.types.kinematics import Kinematics
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose
from handeye.types.probing import Tip
from handeye.types.target import Target


def isotropic_root(translation_m: float, rotation_rad: float) -> FloatArray:
    """Return the square root (6, 6) of the covariance of a twist with these deviations per axis."""
    return np.diag([translation_m] * 3 + [rotation_rad] * 3)


@dataclass(frozen=True)
class StationNoise:
    """Standard deviations of what is new in the robot's error at every station.

    Parameters
    ----------
    flange, base
        Translation (metres) and rotation (radians) per axis of a twist in the frame of the flange, and of the
        base.
    joint_rad
        Of every joint, radians; metres for one that slides times `SLIDING_M_PER_RAD`.
    """

    flange: tuple[float, float] = (0.0, 0.0)
    base: tuple[float, float] = (0.0, 0.0)
    joint_rad: float = 0.0

    def roots(self, mounting: Mounting) -> tuple[FloatArray | None, FloatArray | None]:
        """Square roots (6, 6) of the covariances on the left and on the right of A; None for none."""
        flange, base = (isotropic_root(*side) if any(side) else None for side in (self.flange, self.base))
        return (flange, base) if mounting is Mounting.EYE_IN_HAND else (base, flange)


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters and their uncertainty after some views.

    Parameters
    ----------
    X, Y, camera
        The current answer.
    covariance
        (n, n) covariance of `[xi_x, xi_y, free camera parameters, scale of the board, constants of the arm]`;
        the last two only where they are parameters.
    information
        (n, n) what that of a further view adds to, at the likeliest noise. Errors of an arm that is not
        described come again in every view, and no view lessens them: they are in the covariance only.
    station_noise
        What is new in the robot's error at every station, at the likeliest noise.
    expected_noise
        The same, root mean square over what the noise may be: what the robot adds when it works.
    noise
        The noise levels behind the answer, for people.
    free_camera
        Indices of the free camera parameters.
    board_scale
        By how much the board is larger than stated, relative; None where it is taken as stated.
    candidate_sigma_px
        Pixel noise expected of a further view.
    arm
        The arm, if it is known.
    joint_offsets, link_errors, arm_correction
        What was found of the arm; empty and None without one.
    attribution
        What explains the misfit; None under the paper's model.
    tips
        Tips of touches where they were found, by name.
    unobservable
        Directions of X and Y that the views leave open; a weak prior stands in for them.

    Examples
    --------
    >>> estimate.covariance.shape[0] >= 12
    True
    >>> estimate.within_95.translation_mm < 10.0
    True
    """

    mounting: Mounting
    target: Target
    X: Pose
    Y: Pose
    camera: Camera
    covariance: FloatArray
    information: FloatArray
    noise: Noise
    model: ModelName
    start: str
    ending: str
    iterations: int
    candidate_sigma_px: float
    station_noise: StationNoise = field(default_factory=StationNoise)
    expected_noise: StationNoise = field(default_factory=StationNoise)
    free_camera: tuple[int, ...] = ()
    board_scale: float | None = None
    unobservable: tuple[Unobservable, ...] = ()
    degrees_of_freedom: float = float("inf")
    arm: ArmModel | None = None
    joint_offsets: tuple[JointOffset, ...] = ()
    link_errors: tuple[LinkError, ...] = ()
    arm_correction: ArmCorrection | None = None
    attribution: Finding | None = None
    tips: dict[str, Tip] = field(default_factory=dict[str, Tip])

    @property
    def determined(self) -> bool:
        """Whether the views determine the answer without prior belief about X and Y."""
        return not self.unobservable

    @property
    def kinematics(self) -> Kinematics | None:
        """The arm, if it is known."""
        return None if self.arm is None else self.arm.kinematics

    @property
    def entropy(self) -> float:
        """Entropy of all parameters in nats: `1/2 ln((2 pi e)^n |Sigma|)` (paper, section IV)."""
        return _entropy(self.covariance)

    @property
    def chain_entropy(self) -> float:
        """Entropy of X and Y alone, in nats: comparable between models with and without camera parameters."""
        return _entropy(self.covariance[:12, :12])

    @cached_property
    def within_95(self) -> Within:
        """How far off the answer may be, with 95 % probability."""
        return within(self.hand_eye_covariance, self.degrees_of_freedom)

    @property
    def hand_eye_covariance(self) -> FloatArray:
        """(6, 6) covariance of the twist of X."""
        return self.covariance[:6, :6]

    def corrected(self, measurements: Measurements) -> Measurements:
        """Return measurements with robot poses as the arm stands by what is known of it; see `corrected`."""
        return corrected(measurements, self.kinematics, self.arm_correction)

    def poses_as_built(self, T_base_flange: FloatArray, joints: FloatArray) -> FloatArray:
        """(K, 4, 4) where the flange stands when it reports (K, 4, 4) at joints (K, n); see the function."""
        if self.kinematics is None or self.arm_correction is None:
            return T_base_flange
        return poses_as_built(self.kinematics, self.arm_correction, T_base_flange, joints)


def _entropy(covariance: FloatArray) -> float:
    sign, log_determinant = np.linalg.slogdet(covariance)
    if sign <= 0:
        return float("inf")
    return 0.5 * float(len(covariance) * np.log(2 * np.pi * np.e) + log_determinant)


def corrected(
    measurements: Measurements, kinematics: Kinematics | None, correction: ArmCorrection | None
) -> Measurements:
    """Return measurements with robot poses as the arm stands by what was found of its joints and links.

    As they are where the arm is not known, or a view has no joint positions.
    """
    if kinematics is None or correction is None or any(v.joints_rad is None for v in measurements.views):
        return measurements
    reported = np.array([view.T_base_flange.matrix for view in measurements.views]).reshape(-1, 4, 4)
    built = poses_as_built(kinematics, correction, reported, measurements.joints)
    poses = [Pose(pose) for pose in built]
    views = zip(measurements.views, poses, strict=True)
    return replace(measurements, views=tuple(replace(view, T_base_flange=pose) for view, pose in views))


def poses_as_built(
    kinematics: Kinematics, correction: ArmCorrection, T_base_flange: FloatArray, joints: FloatArray
) -> FloatArray:
    """(K, 4, 4) where the flange stands when it reports (K, 4, 4) at joints (K, n), by what was found."""
    to_hand = Mounting.EYE_TO_HAND
    twists = kinematics.motion_jacobians(to_hand, joints) @ correction.joint_offsets
    twists += kinematics.link_jacobians(to_hand, joints) @ correction.displacements
    return _core.se3_exp(twists) @ T_base_flange


def side_of_chain(mounting: Mounting, side: RobotSide) -> str | None:
    """Return which side of A in the chain a side of the robot is: "left", "right", or None for no noise.

    Noise of joints and links counts as noise of the flange.
    """
    if side is RobotSide.NONE:
        return None
    flange_is_left = mounting is Mounting.EYE_IN_HAND
    return "right" if (side is RobotSide.BASE) == flange_is_left else "left"


class Estimator(Protocol):
    """Turns measurements into an estimate; a previous one helps as a start.

    Examples
    --------
    >>> estimator = AutoEstimator()  # is one; so is `paper_estimate`
    >>> estimator(measurements).model.value, paper_estimate(measurements).model.value
    ('auto', 'paper')
    """

    def __call__(self, measurements: Measurements, previous: Estimate | None = None) -> Estimate:
        """Estimate from these measurements."""
        ...


def answering(estimate: Estimate) -> Estimator:
    """Return what answers with an estimate that is there already."""

    def answer(measurements: Measurements, previous: Estimate | None = None) -> Estimate:
        del measurements, previous
        return estimate

    return answer


def regular_information(covariance: FloatArray) -> FloatArray:
    """Return the inverse of a covariance.

    Raises
    ------
    DegenerateError
        It is singular.
    """
    scale = np.sqrt(np.diag(covariance))
    try:
        inverse = np.linalg.inv(covariance / np.outer(scale, scale))
    except np.linalg.LinAlgError as error:
        raise DegenerateError("the covariance is singular") from error
    return np.asarray(inverse / np.outer(scale, scale), dtype=np.float64)
