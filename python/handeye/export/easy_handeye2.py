"""The calibration file of easy_handeye2, `~/.ros2/easy_handeye2/calibrations/NAME.calib`.

The message `HandeyeCalibration` as YAML. The transform's parent is the effector for `eye_in_hand` and the
base for `eye_on_base`, its child the frame named `tracking_base_frame`.
"""

import re

from handeye.export.base import Exporter, hash_comments, number, quoted
from handeye.export.mount import Mount
from handeye.types import Mounting

_MAX_NAME_LENGTH = 60


def text(mount: Mount) -> str:
    """Return comments and the message."""
    in_hand = mount.result.mounting is Mounting.EYE_IN_HAND
    base, effector = (mount.frames.robot, mount.parent) if in_hand else (mount.parent, mount.frames.robot)
    name = re.sub(r"[^A-Za-z0-9_]+", "_", mount.result.recording)[:_MAX_NAME_LENGTH].strip("_") or "handeye"
    parameters = {
        "name": quoted(name),
        "calibration_type": quoted("eye_in_hand" if in_hand else "eye_on_base"),
        "robot_base_frame": quoted(base),
        "robot_effector_frame": quoted(effector),
        "tracking_base_frame": quoted(mount.child),
        "tracking_marker_frame": quoted(mount.frames.target),
        "freehand_robot_movement": "true",
        "move_group_namespace": quoted("/"),
        "move_group": quoted("manipulator"),
    }
    lines = ["parameters:", *(f"  {key}: {value}" for key, value in parameters.items()), "transform:"]
    pose = mount.T_parent_child
    for part, axes, values in (
        ("translation", "xyz", pose.translation),
        ("rotation", "xyzw", pose.quaternion_xyzw),
    ):
        lines.append(f"  {part}:")
        lines += [f"    {axis}: {number(float(value))}" for axis, value in zip(axes, values, strict=True)]
    place = f"# save as ~/.ros2/easy_handeye2/calibrations/{name}.calib\n"
    return hash_comments(mount) + place + "\n".join(lines) + "\n"


EXPORTER = Exporter("easy_handeye2", "easy_handeye2 calibration file", ".calib", text)
