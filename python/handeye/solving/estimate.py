"""What is believed after some views: the values that planning and reporting build on."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from handeye import _core
from handeye.errors import DegenerateError
from handeye.solving.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import (
    ArmCorrection,
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
from handeye.types.target import Target

# Hypotheses about the robot's noise that a gain is averaged over: the likeliest, up to this share and number.
AVERAGED_SHARE = 0.95
AVERAGED_COUNT = 12
# Least known directions of X and Y along which sigma points are laid, a metre and a radian weighing alike.
SIGMA_POINT_DIRECTIONS = 4


@dataclass(frozen=True)
class Sight:
    """What a candidate must show of the target to count.

    Parameters
    ----------
    margin_px
        Distance of every counted point from the border of the image.
    fewest
        Fewest points in sight; None for all of the target.
    known
        The candidates are recorded views that are known to show the target: nothing is checked but that the
        lens can see it at the current estimate.
    """

    margin_px: float = 0.0
    fewest: int | None = None
    known: bool = False


def side_of_chain(mounting: Mounting, side: RobotSide) -> str | None:
    """Return which side of A in the chain a side of the robot is: "left", "right", or None for no noise.

    Noise of the joints counts as noise of the flange, where it is not known how they move it, and so do
    errors of the links, of which a further view brings some that are new.
    """
    if side is RobotSide.NONE:
        return None
    flange_is_left = mounting is Mounting.EYE_IN_HAND
    return "right" if (side is RobotSide.BASE) == flange_is_left else "left"


def side_of_robot(mounting: Mounting, side: str) -> RobotSide:
    """Return which side of the robot a side of A is; all but left and right are what they are called."""
    if side in {"none", "joints", "links"}:
        return RobotSide(side)
    flange_is_left = mounting is Mounting.EYE_IN_HAND
    return RobotSide.FLANGE if (side == "left") == flange_is_left else RobotSide.BASE


def isotropic_root(translation_m: float, rotation_rad: float) -> FloatArray:
    """Return the square root (6, 6) of the covariance of a twist with these deviations per axis."""
    return np.diag([translation_m] * 3 + [rotation_rad] * 3)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """What the robot's noise may be, how probable that is, and the information (n, n) under it.

    Parameters
    ----------
    robot_translation_m, robot_rotation_rad
        Standard deviations per axis; of the flange on average, if the noise is in the joints or links.
    joint_deviations
        Standard deviation of each joint (radians, metres), if the noise is in the joints.
    """

    probability: float
    robot_side: RobotSide
    robot_translation_m: float
    robot_rotation_rad: float
    information: FloatArray
    joint_deviations: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters and their uncertainty after some views.

    Parameters
    ----------
    X, Y, camera
        The current answer.
    covariance
        (n, n) covariance of `[xi_x, xi_y, free camera parameters, free joint offsets]`.
    hypotheses
        What the robot's noise may be, likeliest first; one that is exact under the paper's model.
    free_camera
        Indices of the free camera parameters.
    candidate_sigma_px
        Pixel noise expected of a further view.
    kinematics, free_joints, joint_offsets
        The arm, if it is known, which of its joints have an offset that is a parameter, and what it is.
    link_errors
        How the joints of a known arm most likely sit on their links; empty without one.
    arm_correction
        The same as arrays; None without an arm.
    unobservable
        Directions of X and Y that the views leave open; a weak prior stands in for them.
    """

    mounting: Mounting
    target: Target
    X: Pose
    Y: Pose
    camera: Camera
    covariance: FloatArray
    hypotheses: tuple[Hypothesis, ...]
    noise: Noise
    model: ModelName
    start: str
    ending: str
    iterations: int
    candidate_sigma_px: float
    free_camera: tuple[int, ...] = ()
    unobservable: tuple[Unobservable, ...] = ()
    degrees_of_freedom: float = float("inf")
    kinematics: Kinematics | None = None
    free_joints: tuple[int, ...] = ()
    joint_offsets: tuple[JointOffset, ...] = ()
    link_errors: tuple[LinkError, ...] = ()
    arm_correction: ArmCorrection | None = None

    @property
    def determined(self) -> bool:
        """Whether the views determine the answer without prior belief about X and Y."""
        return not self.unobservable

    @property
    def entropy(self) -> float:
        """Entropy of all parameters in nats: `1/2 ln((2 pi e)^n |Sigma|)` (paper, section IV)."""
        sign, log_determinant = np.linalg.slogdet(self.covariance)
        if sign <= 0:
            return float("inf")
        return 0.5 * float(len(self.covariance) * np.log(2 * np.pi * np.e) + log_determinant)

    @property
    def chain_entropy(self) -> float:
        """Entropy of X and Y alone, in nats: comparable between models with and without camera parameters."""
        sign, log_determinant = np.linalg.slogdet(self.covariance[:12, :12])
        return 0.5 * float(12 * np.log(2 * np.pi * np.e) + log_determinant) if sign > 0 else float("inf")

    @property
    def hand_eye_covariance(self) -> FloatArray:
        """(6, 6) covariance of the twist of X."""
        return self.covariance[:6, :6]

    @cached_property
    def averaged(self) -> tuple[tuple[float, Hypothesis], ...]:
        """The hypotheses that predictions are averaged over, with weights that sum to one."""
        chosen: list[tuple[float, Hypothesis]] = []
        mass = 0.0
        for hypothesis in self.hypotheses[:AVERAGED_COUNT]:
            chosen.append((hypothesis.probability, hypothesis))
            mass += hypothesis.probability
            if mass >= AVERAGED_SHARE:
                break
        return tuple((probability / mass, hypothesis) for probability, hypothesis in chosen)

    def predictor(self, hypothesis: Hypothesis, sight: Sight) -> _core.Predictor:
        """Return what predicts candidate views from this estimate under one hypothesis."""
        side, root = self._robot_error(hypothesis)
        width, height = self.camera.size_px
        return _core.Predictor(
            self.camera.lens,
            self.camera.parameters,
            self.target.points,
            self.target.radii_m,
            self.X.matrix,
            self.Y.matrix,
            pixel_sigma=self.candidate_sigma_px,
            robot_side=side,
            robot_root=root,
            free_camera=list(self.free_camera) or None,
            free_joints=list(self.free_joints) or None,
            joint_noise=list(hypothesis.joint_deviations) or None,
            image_size=None if sight.known else (width, height),
            margin_px=sight.margin_px,
            fewest=1 if sight.known else sight.fewest or self.target.point_count,
        )

    def corrected(self, measurements: Measurements) -> Measurements:
        """Return measurements with robot poses as the arm stands by what is known of it; see `corrected`."""
        return corrected(measurements, self.kinematics, self.arm_correction)

    def _robot_error(self, hypothesis: Hypothesis) -> tuple[str | None, FloatArray | None]:
        """Side of the chain and root (6, 6) of the covariance of the robot's error; None if it has none."""
        side = side_of_chain(self.mounting, hypothesis.robot_side)
        if side is None:
            return None, None
        return side, isotropic_root(hypothesis.robot_translation_m, hypothesis.robot_rotation_rad)

    def jacobians(self, joints: FloatArray | None) -> FloatArray | None:
        """(N, 6, n) how joints at positions (N, n) move A; None where arm or positions are not known."""
        if self.kinematics is None or joints is None:
            return None
        return self.kinematics.motion_jacobians(self.mounting, joints)

    def gains(
        self,
        criterion: _core.Criterion,
        motions: FloatArray,
        sight: Sight,
        *,
        joints: FloatArray | None = None,
        over_posterior: bool = False,
    ) -> FloatArray:
        """(N,) gain of candidate views at `motions` (N, 4, 4), averaged over what the robot's noise may be.

        NaN where too little of the target would be in sight.

        Parameters
        ----------
        criterion
            What a view is worth.
        motions
            A of the chain of each candidate.
        sight
            What a candidate must show.
        joints
            (N, n) joint positions of the candidates, if the arm is known. Without them noise of the joints is
            taken as noise of the flange of the same size, and offsets of the joints as if they moved nothing.
        over_posterior
            Average over sigma points of X and Y as well: a young estimate is wrong, and a view must be worth
            taking wherever the truth may be. Where a sigma point does not show the target it gains nothing.

        Raises
        ------
        DegenerateError
            The information is singular.
        """
        jacobians = self.jacobians(joints)
        gains = self._gains_at(criterion, motions, sight, jacobians)
        if not over_posterior:
            return gains
        points = [gains]
        for X, Y in self._sigma_points():
            moved = replace(self, X=X, Y=Y)
            there = moved._gains_at(criterion, motions, sight, jacobians)  # noqa: SLF001 - of this class
            points.append(np.nan_to_num(there))
        return np.mean(points, axis=0)

    def _gains_at(
        self, criterion: _core.Criterion, motions: FloatArray, sight: Sight, jacobians: FloatArray | None
    ) -> FloatArray:
        believed = [(p, _core.Belief(hypothesis.information), hypothesis) for p, hypothesis in self.averaged]
        if jacobians is None:
            supposed = [(p, belief, *self._robot_error(hypothesis)) for p, belief, hypothesis in believed]
            return self.predictor(self.averaged[0][1], sight).mean_gains(supposed, criterion, motions)
        total = np.zeros(len(motions))
        for probability, belief, hypothesis in believed:
            predictor = self.predictor(hypothesis, sight)
            total += probability * predictor.gains(belief, criterion, motions, jacobians=jacobians)
        return total

    def _sigma_points(self) -> list[tuple[Pose, Pose]]:
        """X and Y on both sides along the least known directions (unscented transform, no central weight)."""
        values, vectors = np.linalg.eigh(self.covariance[:12, :12])
        points: list[tuple[Pose, Pose]] = []
        for value, vector in list(zip(values, vectors.T, strict=True))[-SIGMA_POINT_DIRECTIONS:]:
            step = np.sqrt(SIGMA_POINT_DIRECTIONS * max(float(value), 0.0)) * vector
            points += [
                (Pose.exp(signed[:6]) @ self.X, Pose.exp(signed[6:]) @ self.Y) for signed in (step, -step)
            ]
        return points


def corrected(
    measurements: Measurements, kinematics: Kinematics | None, correction: ArmCorrection | None
) -> Measurements:
    """Return measurements with robot poses as the arm stands by what was found of its joints and links.

    As they are where the arm is not known, or a view has no joint positions.
    """
    if kinematics is None or correction is None or any(v.joints_rad is None for v in measurements.views):
        return measurements
    mounting, joints = measurements.mounting, measurements.joints
    twists = kinematics.motion_jacobians(mounting, joints) @ correction.joint_offsets
    twists += kinematics.link_jacobians(mounting, joints) @ correction.displacements
    motions = _core.se3_exp(twists) @ measurements.motions
    # What leads from a robot pose to A leads back.
    poses = [mounting.chain(Pose(motion)) for motion in motions]
    views = zip(measurements.views, poses, strict=True)
    return replace(measurements, views=tuple(replace(view, T_base_flange=pose) for view, pose in views))


class Estimator(Protocol):
    """Turns measurements into an estimate; a previous one helps as a start."""

    def __call__(self, measurements: Measurements, previous: Estimate | None = None) -> Estimate:
        """Estimate from these measurements."""
        ...


def regular_information(covariance: FloatArray) -> FloatArray:
    """Return the inverse of a covariance.

    Raises
    ------
    DegenerateError
        It is singular.
    """
    try:
        return np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    except np.linalg.LinAlgError as error:
        raise DegenerateError("the covariance is singular") from error
