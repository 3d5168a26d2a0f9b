"""The grid of ArUco markers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, count, positive
from handeye.types.target.artwork import Artwork, Markers
from handeye.types.target.base import check_point_count, mm
from handeye.types.target.coded import MarkerCorners, Numbered, border, on_lattice

LARGEST_RATIO = 10


@dataclass(frozen=True)
class ArucoGrid(Numbered, MarkerCorners):
    """A grid of markers as OpenCV's `GridBoard` and MoveIt Calibration have it; its points are their corners.

    Seen from the front with the markers upright as OpenCV draws them, the first marker is at the upper left,
    numbers grow to the right and then downwards. Point ``4 m + k`` is corner k of the marker in place m,
    clockwise from the upper left: 0 upper left, 1 upper right, 2 lower right, 3 lower left. The origin is
    point 0. The markers tell the corners apart, so the board has no symmetry but the identity.

    Parameters
    ----------
    rows, columns
        Number of markers (OpenCV: `size` is columns, rows; MoveIt: `markers Y`, `markers X`), each 1 to 100.
    marker_m
        Side of a marker in metres, over its black border.
    separation_m
        Space between two markers in metres, up to ten sides of a marker.
    dictionary
        Name of one of OpenCV's predefined dictionaries.
    border_bits
        Width of the black border in bits, 1 or 2.
    first_id, ids, inverted
        As of every board with markers.

    Raises
    ------
    InputError
        A number out of its range, an unknown dictionary or one with too few markers.

    Examples
    --------
    >>> ArucoGrid(4, 3, marker_m=0.04, separation_m=0.004, dictionary="DICT_5X5_250").point_count
    48
    """

    family: ClassVar[str] = "aruco_grid"
    scale: ClassVar[str] = "marker_m"
    usual_measures: ClassVar[Mapping[str, Any]] = {
        "rows": 4,
        "columns": 5,
        "separation_m": 0.25,
        "dictionary": "DICT_5X5_250",
    }

    rows: int
    columns: int
    marker_m: float
    separation_m: float
    dictionary: str
    border_bits: int = field(default=1, kw_only=True)

    def __post_init__(self) -> None:
        what = self.family
        object.__setattr__(self, "rows", count(self.rows, 1, 100, f"{what}: rows"))
        object.__setattr__(self, "columns", count(self.columns, 1, 100, f"{what}: columns"))
        object.__setattr__(self, "marker_m", positive(self.marker_m, f"{what}: marker_m"))
        object.__setattr__(self, "separation_m", positive(self.separation_m, f"{what}: separation_m"))
        object.__setattr__(self, "border_bits", border(self.border_bits, what))
        if self.separation_m > LARGEST_RATIO * self.marker_m:
            raise InputError(
                f"{what}: separation_m {self.separation_m:g}, expected at most {LARGEST_RATIO} marker_m",
                code=Code.OUT_OF_RANGE,
                hint="both are lengths in metres",
            )
        check_point_count(4 * self.rows * self.columns, what)
        self._check_numbers()

    def _marker_count(self) -> int:
        return self.rows * self.columns

    def _layout(self) -> FloatArray:
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        places = np.column_stack([column, row])
        return on_lattice(np.zeros(2), self.spacing_m, self.marker_m, places).reshape(-1, 2)

    def artwork(self) -> Artwork:
        """Return the markers."""
        ids = self.marker_ids.reshape(self.rows, self.columns)
        markers = Markers(np.zeros(2), self.spacing_m, self.marker_m, ids, self.dictionary, self.border_bits)
        return Artwork((markers,), self.marker_m / 4, self.inverted)

    @property
    def caption(self) -> str:
        """The grid in one line."""
        bits = ", border of two bits" if self.border_bits == 2 else ""
        return (
            f"ArUco grid, {self.rows} rows x {self.columns} columns of markers, side {mm(self.marker_m)}, "
            f"separation {mm(self.separation_m)}, {self.dictionary}{bits}{self._numbers}"
        )

    @property
    def spacing_m(self) -> float:
        """Distance of neighbouring markers."""
        return self.marker_m + self.separation_m

    @property
    def gap_m(self) -> float:
        """Space between two markers."""
        return self.separation_m
