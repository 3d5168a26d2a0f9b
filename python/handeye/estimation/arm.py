"""Errors of an arm whose kinematics are known, as the estimate takes them.

The joints truly stand at ``q + dq`` where q is read, and every joint truly sits a little beside where the
description has it on the link before: the motion of view k is truly ``exp(D_k dq + L_k l) A_k`` with D_k of
`Kinematics.motion_jacobians` and L_k of `Kinematics.link_jacobians`. What stays the same in all views is a
parameter with a prior; what differs is noise.

An offset of the first joint moves every pose of the arm by one and the same motion of the base, and one of
the last by the same motion of the flange: they only say where base and flange are. So do the zeros of all
slides of a gantry. This gauge freedom is fixed by taking them as zero: `T_flange_camera` is the pose in the
flange that the controller reports.
"""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ArmCorrection, JointOffset, LinkError
from handeye.types.kinematics import Kinematics
from handeye.types.mounting import Mounting

# An error of a joint that slides, in metres, as likely as one of a radian of a joint that turns.
SLIDING_M_PER_RAD = 0.5
# Displacements of less are not worth a line: nothing is known of the links.
LEAST_M, LEAST_RAD = 1e-6, 1e-6


@dataclass(frozen=True, eq=False)
class ArmModel:
    """An arm as part of the model.

    Parameters
    ----------
    kinematics
        The arm.
    scales
        (n,) what a level of one radian means for each joint.
    free
        Joints whose offset is a parameter.
    lengths
        (m,) whether each way of displacing a joint on its link is in metres.
    """

    kinematics: Kinematics
    scales: FloatArray
    free: tuple[int, ...]
    lengths: tuple[bool, ...]

    @classmethod
    def of(cls, kinematics: Kinematics) -> "ArmModel":
        """Take an arm."""
        count = len(kinematics.joint_names)
        lengths = np.abs(kinematics.link_twists[:, :3]).sum(axis=(0, 1)) > 0
        scales = np.where(kinematics.sliding, SLIDING_M_PER_RAD, 1.0)
        # Slides before all joints that turn only say where the base is, as a first joint that turns does.
        leading = next((i for i, slides in enumerate(kinematics.sliding) if not slides), count)
        return cls(kinematics, scales, tuple(range(max(leading, 1), count - 1)), tuple(lengths.tolist()))

    def check(self, measurements: Measurements) -> None:
        """Raise where the views do not have the joints of this arm.

        Raises
        ------
        InputError
            A view has no joint positions, or not as many as the arm has joints.
        """
        count = len(self.scales)
        if measurements.joints.shape[1] != count:
            raise InputError(
                f"the views have {measurements.joints.shape[1]} joint positions, the arm {count} joints",
                code=Code.WRONG_ARM,
            )

    def at_flange(self, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Twist of the flange in its own frame, (K, 6, n) per joint and (K, 6, m) per way of its links."""
        # For eye in hand A is T_flange_base, on whose left the flange is: an error of the arm moves it back.
        in_hand = Mounting.EYE_IN_HAND
        return (
            -self.kinematics.motion_jacobians(in_hand, joints),
            -self.kinematics.link_jacobians(in_hand, joints),
        )

    @property
    def order(self) -> tuple[int, ...]:
        """Ways of displacing joints in the order of the parameters: lengths, then angles."""
        lengths = np.array(self.lengths)
        return (*np.flatnonzero(lengths).tolist(), *np.flatnonzero(~lengths).tolist())

    def candidates(
        self, mounting: Mounting, joints: FloatArray, joint_rad: float
    ) -> tuple[FloatArray, FloatArray]:
        """What the arm does to A on its left at joints (N, n): noise roots (N, 6, n), constants (N, 6, k)."""
        constants, roots = np.split(self.columns(mounting, joints, joint_rad), [self.constants], axis=2)
        return roots, constants

    def columns(self, mounting: Mounting, joints: FloatArray, joint_rad: float) -> FloatArray:
        """(N, 6, k + n) of `candidates` side by side: the constants first."""
        scaled = self.kinematics.joint_twists * self.scales
        parts = (scaled[:, :, self.free], self.kinematics.link_twists[:, :, self.order], scaled * joint_rad)
        return self.kinematics.displacements(mounting, joints, np.concatenate(parts, axis=2))

    @property
    def constants(self) -> int:
        """Number of constants that are parameters."""
        return len(self.free) + len(self.lengths)

    def correction(self, constants: FloatArray) -> ArmCorrection:
        """Return what was found of joints and links, of the constants (k,) in the order of the parameters."""
        offsets = np.zeros(len(self.scales))
        offsets[list(self.free)] = constants[: len(self.free)] * self.scales[list(self.free)]
        displacements = np.zeros(len(self.lengths))
        displacements[list(self.order)] = constants[len(self.free) :]
        return ArmCorrection(offsets, displacements)

    def parameters(self, correction: ArmCorrection) -> FloatArray:
        """(k,) what was found of joints and links in the order of the parameters; undoes `correction`."""
        free = list(self.free)
        offsets = correction.joint_offsets[free] / self.scales[free]
        return np.concatenate([offsets, correction.displacements[list(self.order)]])

    def offsets(self, constants: FloatArray, covariance: FloatArray) -> tuple[JointOffset, ...]:
        """Name the offsets, of the constants (k,) and their covariance (k, k)."""
        sigmas = np.sqrt(np.diag(covariance)) if len(covariance) else np.zeros(0)
        names, sliding = self.kinematics.joint_names, self.kinematics.sliding
        return tuple(
            JointOffset(
                names[joint],
                float(constants[i] * self.scales[joint]),
                float(sigmas[i] * self.scales[joint]),
                sliding[joint],
            )
            for i, joint in enumerate(self.free)
        )

    def link_errors(self, displacements: FloatArray) -> tuple[LinkError, ...]:
        """Name how each joint sits, of the ways (m,) of displacing them; nothing where that is nothing."""
        twists = self.kinematics.link_twists @ displacements
        if np.abs(twists[:, :3]).max() < LEAST_M and np.abs(twists[:, 3:]).max() < LEAST_RAD:
            return ()
        names = self.kinematics.joint_names
        return tuple(
            LinkError(name, (float(a), float(b), float(c), float(d), float(e), float(f)))
            for name, (a, b, c, d, e, f) in zip(names, twists, strict=True)
        )


def velocities(measurements: Measurements) -> FloatArray | None:
    """(K, 6) twist of the flange in its own frame per second at each view.

    Differences between neighbouring views; None without timestamps on all views, or where the robot hardly
    moves between them.
    """
    times = np.array([np.nan if v.timestamp_s is None else v.timestamp_s for v in measurements.views])
    if len(times) < 3 or np.isnan(times).any() or np.any(np.diff(times) <= 0):
        return None
    poses = np.array([view.T_base_flange.matrix for view in measurements.views])
    before, after = poses[:-2], poses[2:]
    twists = _core.se3_log(np.linalg.inv(before) @ after) / (times[2:] - times[:-2])[:, None]
    found = np.concatenate([twists[:1], twists, twists[-1:]])
    if np.median(np.linalg.norm(found[:, :3], axis=1)) < SLOWEST_M_S:
        return None
    return found


# Slower than this a lag between pictures and poses shows nothing.
SLOWEST_M_S = 1e-3


def behind(by_joint: FloatArray, joints: FloatArray) -> FloatArray:
    """(K, 6, 2 n) twist of the flange per play of each joint, of twists per joint (K, 6, n) at joints (K, n).

    A joint stands behind by half its play, on the side that it last came from. Of its side before it first
    moves nobody knows: that is as large an error of its own, in the second half of the columns.
    """
    side = np.sign(np.diff(joints, axis=0, prepend=joints[:1]))
    for k in range(1, len(side)):
        side[k] = np.where(side[k] == 0.0, side[k - 1], side[k])
    both = np.stack([side, side == 0.0], axis=1)
    return -0.5 * (by_joint[:, :, np.newaxis, :] * both[:, np.newaxis]).reshape(len(joints), 6, -1)
