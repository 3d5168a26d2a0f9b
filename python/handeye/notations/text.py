"""One pose as a person types it in and reads it off."""

import re

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.notations.forms import about
from handeye.notations.table import Notation, Unit
from handeye.types import Pose

MAX_TEXT = 2000
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_LENGTH_DECIMALS = {Unit.M: 7, Unit.MM: 4, Unit.CM: 5, Unit.INCH: 6}


def pose_text(pose: Pose, notation: Notation, unit: Unit | None = None) -> str:
    """Return a pose as a person at the teach pendant of this maker would read it: to 0.1 um and 1e-5 deg."""
    lengths = _LENGTH_DECIMALS[unit or notation.default_unit]
    numbers = notation.numbers(pose, unit)
    # Adding zero turns a negative zero into a plain one.
    written = [
        f"{round(value, 9) + 0.0:.{lengths if k < 3 else notation.form.decimals}f}"
        for k, value in enumerate(numbers)
    ]
    if notation.is_named:
        written = [f"{name} {value}" for name, value in zip(notation.labels, written, strict=True)]
    if notation.layout.count("{}") == 2:
        return notation.layout.format(", ".join(written[:3]), ", ".join(written[3:]))
    separator = "  " if notation.is_named and notation.layout == "{}" else ", "
    return notation.layout.format(separator.join(written))


def read_pose_text(text: str, notation: Notation, unit: Unit | None = None) -> Pose:
    """Return the pose that a typed or pasted text means.

    Values behind their labels may come in any order; without labels they come in the order of the notation.
    Brackets, commas and units between them do not matter.

    Raises
    ------
    InputError
        Not the numbers of one pose.
    """
    if len(text) > MAX_TEXT:
        raise InputError(f"{len(text)} characters, expected one pose", code=Code.TOO_LARGE)
    hint = f"write it as {example(notation, unit)}"
    named = labelled_numbers(text, notation)
    if named is None:
        numbers = read_numbers(text)
    elif len(named) < len(notation.labels):
        missing = ", ".join(label for label in notation.labels if label not in named)
        raise InputError(f"{missing} missing", code=Code.WRONG_SHAPE, hint=hint)
    else:
        numbers = [named[label] for label in notation.labels]
    try:
        return notation.pose(numbers, unit)
    except InputError as error:
        raise InputError(error.message, code=error.code, hint=hint) from error


def labelled_numbers(text: str, notation: Notation) -> dict[str, float] | None:
    """Return the numbers that stand behind labels of the notation; None if there is no such label.

    Raises
    ------
    InputError
        A label is there twice.
    """
    if not notation.labels:
        return None
    known = {label.lower(): label for label in notation.labels}
    names = "|".join(sorted(map(re.escape, known), key=len, reverse=True))
    found: dict[str, float] = {}
    pattern = rf"(?<![A-Za-z0-9_])({names})\s*[:=]?\s*({NUMBER})"
    for name, value in re.findall(pattern, text, re.ASCII | re.IGNORECASE):
        label = known[name.lower()]
        if label in found:
            raise InputError(f"{label} is there twice", code=Code.DUPLICATE_VALUE)
        found[label] = float(value)
    return found or None


def read_numbers(text: str) -> list[float]:
    """Return all numbers in a text, in order."""
    return [float(number) for number in re.findall(NUMBER, text[:MAX_TEXT], re.ASCII)]


def example(notation: Notation, unit: Unit | None = None) -> str:
    """Return how a pose looks in a notation."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = about(0, np.array([np.pi]))[0], [0.4, 0.0, 0.3]
    return pose_text(Pose(matrix), notation, unit)
