"""A node for a launch file of ROS 1: tf2_ros, `static_transform_publisher x y z qx qy qz qw parent child`."""

import re

from handeye.export.base import Exporter, numbers, xml_comment
from handeye.export.mount import Mount


def text(mount: Mount) -> str:
    """Return comments and the node."""
    comments = "".join(f"{xml_comment(remark)}\n" for remark in mount.remarks)
    return f"{comments}{node(mount)}\n"


def node(mount: Mount) -> str:
    """Return the node."""
    pose = mount.T_parent_child
    values = numbers([*pose.translation, *pose.quaternion_xyzw])
    name = re.sub(r"[^A-Za-z0-9_]", "_", mount.child)
    return (
        f'<node pkg="tf2_ros" type="static_transform_publisher" name="{name}_broadcaster" '
        f'args="{values} {mount.parent} {mount.child}"/>'
    )


EXPORTER = Exporter("ros1", "ROS 1 launch line", ".launch", text)
