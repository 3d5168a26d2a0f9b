"""What a drawing is made of: black shapes and words, in millimetres, x to the right and y down."""

from dataclasses import dataclass, replace

import numpy as np

from handeye.types.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Area:
    """A black area bounded by closed loops (N, 2); holes run the other way round."""

    loops: tuple[FloatArray, ...]

    def moved(self, by: FloatArray) -> "Area":
        """Return the area shifted by (2,)."""
        return Area(tuple(loop + by for loop in self.loops))


@dataclass(frozen=True)
class Disc:
    """A black disc."""

    x: float
    y: float
    radius: float

    def moved(self, by: FloatArray) -> "Disc":
        """Return the disc shifted by (2,)."""
        return replace(self, x=self.x + float(by[0]), y=self.y + float(by[1]))


@dataclass(frozen=True)
class Line:
    """A straight black line with blunt ends."""

    x1: float
    y1: float
    x2: float
    y2: float
    width: float


@dataclass(frozen=True)
class Words:
    """One line of text; (x, y) is on its baseline, at the start, middle or end of it."""

    x: float
    y: float
    text: str
    size: float
    anchor: str = "start"
    bold: bool = False


Shape = Area | Disc | Line | Words


@dataclass(frozen=True, eq=False)
class Drawing:
    """A sheet with shapes on it."""

    width_mm: float
    height_mm: float
    title: str
    shapes: tuple[Shape, ...]


def rectangle(x: float, y: float, width: float, height: float) -> FloatArray:
    """Return the loop (4, 2) of an upright rectangle."""
    return np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])


def printable(text: str) -> str:
    """Return text without characters that neither a file nor a reader should meet."""
    return "".join(character if character.isprintable() else "?" for character in text)
