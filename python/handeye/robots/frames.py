"""Where every joint of an arm is."""

import numpy as np
from numpy.typing import ArrayLike

from handeye import _core
from handeye.robots.model import Arm
from handeye.types.arrays import FloatArray, finite_array


def frames_of(arm: Arm, joints: ArrayLike) -> FloatArray:
    """(N, n + 2, 4, 4) poses in the base at joints (N, n): the base itself, each joint, the flange."""
    values = finite_array(joints, (None, len(arm)), "joints")
    frames = np.empty((len(values), len(arm) + 2, 4, 4))
    frames[:, 0] = np.eye(4)
    for i, joint in enumerate(arm.joints):
        twists = np.zeros((len(values), 6))
        twists[:, (0 if joint.sliding else 3) : (3 if joint.sliding else 6)] = (
            values[:, i : i + 1] * joint.axis
        )
        frames[:, i + 1] = frames[:, i] @ joint.placement.matrix @ _core.se3_exp(twists)
    frames[:, -1] = frames[:, -2] @ arm.T_last_flange.matrix
    return frames
