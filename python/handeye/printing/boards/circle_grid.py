"""The grid of circles."""

from handeye.errors import InputError
from handeye.printing.boards.base import Board, Ink, Measures, default, mm
from handeye.printing.shapes import Disc
from handeye.types import CircleGrid

# Diameter of a circle over the pitch, and of the marked one over that of the others.
DIAMETER_SHARE = 0.5
MARKED_RATIO = 1.4


def ink(target: CircleGrid) -> Ink:
    """Draw the circles.

    Raises
    ------
    InputError
        One circle is larger, but not known how much.
    """
    if target.marked is not None and target.marked_diameter_m is None:
        raise InputError(
            "circle_grid: a marked circle without marked_diameter_m cannot be drawn",
            code="invalid_field",
            hint="say how large it is to be",
        )
    points, radii = target.points[:, :2] * 1000, target.radii_m * 1000
    discs = tuple(Disc(float(x), float(y), float(r)) for (x, y), r in zip(points, radii, strict=True))
    reach = float(radii.max())
    return Ink(discs, points.min(axis=0) - reach, points.max(axis=0) + reach, target.pitch_m * 250)


def caption(target: CircleGrid) -> str:
    """Describe the grid."""
    kind = "Asymmetric circle grid" if target.asymmetric else "Circle grid"
    text = (
        f"{kind}, {target.rows} rows x {target.columns} columns, pitch {mm(target.pitch_m)}, "
        f"diameter {mm(target.diameter_m)}"
    )
    if target.marked is None or target.marked_diameter_m is None:
        return text
    return f"{text}, circle {target.marked} larger: {mm(target.marked_diameter_m)}"


def usual(scale_m: float, asked: Measures) -> CircleGrid:
    """Make a grid; a grid of eleven rows of four has no symmetry if every second row is shifted."""
    rows, columns = (11, 4) if asked.asymmetric else (7, 10)
    diameter = default(asked.diameter_m, round(DIAMETER_SHARE * scale_m, 9))
    marked_diameter = asked.marked_diameter_m
    if asked.marked is not None and marked_diameter is None:
        marked_diameter = round(MARKED_RATIO * diameter, 9)
    return CircleGrid(
        default(asked.rows, rows),
        default(asked.columns, columns),
        scale_m,
        diameter,
        asked.asymmetric,
        asked.marked,
        marked_diameter,
    )


BOARD = Board(CircleGrid.family, ink, caption, usual)
