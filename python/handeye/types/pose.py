"""Rigid transforms.

`T_a_b` maps coordinates in frame b to frame a, so the inner names of a product cancel:
``T_base_flange @ T_flange_camera`` is ``T_base_camera``.
"""

import math
from typing import final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import LARGEST, FloatArray, finite_array

# Below this deviation from a rotation a matrix is kept bit for bit, so that writing and reading change
# nothing.
EXACT_TOLERANCE = 1e-12
# Longest deviation of the norm of a quaternion from 1: three written digits.
QUATERNION_NORM_TOLERANCE = 1e-3


@final
class Pose:
    """A rigid transform of space, immutable.

    Parameters
    ----------
    matrix
        (4, 4) homogeneous matrix, translation in metres. Rounding of the rotation (a deviation from
        orthogonality up to 1e-4, or as large as the three or four written decimals of its entries explain)
        is repaired by the nearest rotation; a matrix that is rigid to 1e-12 is kept bit for bit.

    Raises
    ------
    InputError
        Not (4, 4), an entry that is not finite, not rigid (scaled, sheared, mirrored, another last row), or a
        translation of more than 1e9 m.

    Examples
    --------
    >>> T = Pose.exp([0.1, 0, 0, 0, 0, 0]) @ Pose.identity()
    >>> T.translation.tolist()
    [0.1, 0.0, 0.0]
    """

    __slots__ = ("_matrix",)
    _matrix: FloatArray
    # Arrays must not take a pose apart behind our back: `pose @ array` is an error, `np.asarray(pose)` is
    # meant.
    __array_ufunc__ = None

    def __init__(self, matrix: ArrayLike) -> None:
        given = finite_array(matrix, (4, 4), "pose")
        farthest = float(np.abs(given[:3, 3]).max())
        if farthest > LARGEST:
            raise InputError(f"pose: a translation of {farthest:.3g} m", code=Code.OUT_OF_RANGE)
        if not _core.are_rigid(given[np.newaxis], EXACT_TOLERANCE)[0]:
            if np.abs(given[:3, :3]).max() < 2 and np.linalg.det(given[:3, :3]) < 0:
                raise InputError(
                    "pose: a mirrored (left-handed) frame is not a rigid transform",
                    code=Code.NOT_RIGID,
                    hint="check the order and the signs of the axes",
                )
            given = finite_array(_core.nearest_rigid(_unrounded(given)), (4, 4), "pose")
        self._matrix = given

    @classmethod
    def of_matrices(cls, matrices: ArrayLike) -> "list[Pose]":
        """Return the poses of matrices (N, 4, 4), as the constructor makes them, many times faster.

        Raises
        ------
        InputError
            As the constructor.

        Examples
        --------
        >>> len(Pose.of_matrices(np.stack([np.eye(4), np.eye(4)])))
        2
        """
        given = finite_array(matrices, (None, 4, 4), "poses")
        exact = _core.are_rigid(given, EXACT_TOLERANCE) & (np.abs(given[:, :3, 3]).max(axis=1) <= LARGEST)
        return [cls._trusted(one.copy()) if ok else cls(one) for one, ok in zip(given, exact, strict=True)]

    @classmethod
    def _trusted(cls, matrix: FloatArray) -> "Pose":
        """Return a pose of a matrix that is rigid by construction."""
        pose = cls.__new__(cls)
        matrix.flags.writeable = False
        pose._matrix = matrix  # noqa: SLF001 - of this class
        return pose

    @classmethod
    def identity(cls) -> "Pose":
        """Return the transform that changes nothing."""
        return cls._trusted(np.eye(4))

    @classmethod
    def exp(cls, xi: ArrayLike) -> "Pose":
        """Return the exponential of a twist `[rho; phi]` (6,): metres, then radians.

        Sola, Deray, Atchuthan, "A micro Lie theory", arXiv 1812.01537, eq. (172).

        Raises
        ------
        InputError
            Not (6,) or not finite.
        """
        twist = finite_array(xi, (6,), "twist")
        return cls(_core.se3_exp(twist[np.newaxis])[0])

    @classmethod
    def from_quaternion(cls, translation_m: ArrayLike, quaternion_xyzw: ArrayLike) -> "Pose":
        """Return the pose of a translation (3,) in metres and a quaternion (4,) in the order x, y, z, w.

        Raises
        ------
        InputError
            Not finite, wrong length, or the norm of the quaternion differs from 1 by more than 1e-3.
        """
        translation = finite_array(translation_m, (3,), "translation")
        quaternion = finite_array(quaternion_xyzw, (4,), "quaternion")
        norm = math.hypot(*quaternion)
        if not abs(norm - 1.0) <= QUATERNION_NORM_TOLERANCE:
            raise InputError(
                f"quaternion: norm {norm:.6g}, expected 1",
                code=Code.NOT_RIGID,
                hint="give the quaternion as x, y, z, w with unit norm",
            )
        x, y, z, w = quaternion / norm
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:3, 3] = translation
        return cls(matrix)

    @property
    def matrix(self) -> FloatArray:
        """(4, 4) homogeneous matrix, read-only, translation in metres."""
        return self._matrix

    @property
    def rotation(self) -> FloatArray:
        """(3, 3) rotation matrix, read-only."""
        return self._matrix[:3, :3]

    @property
    def translation(self) -> FloatArray:
        """(3,) translation in metres, read-only."""
        return self._matrix[:3, 3]

    @property
    def quaternion_xyzw(self) -> FloatArray:
        """(4,) unit quaternion in the order x, y, z, w; of the two signs the one with w >= 0."""
        r = self._matrix
        # Shepperd's choice of the largest component keeps the division safe at every angle.
        candidates = np.array(
            [
                [1 + r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
                [r[0, 1] + r[1, 0], 1 - r[0, 0] + r[1, 1] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
                [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1 - r[0, 0] - r[1, 1] + r[2, 2], r[1, 0] - r[0, 1]],
                [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + r[0, 0] + r[1, 1] + r[2, 2]],
            ]
        )
        quaternion = candidates[int(np.argmax(np.diag(candidates)))]
        return quaternion / np.linalg.norm(quaternion) * (-1.0 if quaternion[3] < 0 else 1.0)

    @property
    def roll_pitch_yaw_rad(self) -> FloatArray:
        """(3,) angles about the fixed axes x, y and z, as in URDF: `R = Rz(yaw) Ry(pitch) Rx(roll)`.

        Pitch lies in -pi/2 to pi/2; where it is at either end, roll is zero.
        """
        r = self.rotation
        cosine = float(np.hypot(r[0, 0], r[1, 0]))
        pitch = np.arctan2(-r[2, 0], cosine)
        if cosine < 1e-13:
            return np.array([0.0, pitch, np.arctan2(-r[0, 1], r[1, 1])])
        yaw = np.arctan2(r[1, 0], r[0, 0])
        # Near the ends of pitch neither yaw nor roll is well determined, but together they are: roll is what
        # is left once yaw is taken away.
        sine, cosine = np.sin(yaw), np.cos(yaw)
        roll = np.arctan2(sine * r[0, 2] - cosine * r[1, 2], cosine * r[1, 1] - sine * r[0, 1])
        return np.array([roll, pitch, yaw])

    @property
    def rotation_angle_rad(self) -> float:
        """Angle of the rotation, 0 to pi."""
        r = self.rotation
        twice_sine = np.linalg.norm([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        return float(np.arctan2(twice_sine, np.trace(r) - 1.0))

    def inverse(self) -> "Pose":
        """Return `T_b_a` of `T_a_b`."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation.T
        matrix[:3, 3] = -(self.rotation.T @ self.translation)
        return Pose._trusted(matrix)

    def log(self) -> FloatArray:
        """Return the twist `[rho; phi]` (6,), metres and radians, whose exponential is this pose."""
        return _core.se3_log(self._matrix[np.newaxis])[0]

    def adjoint(self) -> FloatArray:
        """Return the (6, 6) adjoint, ``exp(Ad(T) xi) = T exp(xi) T^-1``, for twists `[rho; phi]`."""
        return _core.se3_adjoint(self._matrix[np.newaxis])[0]

    def act(self, points: ArrayLike) -> FloatArray:
        """Return points (N, 3) of frame b in frame a, in metres.

        Raises
        ------
        InputError
            Not (N, 3) or not finite.
        """
        return finite_array(points, (None, 3), "points") @ self.rotation.T + self.translation

    def to_list(self) -> list[list[float]]:
        """Return the matrix as four rows of four numbers; `Pose(rows)` reads it back."""
        return self._matrix.tolist()

    def __matmul__(self, other: "Pose") -> "Pose":
        if not isinstance(other, Pose):  # pyright: ignore[reportUnnecessaryIsInstance]
            return NotImplemented
        return Pose._trusted(self._matrix @ other._matrix)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[np.generic]:
        return np.array(self._matrix, dtype=dtype, copy=copy)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pose) and bool(np.array_equal(self._matrix, other._matrix))

    def __hash__(self) -> int:
        return hash((self._matrix + 0.0).tobytes())  # + 0.0: minus zero equals zero

    def __reduce__(self) -> tuple[type["Pose"], tuple[list[list[float]]]]:
        return Pose, (self.to_list(),)

    def __repr__(self) -> str:
        x, y, z = self.translation
        qx, qy, qz, qw = self.quaternion_xyzw
        return f"Pose([{x:.6g}, {y:.6g}, {z:.6g}] m, xyzw [{qx:.6g}, {qy:.6g}, {qz:.6g}, {qw:.6g}])"


def _unrounded(matrix: FloatArray) -> FloatArray:
    """Return a matrix whose rotation was written with few decimals, with the nearest rotation in its place.

    Entries off by half a unit of the last decimal leave a row or column of a rotation, and two of them with
    each other, off by at most sqrt(3) of that unit; the squares of the errors are left room for.
    """
    rotation = matrix[:3, :3]
    for unit in (1e-4, 1e-3):
        rounded = np.round(rotation / unit) * unit
        with np.errstate(over="ignore", invalid="ignore"):
            deviation = np.abs(rotation.T @ rotation - np.eye(3)).max()
        if np.abs(rounded - rotation).max() < 1e-12 and deviation <= 1.01 * math.sqrt(3.0) * unit:
            left, _, right = np.linalg.svd(rotation)
            nearest = matrix.copy()
            nearest[:3, :3] = left @ right
            return nearest
    return matrix


def inverses(poses: FloatArray) -> FloatArray:
    """(..., 4, 4) inverses of rigid transforms (..., 4, 4)."""
    turned = np.swapaxes(poses[..., :3, :3], -2, -1)
    found = np.zeros_like(poses, dtype=np.float64)
    found[..., :3, :3] = turned
    found[..., :3, 3] = -(turned @ poses[..., :3, 3:])[..., 0]
    found[..., 3, 3] = 1.0
    return found


def through_twist(points: FloatArray, in_point: FloatArray) -> FloatArray:
    """Turn derivatives in points into derivatives in a twist that moves the points.

    The twist `xi = [rho; phi]` acts on the left, `p <- exp(xi) p`, so that `dp = [I, -[p]x] xi`; of a row
    `d` of derivatives in `p` it makes `[d, p x d]`.

    Parameters
    ----------
    points
        (N, 3) points, metres.
    in_point
        (N, m, 3) derivatives of m values in each point.

    Returns
    -------
    FloatArray
        (N, m, 6) derivatives in the twist: metres, radians.
    """
    return np.concatenate([in_point, np.cross(points[:, np.newaxis], in_point)], axis=2)
