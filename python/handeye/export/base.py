"""What every format has, and how numbers are written in all of them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from handeye.codes import Code
from handeye.errors import OutputError
from handeye.export.mount import Mount
from handeye.types import Pose
from handeye.types.arrays import FloatArray

# Angles that do not give the rotation back to this are never written.
ANGLE_TOLERANCE = 1e-12
_DECIMALS = 15


@dataclass(frozen=True)
class Exporter:
    """One format.

    Attributes
    ----------
    name
        Stable name, as on the command line.
    title
        What it is, for a person.
    suffix
        Usual end of the name of a file of this kind.
    text
        Writes the transform, comments included.

    Examples
    --------
    >>> EXPORTERS["urdf"].suffix
    '.urdf'
    """

    name: str
    title: str
    suffix: str
    text: Callable[[Mount], str]


def number(value: float) -> str:
    """Return a number with up to 15 decimals, without an exponent: YAML 1.1 takes ``1e-05`` for text."""
    text = np.format_float_positional(value, precision=_DECIMALS, unique=True, trim="0")
    return "0.0" if text == "-0.0" else text


def numbers(values: Iterable[float]) -> str:
    """Return numbers with a space between them."""
    return " ".join(number(float(value)) for value in values)


def fixed_axis_angles(pose: Pose) -> FloatArray:
    """Return roll, pitch, yaw (3,) as URDF has them, ``R = Rz(yaw) Ry(pitch) Rx(roll)``, checked.

    Raises
    ------
    OutputError
        They do not give the rotation back; that would be a mistake in handeye.
    """
    angles = pose.roll_pitch_yaw_rad
    deviation = float(np.abs(rotation_of(angles) - pose.rotation).max())
    if not deviation <= ANGLE_TOLERANCE:
        raise OutputError(f"roll, pitch, yaw are {deviation:.1e} off the rotation", code=Code.NOT_EXACT)
    return angles


def rotation_of(angles: FloatArray) -> FloatArray:
    """Return ``Rz(yaw) Ry(pitch) Rx(roll)`` (3, 3) of angles (3,) about fixed axes."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles), np.cos(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def hash_comments(mount: Mount) -> str:
    """Return the remarks as comments of a shell, YAML or Python."""
    return "".join(f"# {remark}\n" for remark in mount.remarks)


def xml_comment(text: str) -> str:
    """Return one line of text as a comment of XML, in which two dashes may not meet nor one stand last."""
    while "--" in text:
        text = text.replace("--", "- -")
    return f"<!-- {text} -->"


def quoted(name: str) -> str:
    """Return a name in double quotes, for YAML and JSON; a bare ``no`` or ``1e3`` would be no text."""
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'
