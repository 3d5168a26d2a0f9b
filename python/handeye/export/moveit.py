"""Launch files as MoveIt Calibration writes them, for MoveIt 1 (XML) and MoveIt 2 (Python).

Its own files also give roll, pitch and yaw in a comment, of another convention than the comment says
(moveit_calibration, `handeye_control_widget.cpp`: rotating axes). Here they are URDF's, and checked.
"""

from handeye.export import ros1, ros2
from handeye.export.base import Exporter, fixed_axis_angles, hash_comments, numbers, quoted, xml_comment
from handeye.export.mount import Mount


def xml_text(mount: Mount) -> str:
    """Return a launch file of ROS 1."""
    comments = [*mount.remarks, f"rpy in radians about fixed axes, as in URDF: {_angles(mount)}"]
    lines = ["<launch>", *(f"  {xml_comment(comment)}" for comment in comments), f"  {ros1.node(mount)}"]
    return "\n".join([*lines, "</launch>"]) + "\n"


def python_text(mount: Mount) -> str:
    """Return a launch file of ROS 2."""
    arguments = "".join(
        f"                {quoted(option)},\n                {quoted(value)},\n"
        for option, value in ros2.options(mount)
    )
    return f"""{hash_comments(mount)}# rpy in radians about fixed axes, as in URDF: {_angles(mount)}
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    nodes = [
        Node(
            package="tf2_ros",
            executable="static_transform_publisher",
            output="log",
            arguments=[
{arguments}            ],
        ),
    ]
    return LaunchDescription(nodes)
"""


def _angles(mount: Mount) -> str:
    return numbers(fixed_axis_angles(mount.T_parent_child))


XML_EXPORTER = Exporter("moveit", "MoveIt Calibration launch file, ROS 1", ".launch", xml_text)
PYTHON_EXPORTER = Exporter("moveit2", "MoveIt Calibration launch file, ROS 2", ".launch.py", python_text)
