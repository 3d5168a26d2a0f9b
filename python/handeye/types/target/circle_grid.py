"""The grid of circles."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, count, positive
from handeye.types.target.artwork import Artwork, Discs
from handeye.types.target.base import Target, check_point_count, grid, mm
from handeye.types.target.symmetry import Turn

# How much larger a marked circle usually is.
MARKED_RATIO = 1.4


@dataclass(frozen=True)
class CircleGrid(Target):
    """A grid of equal circles; its points are their centres, row by row.

    Parameters
    ----------
    rows, columns
        Number of circles, each 2 to 1000.
    pitch_m
        Distance in metres between neighbouring rows. In a symmetric grid also that between neighbours in a
        row; in an asymmetric grid neighbours in a row are two pitches apart and every second row is shifted
        by one, as in OpenCV: ``x = (2 column + row % 2) pitch, y = row pitch``.
    diameter_m
        Diameter of a circle in metres.
    asymmetric
        Whether every second row is shifted.
    marked
        Id of the one circle that is larger than the others, None if there is none.
    marked_diameter_m
        Diameter of that circle in metres; None if not known, then taken as `diameter_m` where a size is
        needed.

    Raises
    ------
    InputError
        A number out of its range, circles that touch, or a marked circle that is not larger.

    Examples
    --------
    >>> CircleGrid(7, 10, pitch_m=0.02, diameter_m=0.01, marked=0, marked_diameter_m=0.015).point_count
    70
    """

    family: ClassVar[str] = "circle_grid"
    scale: ClassVar[str] = "pitch_m"
    usual_measures: ClassVar[Mapping[str, Any]] = {"rows": 7, "columns": 10, "diameter_m": 0.5}

    rows: int
    columns: int
    pitch_m: float
    diameter_m: float
    asymmetric: bool = False
    marked: int | None = None
    marked_diameter_m: float | None = None

    def __post_init__(self) -> None:
        what = "circle_grid"
        object.__setattr__(self, "rows", count(self.rows, 2, 1000, f"{what}: rows"))
        object.__setattr__(self, "columns", count(self.columns, 2, 1000, f"{what}: columns"))
        object.__setattr__(self, "pitch_m", positive(self.pitch_m, f"{what}: pitch_m"))
        object.__setattr__(self, "diameter_m", positive(self.diameter_m, f"{what}: diameter_m"))
        object.__setattr__(self, "asymmetric", bool(self.asymmetric))
        points = self.rows * self.columns
        check_point_count(points, what)
        if self.marked is not None:
            object.__setattr__(self, "marked", count(self.marked, 0, points - 1, f"{what}: marked"))
        nearest = self.pitch_m * (np.sqrt(2.0) if self.asymmetric else 1.0)
        if self.diameter_m >= nearest:
            raise InputError(
                f"{what}: diameter_m {self.diameter_m:g}, expected less than {nearest:g} (or circles touch)",
                code=Code.OUT_OF_RANGE,
            )
        if self.marked_diameter_m is not None:
            self._check_marked(float(nearest))

    def _check_marked(self, nearest: float) -> None:
        marked_diameter = positive(self.marked_diameter_m or 0.0, "circle_grid: marked_diameter_m")
        object.__setattr__(self, "marked_diameter_m", marked_diameter)
        if self.marked is None:
            raise InputError("circle_grid: marked_diameter_m without marked", code=Code.INVALID_FIELD)
        if not self.diameter_m < marked_diameter < 2 * nearest - self.diameter_m:
            raise InputError(
                f"circle_grid: marked_diameter_m {marked_diameter:g}, expected more than diameter_m "
                f"{self.diameter_m:g} and not so much that circles touch",
                code=Code.OUT_OF_RANGE,
            )

    def _layout(self) -> FloatArray:
        if not self.asymmetric:
            return grid(self.rows, self.columns, self.pitch_m)
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        return np.column_stack([2 * column + row % 2, row]) * self.pitch_m

    @classmethod
    def usual(cls, scale_m: float, asked: Mapping[str, Any]) -> Self:
        """Return a grid; one of eleven shifted rows of four has no symmetry."""
        shape = {"rows": 11, "columns": 4} if asked.get("asymmetric") else {}
        grid = super().usual(scale_m, {**shape, **asked})
        if grid.marked is None or grid.marked_diameter_m is not None:
            return grid
        larger = round(MARKED_RATIO * grid.diameter_m, 9)
        return super().usual(scale_m, {**shape, **asked, "marked_diameter_m": larger})

    def artwork(self) -> Artwork:
        """Return the circles."""
        if not self.asymmetric:
            radii = self.radii_m.reshape(self.rows, self.columns)
        else:
            row, column = np.divmod(np.arange(self.point_count), self.columns)
            radii = np.zeros((self.rows, 2 * self.columns))
            radii[row, 2 * column + row % 2] = self.radii_m
        return Artwork((Discs(self.pitch_m, radii),), self.pitch_m / 4)

    @property
    def caption(self) -> str:
        """The grid in one line."""
        kind = "Asymmetric circle grid" if self.asymmetric else "Circle grid"
        text = (
            f"{kind}, {self.rows} rows x {self.columns} columns, pitch {mm(self.pitch_m)}, "
            f"diameter {mm(self.diameter_m)}"
        )
        if self.marked is None:
            return text
        size = "" if self.marked_diameter_m is None else f": {mm(self.marked_diameter_m)}"
        return f"{text}, circle {self.marked} larger{size}"

    @property
    def spacing_m(self) -> float:
        """Distance of neighbouring rows."""
        return self.pitch_m

    def _looks_the_same(self, turn: Turn) -> bool:
        """Tell whether the marked circle stays where it is; without one, points are all there is to see.

        So a symmetric grid has four symmetries if it is square and two if not. An asymmetric grid has two if
        the number of rows is even: half a turn swaps shifted and unshifted rows. With an odd number of rows
        it would have to bring unshifted rows onto themselves by one centre and shifted ones by another, so
        there is only the identity; and no quarter turn fits, as it brings the lattice points with even x + y
        onto those with odd.
        """
        return self.marked is None or int(turn.permutation[self.marked]) == self.marked

    @property
    def radius_m(self) -> float:
        """Radius of the (unmarked) circles in metres."""
        return self.diameter_m / 2

    def _radii(self) -> FloatArray:
        radii = super()._radii()
        if self.marked is not None and self.marked_diameter_m is not None:
            radii[self.marked] = self.marked_diameter_m / 2
        return radii
