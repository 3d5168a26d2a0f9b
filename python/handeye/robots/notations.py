"""Poses as the makers of robots write them, for people who type them in and read them off.

=======  ==========================  =====================================================
name     written                     meaning
=======  ==========================  =====================================================
ur       p[x, y, z, rx, ry, rz]      metres; rotation vector in radians
kuka     {X .., Y .., Z .., A, B, C}  millimetres; degrees, ``Rz(A) Ry(B) Rx(C)``
fanuc    X Y Z W P R                 millimetres; degrees, ``Rz(R) Ry(P) Rx(W)``
abb      [[x, y, z], [q1 .. q4]]     millimetres; quaternion with the real part first
epson    XY(X, Y, Z, U, V, W)        millimetres; degrees, ``Rz(U) Ry(V) Rx(W)``
=======  ==========================  =====================================================
"""

import re
from collections.abc import Sequence
from enum import StrEnum

import numpy as np

from handeye.errors import InputError
from handeye.types import Pose
from handeye.types.arrays import FloatArray

MAX_TEXT = 2000
# Four written digits of a quaternion's components leave its norm off by as much.
QUATERNION_NORM_TOLERANCE = 1e-3
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_LABELLED = re.compile(rf"(?<![A-Za-z0-9])([A-Za-z])\s*[:=]?\s*({_NUMBER})", re.ASCII)


class Notation(StrEnum):
    """Whose way of writing a pose."""

    UR = "ur"
    KUKA = "kuka"
    FANUC = "fanuc"
    ABB = "abb"
    EPSON = "epson"


_LETTERS = {Notation.KUKA: "XYZABC", Notation.FANUC: "XYZWPR", Notation.EPSON: "XYZUVW"}
# Where yaw (about z), pitch (about y) and roll (about x) stand among the three angles.
_YAW_PITCH_ROLL = {Notation.KUKA: (0, 1, 2), Notation.FANUC: (2, 1, 0), Notation.EPSON: (0, 1, 2)}


def pose_numbers(pose: Pose, notation: Notation) -> tuple[float, ...]:
    """Return the six or seven numbers of a pose in the order and units of a notation."""
    if notation is Notation.UR:
        return (*pose.translation.tolist(), *_rotation_vector(pose).tolist())
    position = (1e3 * pose.translation).tolist()
    if notation is Notation.ABB:
        x, y, z, w = pose.quaternion_xyzw.tolist()
        return (*position, w, x, y, z)
    roll, pitch, yaw = np.rad2deg(pose.roll_pitch_yaw_rad).tolist()
    angles = [0.0] * 3
    for place, angle in zip(_YAW_PITCH_ROLL[notation], (yaw, pitch, roll), strict=True):
        angles[place] = angle
    return (*position, *angles)


def pose_of_numbers(numbers: Sequence[float], notation: Notation) -> Pose:
    """Return the pose that six or seven numbers mean in a notation.

    Raises
    ------
    InputError
        Another number of values, one that is not finite, or a quaternion whose norm is not one.
    """
    expected = 7 if notation is Notation.ABB else 6
    if len(numbers) != expected or not np.isfinite(numbers).all():
        raise InputError(
            f"{len(numbers)} numbers, expected {expected} finite ones in the notation of {notation}",
            code="wrong_shape",
            hint=f"write it as {example(notation)}",
        )
    values = np.array(numbers, dtype=np.float64)
    if notation is Notation.UR:
        return _at(values[:3], Pose.exp(np.concatenate([np.zeros(3), values[3:]])).rotation)
    if notation is Notation.ABB:
        w, x, y, z = values[3:]
        return Pose.from_quaternion(values[:3] / 1e3, [x, y, z, w])
    yaw, pitch, roll = np.deg2rad(values[3:][list(_YAW_PITCH_ROLL[notation])])
    return _at(values[:3] / 1e3, _about(2, yaw) @ _about(1, pitch) @ _about(0, roll))


def pose_text(pose: Pose, notation: Notation) -> str:
    """Return a pose as a person at the teach pendant of this maker would read it: to 0.1 um and 1e-5 deg."""
    # Adding zero turns a negative zero into a plain one.
    numbers = [round(value, 9) + 0.0 for value in pose_numbers(pose, notation)]
    if notation is Notation.UR:
        return "p[" + ", ".join(f"{value:.7f}" for value in numbers) + "]"
    position = [f"{value:.4f}" for value in numbers[:3]]
    if notation is Notation.ABB:
        return f"[[{', '.join(position)}], [{', '.join(f'{value:.9f}' for value in numbers[3:])}]]"
    angles = [f"{value:.5f}" for value in numbers[3:]]
    if notation is Notation.EPSON:
        return f"XY({', '.join([*position, *angles])})"
    named = [f"{name} {value}" for name, value in zip(_LETTERS[notation], [*position, *angles], strict=True)]
    return "{" + ", ".join(named) + "}" if notation is Notation.KUKA else "  ".join(named)


def read_pose_text(text: str, notation: Notation) -> Pose:
    """Return the pose that a typed or pasted text means.

    Values named by their letters may come in any order; without letters they come in the order of the
    notation. Brackets, commas and units between them do not matter.

    Raises
    ------
    InputError
        Not the numbers of one pose.
    """
    if len(text) > MAX_TEXT:
        raise InputError(f"{len(text)} characters, expected one pose", code="too_large")
    letters = _LETTERS.get(notation)
    if letters is not None:
        named: dict[str, float] = {}
        for letter, value in _LABELLED.findall(text):
            if letter.upper() in letters:
                if letter.upper() in named:
                    raise InputError(f"{letter.upper()} is there twice", code="duplicate_value")
                named[letter.upper()] = float(value)
        if len(named) == len(letters):
            return pose_of_numbers([named[letter] for letter in letters], notation)
        if named:
            missing = ", ".join(letter for letter in letters if letter not in named)
            raise InputError(
                f"{missing} missing", code="wrong_shape", hint=f"write it as {example(notation)}"
            )
    return pose_of_numbers(read_numbers(text), notation)


def read_numbers(text: str) -> list[float]:
    """Return all numbers in a text, in order."""
    return [float(number) for number in re.findall(_NUMBER, text[:MAX_TEXT], re.ASCII)]


def example(notation: Notation) -> str:
    """Return how a pose looks in a notation."""
    return pose_text(_at(np.array([0.4, 0.0, 0.3]), _about(0, np.pi)), notation)


def _rotation_vector(pose: Pose) -> FloatArray:
    return _at(np.zeros(3), pose.rotation).log()[3:]


def _at(translation_m: FloatArray, rotation: FloatArray) -> Pose:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, translation_m
    return Pose(matrix)


def _about(axis: int, angle_rad: float) -> FloatArray:
    twist = np.zeros(6)
    twist[3 + axis] = angle_rad
    return Pose.exp(twist).rotation
