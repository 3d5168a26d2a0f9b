"""Arms that are not built as described: joints displaced on the links that carry them."""

from dataclasses import replace

import numpy as np

from handeye.robots.model import Arm
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose


def displaced(arm: Arm, twists: FloatArray) -> Arm:
    """Return the arm with each joint displaced by a twist (n, 6) in its own frame; limits are lifted.

    Where base and flange are is a gauge freedom: the first joint stays, and of the last what moves or turns
    it along its own axis.
    """
    told = np.array(twists, dtype=np.float64)
    told[0] = 0.0
    axis = np.array(arm.joints[-1].axis)
    along = np.outer(axis, axis) / (axis @ axis)
    told[-1] -= (told[-1].reshape(2, 3) @ along).ravel()
    joints = tuple(
        replace(joint, placement=joint.placement @ Pose.exp(twist), lower=-np.inf, upper=np.inf)
        for joint, twist in zip(arm.joints, told, strict=True)
    )
    return replace(arm, joints=joints)


def random_displacements(
    random: np.random.Generator, arm: Arm, translation_m: float, rotation_rad: float
) -> FloatArray:
    """Draw twists (n, 6) of the joints with these standard deviations per axis."""
    sigma = np.repeat([translation_m, rotation_rad], 3)
    return sigma * random.standard_normal((len(arm), 6))
