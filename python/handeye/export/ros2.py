"""A command that publishes the transform in ROS 2.

The options of `static_transform_publisher` in tf2_ros (`static_transform_broadcaster_program.cpp`): lengths
in metres; a quaternion, as angles and a quaternion together are refused.
"""

from handeye.export.base import Exporter, fixed_axis_angles, hash_comments, number, numbers
from handeye.export.mount import Mount

_VALUES = ("x", "y", "z", "qx", "qy", "qz", "qw")


def text(mount: Mount) -> str:
    """Return comments and the command."""
    arguments = " \\\n  ".join(" ".join(pair) for pair in options(mount))
    return (
        f"{hash_comments(mount)}# the same rotation as --roll --pitch --yaw: "
        f"{numbers(fixed_axis_angles(mount.T_parent_child))}\n"
        f"ros2 run tf2_ros static_transform_publisher \\\n  {arguments}\n"
    )


def options(mount: Mount) -> list[tuple[str, str]]:
    """Return the options of `static_transform_publisher` and their values."""
    pose = mount.T_parent_child
    values = [*pose.translation, *pose.quaternion_xyzw]
    return [
        *((f"--{name}", number(value)) for name, value in zip(_VALUES, values, strict=True)),
        ("--frame-id", mount.parent),
        ("--child-frame-id", mount.child),
    ]


EXPORTER = Exporter("ros2", "ROS 2 static_transform_publisher", ".sh", text)
