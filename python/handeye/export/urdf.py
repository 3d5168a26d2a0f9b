"""A fixed joint for URDF.

`rpy` are angles about the fixed axes x, y, z, ``R = Rz(yaw) Ry(pitch) Rx(roll)`` (urdfdom, `pose.cpp`). Tools
have been seen to write angles of another convention here, so they are checked against the rotation, and the
quaternion stands beside them.
"""

import re

from handeye.export.base import Exporter, fixed_axis_angles, numbers, xml_comment
from handeye.export.mount import Mount


def text(mount: Mount) -> str:
    """Return comments and the joint."""
    pose = mount.T_parent_child
    quaternion = numbers(pose.quaternion_xyzw)
    comments = [
        *mount.remarks,
        f"rpy: radians about the fixed axes x, y, z; the same rotation as a quaternion x y z w: {quaternion}",
        f"declare the link {mount.child} once, here or where the camera is described",
    ]
    lines = [xml_comment(comment) for comment in comments]
    lines += [
        f'<joint name="{re.sub(r"[^A-Za-z0-9_]", "_", mount.child)}_mount" type="fixed">',
        f'  <parent link="{mount.parent}"/>',
        f'  <child link="{mount.child}"/>',
        f'  <origin xyz="{numbers(pose.translation)}" rpy="{numbers(fixed_axis_angles(pose))}"/>',
        "</joint>",
    ]
    return "\n".join(lines) + "\n"


EXPORTER = Exporter("urdf", "URDF fixed joint", ".urdf", text)
