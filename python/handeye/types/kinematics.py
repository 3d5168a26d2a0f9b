"""What an estimate needs of an arm: how its joints move the middle of the chain.

An arm itself is the business of `handeye.robots`; estimation and planning know only this much of it.
"""

from typing import Protocol

from handeye.types.arrays import BoolArray, FloatArray
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

    @property
    def link_twists(self) -> FloatArray:
        """(n, 6, m) twist by which each joint is displaced on the link before it, per way l of displacing.

        In the frame of the joint, before it moves. Each way is a displacement in metres or a tilt in radians.
        Ways that only say where base and flange are, are none.
        """
        ...

    def link_jacobians(self, mounting: Mounting, joints: FloatArray) -> FloatArray:
        """(K, 6, m) L of the chain at joint positions (K, n): truly ``A = exp(L l) A_reported``."""
        ...

    @property
    def joint_twists(self) -> FloatArray:
        """(n, 6, n) as `link_twists`, of displacements that are the motions of the joints."""
        ...

    def displacements(self, mounting: Mounting, joints: FloatArray, twists: FloatArray) -> FloatArray:
        """(K, 6, m) as `link_jacobians`, of other displacements (n, 6, m), each of one joint."""
        ...

    def reach(self, T_base_flange: FloatArray, near: FloatArray) -> tuple[FloatArray, BoolArray]:
        """(N, n) joint positions at poses (N, 4, 4) as reported, near (N, n), and which (N,) are reached."""
        ...
