"""Numbers in the attributes of descriptions of robots."""

import math
import re

from handeye.errors import InputError
from handeye.robots.xml_tree import Element

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,4})?", re.ASCII)


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
    return InputError(f"line {element.line}: {what}", code="unusable_urdf", hint=hint)
