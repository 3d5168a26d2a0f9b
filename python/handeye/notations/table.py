"""The one table of notations: how robots, programs and people write poses.

======================  ==============================  ================================================
name                    written                         meaning
======================  ==============================  ================================================
ur                      p[x, y, z, rx, ry, rz]          rotation vector in radians; metres in programs,
                                                        millimetres on the pendant
kuka                    {X .., Y .., Z .., A, B, C}     mm; degrees, ``Rz(A) Ry(B) Rx(C)``
fanuc                   X Y Z W P R                     mm; degrees, ``Rz(R) Ry(P) Rx(W)``
abb                     [[x, y, z], [q1 .. q4]]         mm; quaternion with the real part first
epson                   XY(X, Y, Z, U, V, W)            mm; degrees, ``Rz(U) Ry(V) Rx(W)``
doosan                  posx(x, y, z, a, b, c)          mm; degrees, ``Rz(A) Ry(B) Rz(C)``
staubli                 {x, y, z, rx, ry, rz}           mm; degrees, ``Rx(rx) Ry(ry) Rz(rz)``
yaskawa                 X Y Z Rx Ry Rz                  mm; degrees, ``Rz(Rz) Ry(Ry) Rx(Rx)``
mitsubishi              (X, Y, Z, A, B, C)              mm; degrees, ``Rz(C) Ry(B) Rx(A)``
nachi                   X Y Z r p y                     mm; degrees, ``Rz(r) Ry(p) Rx(y)``
denso                   P(X, Y, Z, RX, RY, RZ)          mm; degrees, ``Rz(RZ) Ry(RY) Rx(RX)``
xarm                    [x, y, z, roll, pitch, yaw]     mm; degrees, ``Rz(yaw) Ry(pitch) Rx(roll)``
kawasaki                X Y Z O A T                     mm; degrees, ``Rz(O) Ry(A) Rz(T)``
franka                  16 numbers                      metres; 4 x 4 by columns (`O_T_EE`)
tum                     t x y z qx qy qz qw             metres; the first number is a time
quaternion_xyzw         x y z qx qy qz qw               as ROS and SciPy have it
quaternion_wxyz         x y z qw qx qy qz               as Eigen's constructor and MuJoCo have it
rotation_vector         x y z rx ry rz                  axis times angle in radians, as OpenCV's `rvec`
rotation_vector_deg     x y z rx ry rz                  the same in degrees
matrix                  16 or 12 numbers                4 x 4 or 3 x 4 by rows
matrix_columns          16 or 12 numbers                4 x 4 or 3 x 4 by columns
rotation_position       9 + 3 numbers                   rotation matrix by rows, then the position
position_rotation       3 + 9 numbers                   position, then the rotation matrix by rows
wxyz_position           qw qx qy qz x y z               quaternion, then position
xyzw_position           qx qy qz qw x y z               quaternion, then position
euler_IJK_HOW_UNIT      x y z a b c                     any axes, such as euler_zyx_moving_deg or
                                                        euler_xyz_fixed_rad: a about the first axis
======================  ==============================  ================================================

Sources: Mech-Mind, "Euler angles: definition and convention" (which maker has which order); Roboception and
Basler, "Pose formats" (ABB, FANUC, Franka, KUKA, Mitsubishi, UR, Yaskawa); UFACTORY's user manual (xArm);
franka-emika libfranka, `RobotState::O_T_EE`; TUM RGB-D benchmark, "File formats".
"""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.notations.forms import Euler, Form, Matrix, Nine, Quaternion, RotationVector, Vector, check_count
from handeye.types import Pose
from handeye.types.arrays import FloatArray

# Metres in a unit of length.
UNITS_M = {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "inch": 0.0254}


class Unit(StrEnum):
    """Unit of the lengths in a file of poses."""

    MM = "mm"
    M = "m"
    CM = "cm"
    INCH = "inch"

    @property
    def metres(self) -> float:
        """How many metres it has."""
        return UNITS_M[self.value]


class Direction(StrEnum):
    """Whose pose in which frame is written."""

    FLANGE_IN_BASE = "flange_in_base"
    BASE_IN_FLANGE = "base_in_flange"


@dataclass(frozen=True)
class Notation:
    """A way of writing poses.

    Parameters
    ----------
    name
        Stable name, as on the command line.
    form
        What the numbers mean.
    unit
        Unit of lengths; None where several are in use, so that it has to be said.
    labels
        Names of the numbers, where they are written with them.
    layout
        How the numbers are put together: one gap for all of them, or one for position and one for rotation.
    is_named
        Every number stands behind its label.
    leading
        So many numbers come before the pose.
    """

    name: str
    form: Form
    unit: Unit | None = None
    labels: tuple[str, ...] = ()
    layout: str = "{}"
    is_named: bool = False
    leading: int = 0

    @property
    def counts(self) -> tuple[int, ...]:
        """How many numbers a row may have, those before the pose included."""
        return tuple(count + self.leading for count in self.form.counts)

    @property
    def default_unit(self) -> Unit:
        """The unit where nothing is said: the maker's, or metres."""
        return self.unit or Unit.M

    def matrices(self, rows: FloatArray, unit: Unit) -> FloatArray:
        """Return matrices (N, 4, 4) in metres of rows (N, k); NaN where the numbers are no pose."""
        matrices = self.form.matrices(rows[:, self.leading :])
        matrices[:, :3, 3] *= unit.metres
        return matrices

    def pose(self, numbers: Sequence[float], unit: Unit | None = None) -> Pose:
        """Return the pose that numbers mean.

        Raises
        ------
        InputError
            Another number of values, one that is not finite, a quaternion whose norm is not one, or a matrix
            that is not rigid.
        """
        values = np.array(numbers, dtype=np.float64).reshape(1, -1)
        if not np.isfinite(values).all():
            raise InputError(f"{self.name}: a number that is not finite", code=Code.NOT_FINITE)
        check_count(values.shape[1] - self.leading, self.form, self.name)
        matrix = self.matrices(values, unit or self.default_unit)[0]
        if np.isnan(matrix).any():
            quaternion = isinstance(self.form, Vector) and isinstance(self.form.rotation, Quaternion)
            found = "a quaternion whose norm is not 1" if quaternion else "a last row that is not 0 0 0 1"
            raise InputError(f"{self.name}: {found}", code=Code.NOT_RIGID)
        return Pose(matrix)

    def numbers(self, pose: Pose, unit: Unit | None = None) -> tuple[float, ...]:
        """Return the numbers of a pose, zeros for those before it."""
        matrix = pose.matrix.copy()
        matrix[:3, 3] /= (unit or self.default_unit).metres
        return (*[0.0] * self.leading, *self.form.values(matrix))


def _euler(axes: str, *, moving: bool) -> Vector:
    return Vector(Euler(axes, moving))


_FIXED_XYZ, _MOVING_ZYX, _MOVING_ZYZ = (
    _euler("xyz", moving=False),
    _euler("zyx", moving=True),
    _euler("zyz", moving=True),
)
_XYZ = ("X", "Y", "Z")
_RXYZ = (*_XYZ, "Rx", "Ry", "Rz")

MAKERS: tuple[Notation, ...] = (
    Notation("ur", Vector(RotationVector()), None, _RXYZ, "p[{}]"),
    Notation("kuka", _MOVING_ZYX, Unit.MM, (*_XYZ, "A", "B", "C"), "{{{}}}", is_named=True),
    Notation("fanuc", _FIXED_XYZ, Unit.MM, (*_XYZ, "W", "P", "R"), is_named=True),
    Notation(
        "abb", Vector(Quaternion(real_first=True)), Unit.MM, (*_XYZ, "q1", "q2", "q3", "q4"), "[[{}], [{}]]"
    ),
    Notation("epson", _MOVING_ZYX, Unit.MM, (*_XYZ, "U", "V", "W"), "XY({})"),
    Notation("doosan", _MOVING_ZYZ, Unit.MM, (*_XYZ, "A", "B", "C"), "posx({})"),
    Notation("staubli", _euler("xyz", moving=True), Unit.MM, _RXYZ, "{{{}}}"),
    Notation("yaskawa", _FIXED_XYZ, Unit.MM, _RXYZ, is_named=True),
    Notation("mitsubishi", _FIXED_XYZ, Unit.MM, (*_XYZ, "A", "B", "C"), "({})"),
    # Its letters r, p, y would meet Y of the position.
    Notation("nachi", _MOVING_ZYX, Unit.MM, layout="({})"),
    Notation("denso", _FIXED_XYZ, Unit.MM, _RXYZ, "P({})"),
    Notation("xarm", _FIXED_XYZ, Unit.MM, (*_XYZ, "roll", "pitch", "yaw"), "[{}]"),
    Notation("kawasaki", _MOVING_ZYZ, Unit.MM, (*_XYZ, "O", "A", "T"), is_named=True),
    Notation("franka", Matrix(by_columns=True), Unit.M, layout="[{}]"),
    Notation("tum", Vector(Quaternion(real_first=False)), Unit.M, leading=1),
)
PLAIN: tuple[Notation, ...] = (
    Notation("quaternion_xyzw", Vector(Quaternion(real_first=False))),
    Notation("quaternion_wxyz", Vector(Quaternion(real_first=True))),
    Notation("rotation_vector", Vector(RotationVector())),
    Notation("rotation_vector_deg", Vector(RotationVector(degrees=True))),
    Notation("matrix", Matrix()),
    Notation("matrix_columns", Matrix(by_columns=True)),
    Notation("rotation_position", Vector(Nine(), position_last=True)),
    Notation("position_rotation", Vector(Nine())),
    Notation("wxyz_position", Vector(Quaternion(real_first=True), position_last=True)),
    Notation("xyzw_position", Vector(Quaternion(real_first=False), position_last=True)),
)
# Twelve orders of axes: no axis twice in a row.
AXES = tuple("".join(t) for t in itertools.product("xyz", repeat=3) if t[0] != t[1] != t[2])
EULER: tuple[Notation, ...] = tuple(
    Notation(
        f"euler_{axes}_{'moving' if moving else 'fixed'}_{'deg' if degrees else 'rad'}",
        Vector(Euler(axes, moving, degrees)),
    )
    for degrees in (True, False)
    for moving in (True, False)
    for axes in AXES
)
NOTATIONS: dict[str, Notation] = {n.name: n for n in (*MAKERS, *PLAIN, *EULER)}
# Goals are shown in these to a person at the pendant.
SHOWN = tuple(NOTATIONS[name] for name in ("ur", "kuka", "fanuc", "abb", "epson"))
_NOT_A_NAME = re.compile(r"[^a-z0-9]+")


def unit_of(name: str) -> Unit:
    """Return the unit of a name.

    Raises
    ------
    InputError
        There is none.
    """
    try:
        return Unit(name.strip().lower())
    except ValueError:
        raise InputError(
            f"unit {name[:60]!r}, expected one of {', '.join(Unit)}", code=Code.UNKNOWN_UNIT
        ) from None


def direction_of(name: str) -> Direction:
    """Return the direction of a name; dashes and underscores do not matter.

    Raises
    ------
    InputError
        There is none.
    """
    try:
        return Direction(_NOT_A_NAME.sub("_", name.strip().lower()))
    except ValueError:
        raise InputError(
            f"poses are {name[:60]!r}, expected {' or '.join(Direction)}", code=Code.UNKNOWN_DIRECTION
        ) from None


def notation_of(name: str) -> Notation:
    """Return the notation of a name; capitals, dashes and underscores do not matter.

    Raises
    ------
    InputError
        There is none.
    """
    found = NOTATIONS.get(_NOT_A_NAME.sub("_", name.strip().lower()))
    if found is None:
        names = ", ".join(n.name for n in (*MAKERS, *PLAIN))
        raise InputError(
            f"notation {name[:60]!r}, expected one of {names}, or euler_zyx_moving_deg and its like",
            code=Code.UNKNOWN_NOTATION,
            hint="docs/conventions.md has the table of notations",
        )
    return found
