"""Errors of the joints in the default model, where the arm's kinematics are known.

The joints truly stand at ``q + dq`` where q is read: the motion of view k is truly ``exp(D_k dq) A_k`` with
D_k of `Kinematics.motion_jacobians`. What stays the same in all views is an offset per joint, a parameter
with a prior; what differs is noise, with covariance ``D_k Sigma D_k'`` on the left of A_k.

An offset of the first joint moves every pose of the arm by one and the same motion of the base, and one of
the last by the same motion of the flange: they only say where base and flange are, which is a matter of
names, and are taken as zero. `T_flange_camera` is thus the pose in the flange that the controller reports.
"""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.errors import InputError
from handeye.solving.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ArmCorrection, JointOffset
from handeye.types.kinematics import Kinematics
from handeye.types.mounting import Mounting

# An error of a joint that slides, in metres, as likely as one of a radian of a joint that turns.
SLIDING_M_PER_RAD = 0.5


@dataclass(frozen=True, eq=False)
class JointModel:
    """The joints of some views.

    Parameters
    ----------
    kinematics
        The arm.
    jacobians
        (K, 6, n) D of each view.
    scales
        (n,) what a level of one radian means for each joint.
    free
        Joints whose offset is a parameter.
    lever_m, turn
        Deviation per axis of the flange's translation and rotation, on average over the views, at noise of
        one radian in every joint.
    """

    kinematics: Kinematics
    jacobians: FloatArray
    scales: FloatArray
    free: tuple[int, ...]
    lever_m: float
    turn: float

    @classmethod
    def of(cls, kinematics: Kinematics, measurements: Measurements) -> "JointModel":
        """Take the joint positions of the views.

        Raises
        ------
        InputError
            A view has no joint positions, or not as many as the arm has joints.
        """
        count = len(kinematics.joint_names)
        if measurements.joints.shape[1] != count:
            raise InputError(
                f"the views have {measurements.joints.shape[1]} joint positions, the arm {count} joints",
                code="wrong_arm",
            )
        jacobians = kinematics.motion_jacobians(measurements.mounting, measurements.joints)
        scales = np.where(kinematics.sliding, SLIDING_M_PER_RAD, 1.0)
        lever_m, turn = deviation_at_flange(measurements, jacobians * scales)
        return cls(
            kinematics,
            jacobians,
            scales,
            tuple(range(1, count - 1)),
            lever_m,
            turn,
        )

    def errors(self, noise_rad: float | None, offset_rad: float | None) -> _core.JointErrors:
        """Return the joint errors as the core takes them; levels are found where None."""
        return _core.JointErrors(
            self.jacobians, self.scales.tolist(), list(self.free), noise_rad=noise_rad, offset_rad=offset_rad
        )

    def deviations(self, joint_rad: float) -> tuple[float, ...]:
        """Standard deviation of each joint at a level of the noise, radians or metres; empty for none."""
        return tuple((self.scales * joint_rad).tolist()) if joint_rad > 0 else ()

    def correction(self, offsets: list[float], displacements: list[float]) -> ArmCorrection:
        """Return what was found of the joints and, unless they were left out, of the links."""
        every = np.zeros(len(self.scales))
        every[list(self.free)] = offsets
        ways = int(self.kinematics.link_twists.shape[2])
        return ArmCorrection(every, np.array(displacements or [0.0] * ways, dtype=float))

    def offsets(self, values: list[float], covariance: FloatArray) -> tuple[JointOffset, ...]:
        """Name the offsets; their covariance is the last block of that of all parameters."""
        sigmas = np.sqrt(np.diag(covariance))[len(covariance) - len(self.free) :]
        names, sliding = self.kinematics.joint_names, self.kinematics.sliding
        return tuple(
            JointOffset(names[joint], float(value), float(sigma), sliding[joint])
            for joint, value, sigma in zip(self.free, values, sigmas, strict=True)
        )


def deviation_at_flange(measurements: Measurements, twists: FloatArray) -> tuple[float, float]:
    """Return the deviation per axis of the flange's translation and rotation, on average over the views.

    `twists` (K, 6, m): what one standard deviation of each of m errors does to A on its left.
    """
    if measurements.mounting is Mounting.EYE_TO_HAND:
        twists = _core.se3_adjoint(np.linalg.inv(measurements.motions)) @ twists
    squares = np.mean(np.sum(np.square(twists), axis=2), axis=0)
    return float(np.sqrt(squares[:3].mean())), float(np.sqrt(squares[3:].mean()))
