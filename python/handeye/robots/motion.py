"""From an arm to what an estimate needs of it: the Jacobians of the motions that the robot reports.

The frames of a description and those of a controller need not be the same: the controller may report a tool,
or have its base turned by half a turn. Both are constant transforms, found from the views themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import HandeyeError, InputError
from handeye.robots.model import Arm
from handeye.types.arrays import BoolArray, FloatArray
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose
from handeye.types.view import View

# Reported poses may be off the description by this much (root mean square) and still be those of the arm: an
# arm calibrated by its maker is millimetres off its nominal measures.
AGREEMENT_M = 0.01
AGREEMENT_RAD = np.deg2rad(1.0)
# Fewer views than these do not tell constant frames from a wrong arm.
MIN_VIEWS_FOR_FRAMES = 4
# Postures from which a pose is looked for where the one nearby does not lead there.
REACH_ATTEMPTS = 10


@dataclass(frozen=True, eq=False)
class ArmKinematics:
    """An arm whose controller reports ``T_base_flange = T_base_root @ arm.forward(q) @ T_tip_flange``.

    This is the `Kinematics` that estimates and plans take.

    Parameters
    ----------
    arm
        The description.
    T_base_root
        The root of the description in the base that the controller reports poses in.
    T_tip_flange
        The flange (or tool) whose pose the controller reports, in the tip of the description.

    Examples
    --------
    >>> ArmKinematics(arm).forward(np.zeros((1, len(arm)))).shape
    (1, 4, 4)
    """

    arm: Arm
    T_base_root: Pose = field(default_factory=Pose.identity)
    T_tip_flange: Pose = field(default_factory=Pose.identity)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, base first."""
        return self.arm.joint_names

    @property
    def sliding(self) -> tuple[bool, ...]:
        """Whether each joint slides."""
        return self.arm.sliding

    def forward(self, joints: FloatArray) -> FloatArray:
        """(K, 4, 4) `T_base_flange` that the controller would report at joints (K, n)."""
        return self.T_base_root.matrix @ self.arm.forward(joints) @ self.T_tip_flange.matrix

    def reach(self, T_base_flange: FloatArray, near: FloatArray) -> tuple[FloatArray, BoolArray]:
        """(N, n) joint positions at which the controller would report poses (N, 4, 4), and which are reached.

        From postures near (N, n); rows of poses that are not reached hold the nearest posture found.
        """
        goals = self.T_base_root.inverse().matrix @ T_base_flange @ self.T_tip_flange.inverse().matrix
        return self.arm.inverse_all(goals, near, attempts=REACH_ATTEMPTS)

    def motion_jacobians(self, mounting: Mounting, joints: FloatArray) -> FloatArray:
        """(K, 6, n) D at joint positions (K, n), radians and metres: truly ``A = exp(D dq) A_reported``.

        Eye in hand: A is the inverse of the robot's pose, so ``A(q + dq) = exp(-J dq) A(q)`` with the
        Jacobian of the flange. Eye to hand: A is the pose itself, ``A(q + dq) = exp(J dq) A(q)`` with that of
        the base.
        """
        return self.displacements(mounting, joints, self.joint_twists)

    @property
    def link_twists(self) -> FloatArray:
        """(n, 6, m) twist of each joint on the link before it, per way of displacing it.

        Where the first joint sits says where the base is, and so does the place of a joint behind slides
        alone; the place and angle of the last along its own axis say where the flange is: gauge freedom, left
        out.
        """
        return self._link_twists

    @cached_property
    def _link_twists(self) -> FloatArray:
        count = len(self.arm)
        ways: list[FloatArray] = []
        for i in range(1, count):
            axis = np.array(self.arm.joints[i].axis)
            along, *across = np.linalg.svd(axis[np.newaxis])[2]
            # Behind slides alone a joint sits elsewhere as the base does.
            behind_slides = all(self.arm.sliding[:i])
            for first in (3,) if behind_slides else (0, 3):
                for direction in across if i == count - 1 else (*across, along):
                    way = np.zeros((count, 6))
                    way[i, first : first + 3] = direction
                    ways.append(way)
        twists = np.moveaxis(np.array(ways).reshape(-1, count, 6), 0, 2)
        twists.flags.writeable = False
        return twists

    def link_jacobians(self, mounting: Mounting, joints: FloatArray) -> FloatArray:
        """(K, 6, m) L at joint positions (K, n): truly ``A = exp(L l) A_reported``, l metres and radians."""
        return self.displacements(mounting, joints, self.link_twists)

    @property
    def joint_twists(self) -> FloatArray:
        """(n, 6, n) as `link_twists`, of displacements that are the motions of the joints."""
        return self._joint_twists

    @cached_property
    def _joint_twists(self) -> FloatArray:
        twists = np.zeros((len(self.arm), 6, len(self.arm)))
        for i, joint in enumerate(self.arm.joints):
            first = 0 if joint.sliding else 3
            twists[i, first : first + 3, i] = np.array(joint.axis) / np.linalg.norm(joint.axis)
        twists.flags.writeable = False
        return twists

    def displacements(self, mounting: Mounting, joints: FloatArray, twists: FloatArray) -> FloatArray:
        """(K, 6, m) as `link_jacobians`, of other displacements (n, 6, m), each of one joint."""
        which = np.abs(twists).sum(axis=1).argmax(axis=0)
        of_joint = twists[which, :, np.arange(twists.shape[2])]
        if mounting is Mounting.EYE_IN_HAND:
            moved = self.arm.displacements(joints, which.tolist(), -of_joint, "flange")
            return _seen_from(self.T_tip_flange.inverse(), moved)
        return _seen_from(self.T_base_root, self.arm.displacements(joints, which.tolist(), of_joint, "base"))


def _seen_from(T: Pose, twists: FloatArray) -> FloatArray:
    """Carry twists (K, 6, m) through a transform that is the same for all."""
    if Pose.identity() == T:
        return twists
    return np.asarray(np.einsum("ij,kjm->kim", T.adjoint(), twists, optimize=True))


def arm_kinematics(arm: Arm, views: Sequence[View]) -> ArmKinematics:
    """Return the kinematics of an arm in the frames that the poses of these views are reported in.

    Views without joint positions are passed over here.

    Parameters
    ----------
    arm
        The description.
    views
        Poses and joint positions as the controller reports them.

    Raises
    ------
    InputError
        No view has joint positions, one has another number of them than the arm has joints, or the reported
        poses are not those of this arm.

    Examples
    --------
    >>> arm_kinematics(arm, recording.views).arm.name == arm.name
    True
    """
    known = [view for view in views if view.joints_rad is not None]
    if not known:
        raise InputError(
            "no view has joint positions, which the arm's kinematics need",
            code=Code.NO_JOINTS,
            hint="record the joint positions with every view, or leave out the arm",
        )
    for view in known:
        if len(view.joints_rad or ()) != len(arm):
            raise InputError(
                f"view {view.name}: {len(view.joints_rad or ())} joint positions, but arm {arm.name} has "
                f"{len(arm)}: {', '.join(arm.joint_names)}",
                code=Code.WRONG_ARM,
            )
    joints = np.array([view.joints_rad for view in known])
    reported = np.array([view.T_base_flange.matrix for view in known])
    kinematics = ArmKinematics(arm)
    best = _disagreement(kinematics, joints, reported)
    if not _agrees(best) and len(known) >= MIN_VIEWS_FOR_FRAMES:
        try:
            root, flange = _core.closed_form("shah", arm.forward(joints), reported)
        except HandeyeError:
            pass  # The views do not tell the frames; the message below says what is wrong.
        else:
            fitted = ArmKinematics(arm, Pose(root), Pose(flange))
            off = _disagreement(fitted, joints, reported)
            if _agrees(off):
                return fitted
            best = min(best, off)
    if not _agrees(best):
        raise InputError(
            f"the reported poses are not those of arm {arm.name} at the reported joint positions: off by "
            f"{best[0] * 1e3:.0f} mm and {np.rad2deg(best[1]):.1f} deg",
            code=Code.WRONG_ARM,
            hint="check the arm, the order and the units (radians) of the joints, and which link is the tip",
        )
    return kinematics


def _disagreement(kinematics: ArmKinematics, joints: FloatArray, reported: FloatArray) -> tuple[float, float]:
    """Root mean square distance (m) and angle (rad) between reported poses and those of the arm."""
    twists = _core.se3_log(np.linalg.inv(kinematics.forward(joints)) @ reported)
    squares = np.mean(np.square(twists), axis=0)
    return float(np.sqrt(squares[:3].sum())), float(np.sqrt(squares[3:].sum()))


def _agrees(off: tuple[float, float]) -> bool:
    return off[0] <= AGREEMENT_M and off[1] <= AGREEMENT_RAD
