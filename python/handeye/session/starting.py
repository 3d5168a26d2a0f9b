"""The first views, before anything is known of where the camera sits: small turns about where the arm stands.

The turns are about the flange's own origin, as large as the room around the target in the first image allows,
each about another axis, so that three views determine the answer. A turn that loses the target is tried
smaller and the other way round.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handeye.planning.collisions import Body
from handeye.robots import Arm
from handeye.types import Camera, Pose, View
from handeye.types.arrays import FloatArray

# Directions of the turns in the frame of the flange, one per view after the first; the roll is about z.
_TURNS = np.array(
    [
        [1.0, 0.3, 1.0],
        [-0.3, 1.0, -1.0],
        [-1.0, -0.5, 0.5],
        [0.5, -1.0, -0.5],
        [0.7, 0.7, 1.2],
        [-0.7, 0.7, -1.2],
        [0.0, 0.0, 1.6],
    ]
)
MOST_VIEWS = len(_TURNS) + 1
LARGEST_TILT_RAD, LARGEST_ROLL_RAD = 0.30, 0.35
SMALLEST_TILT_RAD = 0.05
# Joints that it takes to turn about any axis in place, and to tilt at all.
WHOLE, TILTING = 6, 5
TILT_LEVER_M = 0.4
# Share of the room in the image that a turn may use, and by how much it shrinks where it fails.
ROOM_SHARE, SHRINK = 0.7, 0.6


@dataclass(frozen=True, eq=False)
class Start:
    """Where the arm stood when the session began.

    Where a person moves the arm and does not tell its joints, these are some that reach the pose, and
    `posture_known` says that it need not be these.

    Examples
    --------
    >>> view = recording.views[0]
    >>> Start(view.T_base_flange, view.joints_rad).posture_known
    True
    """

    T_base_flange: Pose
    joints_rad: tuple[float, ...]
    posture_known: bool = True


def starting_goal(
    start: Start,
    number: int,
    failures: int,
    tilt_rad: float,
    body: Body,
    standing_rad: Sequence[float] | None,
) -> tuple[Pose, FloatArray] | None:
    """Return the next safe pose and its joints, None if there is none.

    Parameters
    ----------
    number
        Views so far.
    failures
        Attempts at the next view that failed since the last view.
    tilt_rad
        Largest tilt, see `largest_tilt_rad`.
    body
        The arm, as far as it is known with what is mounted on it.
    standing_rad
        (n,) joints where the arm stands now, from where the way must be free; None if nobody tells.
    """
    if number == 0:
        return start.T_base_flange, np.array(start.joints_rad)
    if number >= MOST_VIEWS:
        return None
    arm = body.arm
    for trial in range(failures, failures + 6):
        joints = _turned(arm, start, _turn(number, trial, tilt_rad))
        if joints is None:
            continue
        if standing_rad is None or body.obstacle_on_path(standing_rad, joints) is None:
            return Pose(arm.forward(joints)), joints
    return None


def once_more(number: int, failures: int) -> tuple[int, int]:
    """Return number and failures for `starting_goal` that go through all turns again, smaller every time."""
    if number < MOST_VIEWS:
        return number, failures
    rounds, turn = divmod(number - 1, MOST_VIEWS - 1)
    return turn + 1, failures + 2 * rounds


def _turned(arm: Arm, start: Start, twist: FloatArray) -> FloatArray | None:
    """Joints (n,) at which the flange is turned by a twist; with few joints, as near to that as they come."""
    if len(arm) < TILTING:
        # Moved across instead, about as far as the tilt would move the target in the image.
        twist = np.array([TILT_LEVER_M * twist[4], -TILT_LEVER_M * twist[3], 0.0, 0.0, 0.0, twist[5]])
    pose = start.T_base_flange @ Pose.exp(twist)
    joints, reached = arm.inverse_all(pose.matrix[np.newaxis], np.array(start.joints_rad), attempts=1)
    if reached[0]:
        return joints[0]
    if len(arm) >= WHOLE:
        return None
    turned = start.T_base_flange.inverse() @ Pose(arm.forward(joints[0]))
    return joints[0] if turned.rotation_angle_rad > SMALLEST_TILT_RAD else None


def preview(start: Start, body: Body, count: int) -> list[tuple[Pose, FloatArray]]:
    """Return the first poses and joints as they will be if there is much room around the target."""
    found = [(start.T_base_flange, np.array(start.joints_rad))]
    arm = body.arm
    for number in range(1, count):
        for trial in range(6):
            joints = _turned(arm, start, _turn(number, trial, LARGEST_TILT_RAD))
            if joints is not None and body.obstacle_on_path(start.joints_rad, joints) is None:
                found.append((Pose(arm.forward(joints)), joints))
                break
    return found


def largest_tilt_rad(first: View, camera: Camera) -> float:
    """Return the largest turn about an axis in the image that the room around the first view allows."""
    room = _room_px(first, camera) / float(camera.parameters[:2].max())
    return float(np.clip(ROOM_SHARE * room, SMALLEST_TILT_RAD, LARGEST_TILT_RAD))


def _turn(number: int, trial: int, tilt_rad: float) -> FloatArray:
    """Return the twist (6,) of the flange for the view after so many others."""
    shrunk = SHRINK ** (trial // 2)
    turn = _TURNS[number - 1] * [tilt_rad * shrunk, tilt_rad * shrunk, LARGEST_ROLL_RAD * shrunk]
    return np.concatenate([np.zeros(3), turn * (-1.0) ** trial])


def _room_px(view: View, camera: Camera) -> float:
    """Distance of the outermost point from the border of the image."""
    low, high = view.pixels.min(axis=0), view.pixels.max(axis=0)
    return float(min(low.min(), (np.array(camera.size_px) - 1 - high).min()))
