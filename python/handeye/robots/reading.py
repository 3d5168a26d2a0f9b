"""Whether what a robot says of itself can be true: types, limits, and the description of the arm.

A reading is looked at before the first motion and after every one. A wrong one is named where one of the
usual mistakes explains it: degrees, millimetres, a pose the wrong way round, a tool, another arm.
"""

from collections.abc import Iterator

import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.robots.model import Arm
from handeye.robots.motion import AGREEMENT_M, AGREEMENT_RAD
from handeye.robots.protocol import Reading
from handeye.robots.replay import is_near
from handeye.robots.shipped import open_arm, shipped_arms
from handeye.types import Pose
from handeye.types.arrays import FloatArray, finite_array
from handeye.types.view import MAX_JOINTS

# Encoders may read this far beyond a limit at which the arm stands.
LIMIT_TOLERANCE = 1e-3
BAD_READING = Code.BAD_READING


def limited_arm(arm: Arm, stated: object) -> Arm:
    """Return an arm within what its driver states as `joint_limits` too; None where it states nothing.

    Raises
    ------
    DeviceError
        They are not two numbers for each joint of the description, or leave a joint no way.
    """
    if stated is None:
        return arm
    try:
        return arm.limited(np.array(stated, dtype=float))
    except InputError as error:
        raise _bad(f"joint_limits: {error.message}") from error
    except Exception as error:
        raise _bad(f"joint_limits: unreadable ({type(error).__name__})") from error


def typed_reading(answer: object) -> Reading:
    """Return what a driver answered, its joints as plain numbers.

    Raises
    ------
    DeviceError
        It is no reading, its pose no pose, or its joints are not finite numbers.
    """
    if not isinstance(answer, Reading):
        raise _bad(f"read_pose returns {type(answer).__name__}, expected Reading")
    try:
        return _plain(answer)
    except InputError as error:
        raise _bad(error.message) from error
    except Exception as error:
        raise _bad(f"unreadable ({type(error).__name__})") from error


def _plain(answer: Reading) -> Reading:
    pose, joints = answer.T_base_flange, answer.joints_rad
    if not isinstance(pose, Pose):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError(f"T_base_flange is {type(pose).__name__}, expected Pose")
    pose.inverse()  # raises where there is no matrix in it
    if joints is None:
        return Reading(pose)
    if hasattr(joints, "__len__") and len(joints) > MAX_JOINTS:
        raise InputError(f"{len(joints)} joints, expected at most {MAX_JOINTS}")
    return Reading(pose, tuple(finite_array(joints, (None,), "joints_rad").tolist()))


def checked_reading(
    answer: object, arm: Arm, *, joints_needed: bool = True, expected: Pose | None = None
) -> Reading:
    """Return a reading that may be true.

    Parameters
    ----------
    answer
        What the driver answered.
    arm
        Description of the arm; the robot reports the flange of the description in its base.
    joints_needed
        Whether a reading without joints is refused.
    expected
        Pose where the arm should stand, to name what is wrong with a reading without joints.

    Raises
    ------
    DeviceError
        `bad_reading`, or `no_joints`.
    """
    reading = typed_reading(answer)
    if reading.joints_rad is None:
        named = None if expected is None else _pose_mistake(expected, reading.T_base_flange)
        if named is not None:
            raise _bad(named)
        if joints_needed:
            raise DeviceError(
                "the robot does not tell its joint positions, and without them no way can be checked",
                code=Code.NO_JOINTS,
                hint="return them in the Reading, in radians (metres for sliding joints)",
            )
        return reading
    joints = np.array(reading.joints_rad)
    if len(joints) != len(arm):
        raise _bad(f"{len(joints)} joint positions, expected {len(arm)}: {', '.join(arm.joint_names)}")
    low, high = arm.limits.T
    beyond = np.flatnonzero((joints < low - LIMIT_TOLERANCE) | (joints > high + LIMIT_TOLERANCE))
    pose = Pose(arm.forward(joints))
    fits = is_near(pose, reading.T_base_flange, AGREEMENT_M, AGREEMENT_RAD)
    if fits and len(beyond) == 0:
        return reading
    named = _mistake(arm, reading.T_base_flange, joints)
    if named is not None:
        raise _bad(named)
    if len(beyond) > 0:
        i = int(beyond[0])
        raise _bad(
            f"joint {arm.joint_names[i]} is at {joints[i]:.4g}, beyond its limits {low[i]:.4g} to "
            f"{high[i]:.4g}"
        )
    off = pose.inverse() @ reading.T_base_flange
    # Adding zero turns a negative zero into a plain one.
    x, y, z = np.round(1e3 * off.translation) + 0.0
    turn = np.rad2deg(off.rotation_angle_rad)
    raise _bad(
        f"the pose is not that of {arm.name} at these joints: in the flange of the description it is at "
        f"({x:.0f}, {y:.0f}, {z:.0f}) mm and turned by {turn:.1f} deg; a tool is set, or it is another arm",
        hint="report the flange of the description: switch the tool off at the controller, or describe the "
        "arm up to it (--robot)",
    )


def _mistake(arm: Arm, reported: Pose, joints: FloatArray) -> str | None:
    """Say which of the usual mistakes makes the pose (of the flange) that of the joints (n,)."""
    for words, trial in _joint_readings(arm, joints):
        expected = Pose(arm.forward(trial))
        why = _pose_mistake(expected, reported)
        if why is not None or is_near(expected, reported, AGREEMENT_M, AGREEMENT_RAD):
            return " and ".join(filter(None, (words, why))) or None
        for degrees in (90, -90, 180):
            turn = Pose.exp([0, 0, 0, 0, 0, np.deg2rad(degrees)])
            if is_near(turn @ expected, reported, AGREEMENT_M, AGREEMENT_RAD):
                base = f"the base is turned by {degrees} deg about z against the description of {arm.name}"
                return " and ".join(filter(None, (words, base)))
        for name in shipped_arms():
            other = open_arm(name)
            if len(other) == len(arm) and is_near(
                Pose(other.forward(trial)), reported, AGREEMENT_M, AGREEMENT_RAD
            ):
                return f"these are joints and pose of {name}, not of {arm.name}"
    return None


def _joint_readings(arm: Arm, joints: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Yield what the joints (n,) may mean, each with what is wrong then."""
    turning = ~np.array(arm.sliding)
    radians = np.where(turning, np.deg2rad(joints), joints)
    yield "", joints
    yield "the joint positions are in degrees, expected radians", radians
    if not turning.all():
        metres = np.where(turning, joints, joints / 1e3)
        yield "the sliding joints are in millimetres, expected metres", metres
        yield (
            "the joint positions are in degrees and millimetres, expected radians and metres",
            np.where(turning, radians, metres),
        )


def _pose_mistake(expected: Pose, reported: Pose) -> str | None:
    """Say which of the usual mistakes makes a reported pose the expected one; None if it is that anyway."""
    in_metres = _in_metres(reported)
    inverse = "the pose is that of the base in the flange, expected the flange in the base (T_base_flange)"
    millimetres = "the pose is in millimetres, expected metres"
    if is_near(expected, reported, AGREEMENT_M, AGREEMENT_RAD):
        return None
    for words, pose in (
        (millimetres, in_metres),
        (inverse, reported.inverse()),
        (f"{millimetres}, and {inverse}", in_metres.inverse()),
    ):
        if is_near(expected, pose, AGREEMENT_M, AGREEMENT_RAD):
            return words
    return None


def _in_metres(pose: Pose) -> Pose:
    """Return a pose whose millimetres were taken for metres as it was meant."""
    matrix = pose.matrix.copy()
    matrix[:3, 3] /= 1e3
    return Pose(matrix)


def _bad(message: str, hint: str | None = None) -> DeviceError:
    return DeviceError(f"reading: {message}", code=BAD_READING, hint=hint)
