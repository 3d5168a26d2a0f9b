"""`calibration.yaml` as the ROS driver of Universal Robots takes it (`kinematics_params_file`).

Its six frames are those of `ur_description`: from `base_link_inertia`, turned as the controller's base, each
joint turns about its z axis, and the last frame lies in the flange. Our frames may lie elsewhere along the
same axes; they are moved there.
"""

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots.formats.base import ArmFormat, CorrectedArm, commented, with_z_axes
from handeye.robots.model import Arm
from handeye.types.pose import Pose

LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
# Frames that are not those of such an arm are off by more than this, metres or radians.
_TOLERANCE = 1e-6


def _calibration(arm: CorrectedArm) -> str:
    moves = frames_along_axes(with_z_axes(arm.described))
    built = with_z_axes(arm.built)
    lines = ["kinematics:"]
    before = Pose.identity()
    for link, joint, move in zip(LINKS, built.joints, moves, strict=True):
        placed = before.inverse() @ joint.placement @ move
        before = move
        lines.append(f"  {link}:")
        x, y, z = placed.translation.tolist()
        roll, pitch, yaw = placed.roll_pitch_yaw_rad
        for name, value in zip(
            ("x", "y", "z", "roll", "pitch", "yaw"), (x, y, z, roll, pitch, yaw), strict=True
        ):
            lines.append(f"    {name}: {float(value)!r}")
    lines.append("  hash: handeye")
    notes = (*arm.notes, "the driver warns that this hash is not the robot's: it is not its own calibration")
    return commented(notes, "#") + "\n".join(lines) + "\n"


def frames_along_axes(arm: Arm) -> list[Pose]:
    """Return how far each joint's frame is moved along and about its axis to be that of `ur_description`.

    Raises
    ------
    InputError
        Not an arm of this family.
    """
    if len(arm) != len(LINKS) or any(arm.sliding):
        raise InputError(
            f"{arm.name}: {len(arm)} joints, an arm of Universal Robots has six that turn",
            code=Code.OTHER_ARM,
            hint="write urdf, or a table of Denavit and Hartenberg",
        )
    heights = _heights(arm)
    moves = [Pose.exp([0, 0, height, 0, 0, 0]) for height in heights]
    flange = moves[-1].inverse() @ arm.T_last_flange
    if np.linalg.norm(flange.translation) > _TOLERANCE:
        raise InputError(
            f"{arm.name}: its flange is not on the axis of its last joint, as that of Universal Robots is",
            code=Code.OTHER_ARM,
            hint="write urdf, or a table of Denavit and Hartenberg",
        )
    return moves


def _heights(arm: Arm) -> list[float]:
    """How far along its axis each frame is moved, metres.

    The shoulder's frame lies at the height of the next axis, those of upper arm and forearm in its plane, and
    the last one in the flange.
    """
    frames = [Pose.identity()]
    for joint in arm.joints:
        frames.append(frames[-1] @ joint.placement)
    places = [frame.translation for frame in frames[1:]]
    axes = [frame.rotation[:, 2] for frame in frames[1:]]
    heights: list[float] = []
    for i, (place, axis) in enumerate(zip(places, axes, strict=True)):
        if i == 0:
            towards = places[1]
        elif i in {1, 2}:  # in the plane of the shoulder, across the parallel axes
            towards = places[0]
        elif i + 1 < len(places):
            towards = places[i + 1]
        else:
            towards = (frames[-1] @ arm.T_last_flange).translation
        heights.append(float(axis @ (towards - place)))
    return heights


FORMAT = ArmFormat("ur", "calibration.yaml of the Universal Robots ROS driver", whole=True, text=_calibration)
