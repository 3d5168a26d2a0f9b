"""How the numbers of a pose stand for a rigid transform: a family with one member per representation.

A form turns rows of numbers (N, k) into matrices (N, 4, 4) whose translation is in the unit that was written,
and a matrix back into its k numbers. Angles: Craig, Introduction to Robotics, section 2.8; quaternions:
Diebel, Representing Attitude, 2006, eq. (125).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types import Pose
from handeye.types.arrays import FloatArray
from handeye.types.pose import QUATERNION_NORM_TOLERANCE

_AXES = "xyz"


class Rotation(Protocol):
    """Three or four numbers, or nine, that stand for a rotation."""

    @property
    def count(self) -> int:
        """How many numbers there are."""
        ...

    @property
    def decimals(self) -> int:
        """How many decimals write them to 1e-5 degrees or better."""
        ...

    @property
    def words(self) -> str:
        """What they are, for a person."""
        ...

    def matrices(self, values: FloatArray) -> FloatArray:
        """Return the rotations (N, 3, 3) of rows (N, count); NaN where a row is none."""
        ...

    def values(self, rotation: FloatArray) -> list[float]:
        """Return the numbers of a rotation (3, 3)."""
        ...


@dataclass(frozen=True)
class Euler:
    """Three angles about axes in the order of the numbers.

    Parameters
    ----------
    axes
        Such as ``zyx``: the first number turns about z.
    moving
        Each turn is about an axis that the turns before have moved, ``R = R1(a) R2(b) R3(c)``; otherwise
        about axes that stay, ``R = R3(c) R2(b) R1(a)``.
    degrees
        The unit of the numbers; otherwise radians.
    """

    axes: str
    moving: bool
    degrees: bool = True

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return 3

    @property
    def decimals(self) -> int:
        """How many decimals are enough."""
        return 5 if self.degrees else 7

    @property
    def words(self) -> str:
        """What the rotation is, for a person."""
        return "deg" if self.degrees else "rad"

    def matrices(self, values: FloatArray) -> FloatArray:
        """Return the rotations (N, 3, 3) of rows (N, 3)."""
        angles = np.deg2rad(values) if self.degrees else values
        turns = [about(_AXES.index(axis), angles[:, k]) for k, axis in enumerate(self.axes)]
        first, second, third = turns if self.moving else turns[::-1]
        return first @ second @ third

    def values(self, rotation: FloatArray) -> list[float]:
        """Return the three angles; the second is 0 to 180 degrees, or -90 to 90 where the axes differ."""
        axes = [_AXES.index(axis) for axis in (self.axes if self.moving else self.axes[::-1])]
        angles = _angles(rotation, (axes[0], axes[1], axes[2]))
        ordered = angles if self.moving else angles[::-1]
        return (np.rad2deg(ordered) if self.degrees else ordered).tolist()


@dataclass(frozen=True)
class RotationVector:
    """Axis times angle."""

    degrees: bool = False

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return 3

    @property
    def decimals(self) -> int:
        """How many decimals are enough."""
        return 5 if self.degrees else 7

    @property
    def words(self) -> str:
        """What the rotation is, for a person."""
        return f"a rotation vector in {'deg' if self.degrees else 'rad'}"

    def matrices(self, values: FloatArray) -> FloatArray:
        """Return the rotations (N, 3, 3) of rows (N, 3), by Rodrigues' formula."""
        vectors = np.deg2rad(values) if self.degrees else values
        angles = np.linalg.norm(vectors, axis=1)
        axes = vectors / np.where(angles > 0, angles, 1.0)[:, np.newaxis]
        x, y, z = axes.T
        zero = np.zeros_like(x)
        cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
        sine, cosine = (f(angles)[:, np.newaxis, np.newaxis] for f in (np.sin, np.cos))
        return np.eye(3) + sine * cross + (1 - cosine) * (cross @ cross)

    def values(self, rotation: FloatArray) -> list[float]:
        """Return the vector, of a length of at most half a turn."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        vector = Pose(matrix).log()[3:]
        return (np.rad2deg(vector) if self.degrees else vector).tolist()


@dataclass(frozen=True)
class Quaternion:
    """Four numbers with the real part first or last."""

    real_first: bool

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return 4

    @property
    def decimals(self) -> int:
        """How many decimals are enough."""
        return 9

    @property
    def words(self) -> str:
        """What the rotation is, for a person."""
        return "a quaternion"

    def matrices(self, values: FloatArray) -> FloatArray:
        """Return the rotations (N, 3, 3) of rows (N, 4); NaN where the norm is not 1 up to rounding."""
        norms = np.linalg.norm(values, axis=1)
        usable = np.abs(norms - 1) <= QUATERNION_NORM_TOLERANCE
        unit = values / np.where(usable, norms, np.nan)[:, np.newaxis]
        w, x, y, z = unit.T if self.real_first else np.roll(unit, 1, axis=1).T
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        ).transpose(2, 0, 1)

    def values(self, rotation: FloatArray) -> list[float]:
        """Return the unit quaternion with a real part of at least zero."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        x, y, z, w = Pose(matrix).quaternion_xyzw.tolist()
        return [w, x, y, z] if self.real_first else [x, y, z, w]


@dataclass(frozen=True)
class Nine:
    """The rotation matrix by rows or by columns."""

    by_columns: bool = False

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return 9

    @property
    def decimals(self) -> int:
        """How many decimals are enough."""
        return 9

    @property
    def words(self) -> str:
        """What the rotation is, for a person."""
        return "a rotation matrix"

    def matrices(self, values: FloatArray) -> FloatArray:
        """Return the matrices (N, 3, 3) of rows (N, 9) as they are."""
        matrices = values.reshape(-1, 3, 3)
        return matrices.transpose(0, 2, 1) if self.by_columns else matrices

    def values(self, rotation: FloatArray) -> list[float]:
        """Return the nine entries."""
        return (rotation.T if self.by_columns else rotation).ravel().tolist()


class Form(Protocol):
    """All numbers of a pose."""

    @property
    def counts(self) -> tuple[int, ...]:
        """How many numbers a pose may have, the usual number first."""
        ...

    @property
    def decimals(self) -> int:
        """Decimals of the numbers that are no lengths."""
        ...

    @property
    def words(self) -> str:
        """What stands beside the lengths, for a person."""
        ...

    def matrices(self, values: FloatArray) -> FloatArray:
        """Return matrices (N, 4, 4) of rows (N, k), the translation in the unit written; NaN for none."""
        ...

    def values(self, matrix: FloatArray) -> list[float]:
        """Return the numbers of a transform (4, 4)."""
        ...


@dataclass(frozen=True)
class Vector:
    """Position and rotation one after the other.

    Parameters
    ----------
    rotation
        How the rotation is written.
    position_last
        The rotation comes first.
    """

    rotation: Rotation
    position_last: bool = False

    @property
    def counts(self) -> tuple[int, ...]:
        """How many numbers there are."""
        return (3 + self.rotation.count,)

    @property
    def decimals(self) -> int:
        """Decimals of the rotation."""
        return self.rotation.decimals

    @property
    def words(self) -> str:
        """What the rotation is, for a person."""
        return self.rotation.words

    def matrices(self, values: FloatArray) -> FloatArray:
        """Return matrices (N, 4, 4)."""
        position, turn = (
            (values[:, -3:], values[:, :-3]) if self.position_last else (values[:, :3], values[:, 3:])
        )
        return _stacked(self.rotation.matrices(turn), position)

    def values(self, matrix: FloatArray) -> list[float]:
        """Return the numbers."""
        position, turn = matrix[:3, 3].tolist(), self.rotation.values(matrix[:3, :3])
        return [*turn, *position] if self.position_last else [*position, *turn]


@dataclass(frozen=True)
class Matrix:
    """A matrix of 4 x 4 or 3 x 4 numbers by rows or by columns."""

    by_columns: bool = False

    @property
    def counts(self) -> tuple[int, ...]:
        """16, or 12 without the last row."""
        return (16, 12)

    @property
    def decimals(self) -> int:
        """Decimals of the rotation."""
        return 9

    @property
    def words(self) -> str:
        """What the rotation is, for a person."""
        return "a rotation matrix"

    def matrices(self, values: FloatArray) -> FloatArray:
        """Return matrices (N, 4, 4); NaN where the last row is not 0 0 0 1."""
        rows = values.shape[1] // 4
        if self.by_columns:
            given = values.reshape(-1, 4, rows).transpose(0, 2, 1)
        else:
            given = values.reshape(-1, rows, 4)
        matrices = _stacked(given[:, :3, :3], given[:, :3, 3])
        if rows == 4:
            matrices[np.any(np.abs(given[:, 3] - [0, 0, 0, 1]) > 1e-6, axis=1)] = np.nan
        return matrices

    def values(self, matrix: FloatArray) -> list[float]:
        """Return the sixteen numbers."""
        return (matrix.T if self.by_columns else matrix).ravel().tolist()


def about(axis: int, angles_rad: FloatArray) -> FloatArray:
    """Return the rotations (N, 3, 3) about the axis x, y or z (0, 1, 2) by angles (N,)."""
    matrices = np.tile(np.eye(3), (len(angles_rad), 1, 1))
    j, k = (axis + 1) % 3, (axis + 2) % 3
    sine, cosine = np.sin(angles_rad), np.cos(angles_rad)
    matrices[:, j, j], matrices[:, k, k] = cosine, cosine
    matrices[:, j, k], matrices[:, k, j] = -sine, sine
    return matrices


def _stacked(rotations: FloatArray, positions: FloatArray) -> FloatArray:
    matrices = np.tile(np.eye(4), (len(positions), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = rotations, positions
    return matrices


def _angles(rotation: FloatArray, axes: tuple[int, int, int]) -> FloatArray:
    """Return a, b, c (3,) such that ``Ri(a) Rj(b) Rk(c)`` is the rotation, for axes i, j, k.

    What the first two turns leave is taken from the rotation itself, so the product is exact also where the
    first and the third turn are about one axis and only their sum is determined.
    """
    i, j, k = axes
    if i == k:
        third = 3 - i - j
        sign = 1.0 if (j - i) % 3 == 1 else -1.0
        b = np.arctan2(np.hypot(rotation[i, j], rotation[i, third]), rotation[i, i])
        free = np.hypot(rotation[j, i], rotation[third, i]) > 1e-13
        a = np.arctan2(rotation[j, i], -sign * rotation[third, i]) if free else 0.0
    else:
        sign = 1.0 if (j - i) % 3 == 1 else -1.0
        b = np.arctan2(sign * rotation[i, k], np.hypot(rotation[j, k], rotation[k, k]))
        free = np.hypot(rotation[j, k], rotation[k, k]) > 1e-13
        a = np.arctan2(-sign * rotation[j, k], rotation[k, k]) if free else 0.0
    left = about(j, -np.array([b]))[0] @ about(i, -np.array([a]))[0] @ rotation
    n, m = (k + 1) % 3, (k + 2) % 3
    return np.array([a, b, np.arctan2(left[m, n] - left[n, m], left[n, n] + left[m, m])])


def check_count(count: int, form: Form, what: str) -> None:
    """Refuse another number of numbers than the form has.

    Raises
    ------
    InputError
        It has.
    """
    if count not in form.counts:
        expected = " or ".join(map(str, form.counts))
        raise InputError(f"{what}: {count} numbers, expected {expected}", code=Code.WRONG_SHAPE)
