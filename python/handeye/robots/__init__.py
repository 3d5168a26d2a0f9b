"""Arms: their descriptions, where their flange is, and how their joints move it."""

from handeye.robots.model import Arm, Joint, denavit_hartenberg
from handeye.robots.motion import ArmKinematics, arm_kinematics
from handeye.robots.shipped import open_arm, shipped_arms
from handeye.robots.urdf import parse_urdf, read_urdf

__all__ = [
    "Arm",
    "ArmKinematics",
    "Joint",
    "arm_kinematics",
    "denavit_hartenberg",
    "open_arm",
    "parse_urdf",
    "read_urdf",
    "shipped_arms",
]
