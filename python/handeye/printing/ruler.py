"""Rulers, to measure whether a print has its true size."""

from handeye.printing.shapes import Line, Shape, Words

# Lengths of a ruler: the longest that has room shows a wrong scale best.
_LENGTHS_MM = (400, 300, 200, 150, 100, 50, 20)
_TICKS = ((10, 4.0), (5, 3.0), (1, 2.0))
_HAIR_MM = 0.15
_NUMBER_MM = 2.2
WIDTH_MM, HEIGHT_MM = 10.0, 8.0
"""Room that an upright and a lying ruler take beside their lines, numbers included."""


def length_for(room_mm: float) -> int:
    """Return the longest ruler (mm) that has room, 0 if none has."""
    return next((length for length in _LENGTHS_MM if length <= room_mm), 0)


def horizontal(x: float, y: float, length: int) -> list[Shape]:
    """Draw a ruler from (x, y) to the right, with its ticks downwards."""
    shapes: list[Shape] = [Line(x, y, x + length, y, _HAIR_MM)]
    for at in range(length + 1):
        shapes.append(Line(x + at, y, x + at, y + _tick(at), _HAIR_MM))
        if at % _numbered(length) == 0:
            shapes.append(Words(x + at, y + 7.0, _label(at, length), _NUMBER_MM, "middle"))
    return shapes


def vertical(x: float, y: float, length: int) -> list[Shape]:
    """Draw a ruler from (x, y) downwards, with its ticks to the right."""
    shapes: list[Shape] = [Line(x, y, x, y + length, _HAIR_MM)]
    for at in range(length + 1):
        shapes.append(Line(x, y + at, x + _tick(at), y + at, _HAIR_MM))
        if at % _numbered(length) == 0:
            shapes.append(Words(x + 4.6, y + at + 0.35 * _NUMBER_MM, str(at), _NUMBER_MM))
    return shapes


def _tick(at: int) -> float:
    return next(length for step, length in _TICKS if at % step == 0)


def _numbered(length: int) -> int:
    """Return how far apart the numbers are."""
    return 10 if length <= 100 else 50


def _label(at: int, length: int) -> str:
    return f"{at} mm" if at == length else str(at)
