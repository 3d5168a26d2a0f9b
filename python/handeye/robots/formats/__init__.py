"""Forms in which an arm that was put right goes to others: one file each, listed in `ARM_FORMATS`."""

from handeye.robots.formats import denavit_hartenberg, joint_zeros, lerobot, universal_robots, urdf
from handeye.robots.formats.base import ArmFormat, CorrectedArm

ARM_FORMATS: dict[str, ArmFormat] = {
    one.name: one
    for one in (
        *urdf.FORMATS,
        universal_robots.FORMAT,
        *denavit_hartenberg.FORMATS,
        *joint_zeros.FORMATS,
        lerobot.FORMAT,
    )
}

__all__ = ["ARM_FORMATS", "ArmFormat", "CorrectedArm"]
