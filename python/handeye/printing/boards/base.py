"""What a family of targets needs to be printed."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from handeye.printing.shapes import Area, Disc
from handeye.types import Target
from handeye.types.arrays import FloatArray

_Value = TypeVar("_Value", int, float, str)


@dataclass(frozen=True, eq=False)
class Ink:
    """What is printed on a board, in millimetres of the frame of the target.

    Parameters
    ----------
    shapes
        What is black.
    low, high
        (2,) corners of the printed part.
    quiet_mm
        Light margin that the print needs around it to be found.
    """

    shapes: tuple[Area | Disc, ...]
    low: FloatArray
    high: FloatArray
    quiet_mm: float


@dataclass(frozen=True)
class Board:
    """How one family is printed.

    Parameters
    ----------
    family
        Name of the family, as in files.
    ink
        Draws a target of the family.
    caption
        Describes a target in one line, with its measures.
    usual
        Makes a target from the one measure that the others follow (side of a square, pitch, or side of a
        tag, in metres) and from what is asked for.
    """

    family: str
    ink: Callable[[Any], Ink]
    caption: Callable[[Any], str]
    usual: "Callable[[float, Measures], Target]"


@dataclass(frozen=True)
class Measures:
    """What is asked for of a board; None is left to the family, which ignores what it does not have."""

    rows: int | None = None
    columns: int | None = None
    diameter_m: float | None = None
    asymmetric: bool = False
    marked: int | None = None
    marked_diameter_m: float | None = None
    marker_m: float | None = None
    dictionary: str | None = None
    spacing_ratio: float | None = None
    border_bits: int | None = None


def default(value: _Value | None, otherwise: _Value) -> _Value:
    """Return what is asked for, or what the family has otherwise."""
    return otherwise if value is None else value


def mm(metres: float) -> str:
    """Return a length in millimetres with as many digits as it has, up to a nanometre."""
    return f"{round(metres * 1000, 6):.10g} mm"
