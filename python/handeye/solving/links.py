"""Errors of the links in the default model, where the arm's kinematics are known.

Every joint truly sits a little beside where the description has it on the link before: the motion of view k
is truly ``exp(L_k l) A_k`` with L_k of `Kinematics.link_jacobians` and l the same in all views. A Gaussian
prior whose levels (displacement and tilt) are found with the other noise stands for how well arms are built;
l is integrated out, and what it most likely is follows from the answer. X and Y are those of the arm as it
is built.
"""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.solving.joints import deviation_at_flange
from handeye.solving.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import LinkError
from handeye.types.kinematics import Kinematics

# Displacements of less are not worth a line: nothing is known of the links.
LEAST_M, LEAST_RAD = 1e-6, 1e-6


@dataclass(frozen=True, eq=False)
class LinkModel:
    """The links of an arm in some views.

    Parameters
    ----------
    kinematics
        The arm.
    jacobians
        (K, 6, m) L of each view.
    lengths
        (m,) whether each way of displacing is in metres.
    measurements
        The views.
    """

    kinematics: Kinematics
    jacobians: FloatArray
    lengths: tuple[bool, ...]
    measurements: Measurements

    @classmethod
    def of(cls, kinematics: Kinematics, measurements: Measurements) -> "LinkModel":
        """Take the joint positions of the views; they must have been checked."""
        jacobians = kinematics.link_jacobians(measurements.mounting, measurements.joints)
        displaced = np.abs(kinematics.link_twists[:, :3]).sum(axis=(0, 1)) > 0
        return cls(kinematics, jacobians, tuple(displaced.tolist()), measurements)

    def errors(self) -> _core.LinkErrors:
        """Return the errors as the core takes them."""
        return _core.LinkErrors(self.jacobians, list(self.lengths))

    def at_flange(self, translation_m: float, rotation_rad: float) -> tuple[float, float]:
        """Return the deviation per axis of the flange's translation and rotation, on average over views."""
        levels = np.where(self.lengths, translation_m, rotation_rad)
        return deviation_at_flange(self.measurements, self.jacobians * levels)

    def named(self, values: FloatArray) -> tuple[LinkError, ...]:
        """Return how each joint sits, of the ways (m,) of displacing them; nothing where that is nothing."""
        twists = self.kinematics.link_twists @ values
        if np.abs(twists[:, :3]).max() < LEAST_M and np.abs(twists[:, 3:]).max() < LEAST_RAD:
            return ()
        names = self.kinematics.joint_names
        return tuple(
            LinkError(name, (float(a), float(b), float(c), float(d), float(e), float(f)))
            for name, (a, b, c, d, e, f) in zip(names, twists, strict=True)
        )
