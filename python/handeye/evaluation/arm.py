"""A made-up arm of six joints for simulations: where its flange is, and how its errors move it.

Standard Denavit-Hartenberg parameters (Denavit and Hartenberg 1955); the measures are those that Universal
Robots publishes for the UR5e.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from handeye import _core
from handeye.errors import SolveError
from handeye.evaluation.metrics import inverses
from handeye.types.arrays import FloatArray

_UR5E = np.array(
    [
        # a_m, d_m, alpha_rad, offset_rad
        [0.0, 0.1625, np.pi / 2, 0.0],
        [-0.425, 0.0, 0.0, 0.0],
        [-0.3922, 0.0, 0.0, 0.0],
        [0.0, 0.1333, np.pi / 2, 0.0],
        [0.0, 0.0997, -np.pi / 2, 0.0],
        [0.0, 0.0996, 0.0, 0.0],
    ]
)
MOST_STEPS = 30
# A step of no joint is longer than this: Newton's method stays in the posture that it starts from.
LONGEST_STEP_RAD = 0.5
REACHED = 1e-10


@dataclass(frozen=True, eq=False)
class Arm:
    """Six turning joints.

    Parameters
    ----------
    parameters
        (6, 4) a (m), d (m), alpha (rad) and offset of the angle (rad) of each joint:
        ``T[i] = Rz(q + offset) Tz(d) Tx(a) Rx(alpha)``.
    """

    parameters: FloatArray = field(default_factory=_UR5E.copy)

    def links(self, joints_rad: ArrayLike) -> FloatArray:
        """(..., 6, 4, 4) transforms from each link to the one before it."""
        a, d, alpha, offset = self.parameters.T
        angle = np.asarray(joints_rad, dtype=float) + offset
        c, s = np.cos(angle), np.sin(angle)
        ca, sa = np.cos(alpha), np.sin(alpha)
        links = np.zeros((*angle.shape, 4, 4))
        links[..., 0, 0], links[..., 0, 1], links[..., 0, 2] = c, -s * ca, s * sa
        links[..., 1, 0], links[..., 1, 1], links[..., 1, 2] = s, c * ca, -c * sa
        links[..., 2, 1], links[..., 2, 2] = sa, ca
        links[..., 0, 3], links[..., 1, 3], links[..., 2, 3] = a * c, a * s, d
        links[..., 3, 3] = 1.0
        return links

    def forward(self, joints_rad: ArrayLike) -> FloatArray:
        """(..., 4, 4) `T_base_flange` at joint angles (..., 6)."""
        links = self.links(joints_rad)
        pose = links[..., 0, :, :]
        for i in range(1, 6):
            pose = pose @ links[..., i, :, :]
        return pose

    def jacobian(self, joints_rad: ArrayLike) -> FloatArray:
        """(6, 6) twist `[rho; phi]` of the flange, in the base (``T <- exp(J dq) T``), per joint."""
        return self._forward_and_jacobian(joints_rad)[1]

    def _forward_and_jacobian(self, joints_rad: ArrayLike) -> tuple[FloatArray, FloatArray]:
        pose = np.eye(4)
        columns = np.zeros((6, 6))
        for i, link in enumerate(self.links(joints_rad)):
            (ax, ay, az), (x, y, z) = pose[:3, 2], pose[:3, 3]
            columns[:, i] = y * az - z * ay, z * ax - x * az, x * ay - y * ax, ax, ay, az
            pose = pose @ link
        return pose, columns

    def inverse(self, T_base_flange: FloatArray, start_rad: ArrayLike) -> FloatArray:
        """Joint angles (6,) that reach a pose (4, 4), by Newton's method from a posture (6,).

        Raises
        ------
        SolveError
            Out of reach, or not reachable from this posture.
        """
        joints = np.array(start_rad, dtype=np.float64)
        shoulder = np.array([0.0, 0.0, self.parameters[0, 1]])
        if np.linalg.norm(T_base_flange[:3, 3] - shoulder) > np.abs(self.parameters[1:, :2]).sum():
            raise SolveError("the arm does not reach this far", code="out_of_reach")
        for _ in range(MOST_STEPS):
            reached, jacobian = self._forward_and_jacobian(joints)
            error = _core.se3_log((T_base_flange @ inverses(reached))[np.newaxis])[0]
            if np.abs(error).max() < REACHED:
                return joints
            # A little damping carries it past singular postures.
            damped = np.asarray(np.linalg.solve(jacobian @ jacobian.T + 1e-6 * np.eye(6), error), np.float64)
            step = jacobian.T @ damped
            joints += step * min(1.0, LONGEST_STEP_RAD / np.abs(step).max())
        raise SolveError("the arm does not reach this pose from this posture", code="out_of_reach")
