"""A target on a sheet of paper, at true scale, with rulers to check it and a caption that says what it is."""

import bisect
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.printing import ruler
from handeye.printing.ink import Ink, ink_of
from handeye.printing.paper import Paper
from handeye.printing.shapes import Drawing, Shape, Words
from handeye.types import Target
from handeye.types.arrays import FloatArray

# Border that most printers leave blank.
MARGIN_MM = 6.0
_TEXT_MM = 2.5
_LINE_MM = 3.8
# Mean width of a letter over its height, of the wider of the two fonts.
_LETTER = 0.63
# A measure that is chosen for the paper is a multiple of the first of these of which it is at least ten.
_STEPS_MM = (1.0, 0.5, 0.1)
_MOST_STEPS = 5000
# Room for a caption that is longer than the one of a measure of one metre.
_LONGER = " " + "0" * 8

ADVICE = (
    "Print at 100 % (actual size): both rulers must measure true, else multiply the lengths in the target "
    "file by measured / stated."
)


@dataclass(frozen=True, eq=False)
class Sheet:
    """A target that is laid out.

    Attributes
    ----------
    target
        What is printed.
    paper
        The sheet, turned as it is used.
    caption
        Describes the target.
    size_mm
        (2,) width and height of the printed pattern.
    origin_mm
        (2,) where the origin of the target is on the sheet, from its upper left corner.
    drawing
        What is drawn.
    """

    target: Target
    paper: Paper
    caption: str
    size_mm: FloatArray
    origin_mm: FloatArray
    drawing: Drawing


def lay_out(target: Target, paper: Paper) -> Sheet:
    """Put a target on a sheet, turned if it fits only so.

    Raises
    ------
    InputError
        It does not fit, or its family cannot be drawn.
    """
    ink, caption = ink_of(target), target.caption
    size = ink.high - ink.low
    for sheet in (paper, paper.turned):
        room = _Room(sheet, caption, size, ink.quiet_mm)
        if room.holds(size):
            return _placed(target, room, ink)
    need = size + _Room(paper, caption, size, ink.quiet_mm).around
    raise InputError(
        f"{caption}: needs {need[0]:.0f} x {need[1]:.0f} mm with margin and rulers, more than {paper.name}",
        code=Code.DOES_NOT_FIT,
        hint="take larger paper or smaller measures; without any, the largest that fit are taken",
    )


def largest(family: str, asked: Mapping[str, Any], paper: Paper) -> Target:
    """Return the target of a family with the largest measures that fit on a sheet, in whole millimetres.

    Raises
    ------
    InputError
        Nothing of that kind fits.
    """
    member = Target.member(family)
    caption = member.usual(1.0, asked).caption + _LONGER
    # Everything grows in proportion to the one measure, apart from what was asked for in millimetres.
    small, big = (ink_of(member.usual(scale, asked)) for scale in (1.0, 2.0))
    size_slope, quiet_slope = _size(big) - _size(small), big.quiet_mm - small.quiet_mm

    def fits(scale_m: float) -> bool:
        size = _size(small) + (scale_m - 1.0) * size_slope
        quiet = small.quiet_mm + (scale_m - 1.0) * quiet_slope
        return any(_Room(sheet, caption, size, quiet).holds(size) for sheet in (paper, paper.turned))

    for step in _STEPS_MM:
        multiples = range(1, _MOST_STEPS + 1)
        most = bisect.bisect_left(multiples, x=True, key=lambda n: not fits(n * step / 1000))
        if most >= 10:
            return member.usual(round(most * step / 1000, 9), asked)
    raise InputError(
        f"{family}: does not fit on {paper.name}", code=Code.DOES_NOT_FIT, hint="fewer rows and columns"
    )


def _size(ink: Ink) -> FloatArray:
    return ink.high - ink.low


class _Room:
    """What margins, rulers and text leave of a sheet: from `low` to `high`, (2,) each."""

    def __init__(self, paper: Paper, caption: str, size: FloatArray, quiet_mm: float) -> None:
        self.paper = paper
        self.caption = _wrapped(caption, paper)
        self.lines = [
            *self.caption,
            *_wrapped(f"Edge to edge {size[0]:.2f} x {size[1]:.2f} mm. {ADVICE}", paper),
        ]
        self.text_from = paper.height_mm - MARGIN_MM - len(self.lines) * _LINE_MM
        # Where there is nothing but the edge of the paper, its margin is the quiet zone.
        free = max(MARGIN_MM, quiet_mm)
        self.low = np.array([MARGIN_MM + ruler.WIDTH_MM + quiet_mm, free])
        self.high = np.array([paper.width_mm - free, self.text_from - ruler.HEIGHT_MM - quiet_mm])

    @property
    def around(self) -> FloatArray:
        return np.array([self.paper.width_mm, self.paper.height_mm]) - (self.high - self.low)

    def holds(self, size: FloatArray) -> bool:
        return bool(np.all(size <= self.high - self.low + 1e-9))


def _placed(target: Target, room: _Room, ink: Ink) -> Sheet:
    paper, size = room.paper, _size(ink)
    origin = (room.low + room.high - size) / 2 - ink.low
    shapes: list[Shape] = [shape.moved(origin) for shape in ink.shapes]
    left, below = MARGIN_MM + ruler.WIDTH_MM, room.text_from - ruler.HEIGHT_MM
    across = ruler.length_for(paper.width_mm - MARGIN_MM - left)
    if across:
        shapes += ruler.horizontal(left, below, across)
    # Half a number reaches beyond the end of a ruler.
    down = ruler.length_for(below - MARGIN_MM - 2)
    if down:
        shapes += ruler.vertical(MARGIN_MM, MARGIN_MM + 1, down)
    for number, line in enumerate(room.lines):
        baseline = room.text_from + (number + 0.8) * _LINE_MM
        shapes.append(Words(MARGIN_MM, baseline, line, _TEXT_MM, bold=number < len(room.caption)))
    caption = " ".join(room.caption)
    drawing = Drawing(paper.width_mm, paper.height_mm, caption, tuple(shapes))
    return Sheet(target, paper, caption, size, origin, drawing)


def _wrapped(text: str, paper: Paper) -> list[str]:
    letters = int((paper.width_mm - 2 * MARGIN_MM) / (_LETTER * _TEXT_MM))
    return textwrap.wrap(text, max(letters, 20))
