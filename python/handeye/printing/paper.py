"""Sheets of paper."""

import re
from dataclasses import dataclass

from handeye.codes import Code
from handeye.errors import InputError

# Anything from a business card to a plotter's roll.
SMALLEST_MM, LARGEST_MM = 50.0, 5000.0
_CUSTOM = re.compile(r"(\d{1,4}(?:\.\d{1,3})?)x(\d{1,4}(?:\.\d{1,3})?)", re.ASCII)
_NAMED = {
    "a2": (420.0, 594.0),
    "a3": (297.0, 420.0),
    "a4": (210.0, 297.0),
    "a5": (148.0, 210.0),
    "letter": (215.9, 279.4),
    "legal": (215.9, 355.6),
    "tabloid": (279.4, 431.8),
}


@dataclass(frozen=True)
class Paper:
    """A sheet.

    Parameters
    ----------
    width_mm, height_mm
        Its sides, each 50 to 5000 mm.
    name
        What it is called.

    Raises
    ------
    InputError
        A side out of its range.
    """

    width_mm: float
    height_mm: float
    name: str

    def __post_init__(self) -> None:
        for side in (self.width_mm, self.height_mm):
            if not SMALLEST_MM <= side <= LARGEST_MM:
                raise InputError(
                    f"paper: a side of {side:g} mm, expected {SMALLEST_MM:g} to {LARGEST_MM:g} mm",
                    code=Code.OUT_OF_RANGE,
                )

    @classmethod
    def of(cls, text: str) -> "Paper":
        """Return the sheet of a name (a4, a3, letter, ...) or of its sides in mm, such as ``600x400``.

        Raises
        ------
        InputError
            Neither of both.
        """
        name = text.strip().lower()
        if name in _NAMED:
            return cls(*_NAMED[name], name=name.upper() if name.startswith("a") else name.capitalize())
        custom = _CUSTOM.fullmatch(name)
        if custom is None:
            raise InputError(
                f"paper: {text[:40]!r}, expected {', '.join(_NAMED)} or WIDTHxHEIGHT in mm such as 600x400",
                code=Code.UNKNOWN_PAPER,
            )
        width, height = map(float, custom.groups())
        return cls(width, height, f"{width:g} x {height:g} mm")

    @property
    def turned(self) -> "Paper":
        """The sheet on its side."""
        return Paper(self.height_mm, self.width_mm, self.name)

    @property
    def is_landscape(self) -> bool:
        """Whether the sheet is wider than high."""
        return self.width_mm > self.height_mm
