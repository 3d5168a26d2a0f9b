"""What an estimate needs of an arm: how its joints move the middle of the chain.

An arm itself is the business of `handeye.robots`; whoever estimates or plans knows it only so.
"""

from typing import Protocol

from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting


class Kinematics(Protocol):
    """An arm of n joints whose kinematics are known."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, base first."""
        ...

    @property
    def sliding(self) -> tuple[bool, ...]:
        """Whether each joint slides (metres) rather than turns (radians)."""
        ...

    def motion_jacobians(self, mounting: Mounting, joints: FloatArray) -> FloatArray:
        """(K, 6, n) D of the chain at joint positions (K, n): the twist of A on its left, per joint.

        Where the joints truly are at ``q + dq``, A is truly ``exp(D dq) A``, A being that of the pose the
        robot reports at q. On the left is the flange for eye in hand, the base for eye to hand.
        """
        ...
