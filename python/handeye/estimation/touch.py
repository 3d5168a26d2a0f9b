"""How far off the tool lands: a point that the camera sees from one posture and the arm touches from another.

The point is seen, put into the base through the hand-eye and the arm as it is believed to stand, and the tool
is sent there. What it misses by, in the frame of the base and to first order,

    error = w_touch - w_see - R_base_camera [ -(rho + phi x p) + dp ]

is linear in what the posterior is about: the twist `[rho; phi]` of X, the camera's parameters, which move the
point by `dp` where its pixel stays, and the arm's constants, which carry tool and camera along by `w`. These
errors are correlated, and some undo one another: a camera too long in the focus with a hand-eye to match, a
joint's offset that stands both where the camera sees and where the tool touches. Noise of the arm comes on
top, new at both. An arm that is not described errs in a way that changes with the posture; it counts as
new at both too.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.confidence import PROBABILITY, radii
from handeye.estimation.estimate import Estimate
from handeye.types.arrays import FloatArray
from handeye.types.camera import Camera
from handeye.types.mounting import Mounting
from handeye.types.pose import inverses, through_twist

# Steps of the derivative of the scale of the image, relative to what a point or a parameter is.
_STEP = 1e-6


class Depth(StrEnum):
    """Where the distance of a point that is seen comes from."""

    SIZE = "size"
    """From how large a part of known size looks in the image: it errs with the focal length."""
    SENSOR = "sensor"
    """From something else that is exact: a depth sensor, a plane that is known."""


@dataclass(frozen=True, eq=False)
class Touches:
    """Points, the postures that they are seen from, and those that the tool touches them from.

    Parameters
    ----------
    points_m
        (Q, 3) in the base.
    seen_from, touched_from
        (Q, 4, 4) `T_base_flange` there, as reported. With the camera beside the robot it does not matter
        from where a point is seen.
    tool_m
        (3,) the tip of the tool in the flange, exact.
    seeing_rad, touching_rad
        (Q, n) joint positions there, radians and metres; needed where the estimate knows the arm.
    """

    points_m: FloatArray
    seen_from: FloatArray
    touched_from: FloatArray
    tool_m: FloatArray
    seeing_rad: FloatArray | None = None
    touching_rad: FloatArray | None = None
    depth: Depth = Depth.SIZE

    def __len__(self) -> int:
        return len(self.points_m)


@dataclass(frozen=True, eq=False)
class TouchError:
    """What is believed of the errors of touches.

    Parameters
    ----------
    rows
        (Q, 3, n) the error's dependence on the parameters of the estimate, base frame, metres.
    noise
        (Q, 3, 3) covariance of what the arm adds each time.
    covariances
        (Q, 3, 3) covariance of the error.
    bias_m
        (Q, 3) the mean of the error where the arm's poses are taken as reported, not put right; zero where
        nothing is known of the arm.
    radii_m
        (Q,) radius within which the error lies with 95 %, with what was found of the arm put right.
    as_reported_m
        (Q,) the same with the arm's poses as reported.
    """

    rows: FloatArray
    noise: FloatArray
    covariances: FloatArray
    bias_m: FloatArray
    radii_m: FloatArray
    as_reported_m: FloatArray


def touch_error(estimate: Estimate, touches: Touches, probability: float = PROBABILITY) -> TouchError:
    """Return the error of touches.

    Raises
    ------
    InputError
        The estimate knows the arm, and the touches have no joints.
    """
    rows, noise = touch_rows(estimate, touches)
    covariances = rows @ estimate.covariance @ np.swapaxes(rows, 1, 2) + noise
    bias = np.zeros((len(touches), 3))
    arm, correction = estimate.arm, estimate.arm_correction
    if arm is not None and correction is not None:
        bias = rows[:, :, -arm.constants :] @ arm.parameters(correction)
    degrees = estimate.degrees_of_freedom
    within = radii(covariances, degrees, probability)
    return TouchError(
        rows,
        noise,
        covariances,
        bias,
        within,
        radii(covariances, degrees, probability, bias) if bias.any() else within,
    )


def touch_rows(estimate: Estimate, touches: Touches) -> tuple[FloatArray, FloatArray]:
    """Return rows (Q, 3, n) of the error over the estimate's parameters, and covariances (Q, 3, 3) of noise.

    Raises
    ------
    InputError
        The estimate knows the arm, and the touches have no joints.
    """
    count, parameters = len(touches), len(estimate.covariance)
    in_hand = estimate.mounting is Mounting.EYE_IN_HAND
    camera_from_base = estimate.X.matrix @ (
        inverses(touches.seen_from) if in_hand else np.broadcast_to(np.eye(4), (count, 4, 4))
    )
    R_base_camera = np.swapaxes(camera_from_base[:, :3, :3], 1, 2)
    in_camera = _act(camera_from_base, touches.points_m)
    rows = np.zeros((count, 3, parameters))
    rows[:, :, :6] = through_twist(in_camera, R_base_camera)
    free = list(estimate.free_camera)
    if free:
        moved = _camera_columns(estimate.camera, in_camera, touches.depth)[:, :, free]
        rows[:, :, 12 : 12 + len(free)] = -R_base_camera @ moved
    constants, noise = carried(estimate, touches.touched_from, touches.touching_rad, touches.points_m)
    if in_hand:
        seeing, more = carried(estimate, touches.seen_from, touches.seeing_rad, touches.points_m)
        constants, noise = constants - seeing, noise + more
    if constants.shape[2]:
        rows[:, :, -constants.shape[2] :] = constants
    return rows, noise


def limits(estimate: Estimate, error: TouchError) -> dict[str, float]:
    """Return by what share the mean variance of touches would fall if one thing were known exactly.

    What is correlated teaches of one another, so the shares need not sum to one.
    """
    covariance = estimate.covariance
    spread = error.rows @ covariance
    total = float(np.trace(error.covariances, axis1=1, axis2=2).sum())
    first = 12 + len(estimate.free_camera)
    constants = 0 if estimate.arm is None else estimate.arm.constants
    groups = {
        "hand_eye": range(6),
        "camera": range(12, first),
        "board": range(first, first + (estimate.board_scale is not None)),
        "arm": range(len(covariance) - constants, len(covariance)),
    }
    shares = {"robot_noise": float(np.trace(error.noise, axis1=1, axis2=2).sum()) / total}
    for name, group in groups.items():
        if not group:
            continue
        scale = np.sqrt(np.diag(covariance)[list(group)])
        correlation = covariance[np.ix_(group, group)] / np.outer(scale, scale)
        along = spread[:, :, list(group)] / scale
        known = np.linalg.pinv(correlation, rcond=1e-10, hermitian=True)
        shares[name] = float(np.einsum("qij,jk,qik->", along, known, along)) / total
    return shares


def _act(transforms: FloatArray, points: FloatArray) -> FloatArray:
    return np.einsum("qij,qj->qi", transforms[:, :3, :3], points) + transforms[:, :3, 3]


def carried(
    estimate: Estimate, poses: FloatArray, joints: FloatArray | None, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """How points (Q, 3) in the base move that the flange carries: with constants (Q, 3, k), noise (Q, 3, 3).

    Raises
    ------
    InputError
        The estimate knows the arm, and there are no joints.
    """
    rotations = poses[:, :3, :3]
    at_flange = through_twist(_act(inverses(poses), points), rotations)
    at_base = through_twist(points, np.broadcast_to(np.eye(3), (len(points), 3, 3)))
    noise = np.zeros((len(points), 3, 3))
    for side, (metres, radians) in (
        (at_flange, estimate.expected_noise.flange),
        (at_base, estimate.expected_noise.base),
    ):
        scaled = side * np.repeat([metres, radians], 3)
        noise += scaled @ np.swapaxes(scaled, 1, 2)
    arm = estimate.arm
    if arm is None:
        return np.zeros((len(points), 3, 0)), noise
    if joints is None:
        raise InputError(
            "the joint positions of every touch are needed where the arm is known", code=Code.NO_JOINTS
        )
    # On the left of A: with the camera in the hand A leads back, and is moved by the inverse.
    left = -at_flange if estimate.mounting is Mounting.EYE_IN_HAND else at_base
    roots, constants = arm.candidates(estimate.mounting, joints, estimate.expected_noise.joint_rad)
    by_joint = left @ roots
    return left @ constants, noise + by_joint @ np.swapaxes(by_joint, 1, 2)


def _camera_columns(camera: Camera, points: FloatArray, depth: Depth) -> FloatArray:
    """(Q, 3, c) how points (Q, 3) of the camera frame move with its parameters where their pixels stay."""
    parameters = np.asarray(camera.parameters)
    _, in_point, in_parameters, _ = _core.project_jacobians(camera.lens, parameters, points)
    count, size = len(points), len(parameters)
    system = np.zeros((count, 3, 3))
    right = np.zeros((count, 3, size))
    system[:, :2], right[:, :2] = in_point, -in_parameters
    if depth is Depth.SENSOR:
        system[:, 2] = [0.0, 0.0, 1.0]
        return np.asarray(np.linalg.solve(system, right), np.float64)
    # A part keeps its size in the image: so does the scale of the image around the point.
    for i in range(3):
        step = _STEP * np.eye(3)[i] * points[:, 2:3]
        slope = _log_scale(camera.lens, parameters, points + step) - _log_scale(
            camera.lens, parameters, points - step
        )
        system[:, 2, i] = slope / (2 * _STEP * points[:, 2])
    for j in range(size):
        step = _STEP * max(abs(parameters[j]), 1.0) * np.eye(size)[j]
        slope = _log_scale(camera.lens, parameters + step, points) - _log_scale(
            camera.lens, parameters - step, points
        )
        right[:, 2, j] = -slope / (2 * step[j])
    return np.asarray(np.linalg.solve(system, right), np.float64)


def _log_scale(lens: str, parameters: FloatArray, points: FloatArray) -> FloatArray:
    """(Q,) logarithm of pixels per metre around points (Q, 3), across the line of sight, alike all around."""
    in_point = _core.project_jacobians(lens, parameters, points)[1]
    return np.asarray(0.5 * np.linalg.slogdet(in_point[:, :, :2])[1], np.float64)
