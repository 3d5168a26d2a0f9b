"""Values in the elements of a robot description: numbers, names and poses, checked for their units."""

import math
import re

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots.xml_tree import Element
from handeye.types.pose import Pose

# Beyond these a number is in other units: no arm is so long, no joint turns so far.
LONGEST_OFFSET_M = 50.0
LARGEST_ANGLE_RAD = 4 * math.pi + 0.01
LARGEST_TURN_RAD = 30.0
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,4})?", re.ASCII)


def placed(element: Element, where: str) -> Pose:
    """Return where the origin of an element puts it.

    Raises
    ------
    InputError
        Numbers that are none, or in the wrong units.
    """
    origin = element.one("origin")
    if origin is None:
        return Pose.identity()
    where = f"{where}: origin"
    xyz = triple(origin, "xyz", where)
    rpy = triple(origin, "rpy", where)
    if max(map(abs, xyz)) > LONGEST_OFFSET_M:
        raise unusable(
            origin,
            f"{where} xyz {xyz}: more than {LONGEST_OFFSET_M:g} m",
            "URDF lengths are metres; divide millimetres by 1000",
        )
    if max(map(abs, rpy)) > LARGEST_ANGLE_RAD:
        raise unusable(
            origin, f"{where} rpy {rpy}: more than two turns", "URDF angles are radians; convert degrees"
        )
    turns = [[0.0] * 3 + [angle if i == axis else 0.0 for i in range(3)] for axis, angle in enumerate(rpy)]
    roll, pitch, yaw = (Pose.exp(turn) for turn in turns)
    return Pose.exp([*xyz, 0, 0, 0]) @ yaw @ pitch @ roll


def attribute_of(element: Element, name: str, what: str) -> str:
    """Return an attribute that must be there."""
    value = element.attributes.get(name, "").strip()
    if not value or len(value) > 300 or not value.isprintable():
        raise unusable(element, f"{what}: attribute {name!r} is missing, too long or not printable")
    return value


def triple(element: Element, name: str, where: str) -> tuple[float, float, float]:
    """Return an attribute of three numbers, zero by default."""
    x, y, z = numbers_of(element, name, where, 3, (0.0, 0.0, 0.0))
    return x, y, z


def numbers_of(
    element: Element, name: str, where: str, count: int, default: tuple[float, ...]
) -> tuple[float, ...]:
    """Return an attribute of so many numbers."""
    text = element.attributes.get(name)
    if text is None:
        return default
    parts = text.split() if len(text) < 60 * count else []
    if len(parts) != count:
        words = {1: "one number", 2: "two numbers", 3: "three numbers"}.get(count, f"{count} numbers")
        raise unusable(element, f"{where} {name}={text[:60]!r}, expected {words}")
    return tuple(_spelled(element, part, f"{where} {name}") for part in parts)


def number_of(element: Element, name: str, where: str, default: float) -> float:
    """Return an attribute that is a number."""
    text = element.attributes.get(name)
    return default if text is None else _spelled(element, text.strip(), f"{where}: {name}")


def _spelled(element: Element, text: str, where: str) -> float:
    value = float(text) if len(text) < 60 and _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise unusable(element, f"{where}: {text[:60]!r} is no finite number")
    return value


def unusable(element: Element, what: str, hint: str | None = None) -> InputError:
    """Return what to raise where an element cannot be used."""
    return InputError(f"line {element.line}: {what}", code=Code.UNUSABLE_URDF, hint=hint)
