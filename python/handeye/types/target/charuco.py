"""The ChArUco board."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, count, positive
from handeye.types.target.artwork import Artwork, Markers, Squares, chequered
from handeye.types.target.base import check_point_count, grid, mm
from handeye.types.target.coded import Numbered, border, on_lattice


@dataclass(frozen=True)
class Charuco(Numbered):
    """A chessboard with markers in its white squares; its points are the inner corners, row by row.

    The ids are those of OpenCV's `CharucoBoard`. The origin is the first inner corner, as for every target
    here; that of OpenCV is the outer corner of the board, one square further left and up.
    The markers tell the corners apart, so the board has no symmetry but the identity.

    Parameters
    ----------
    rows, columns
        Number of squares (not of corners), each 3 to 1000; there are (rows - 1) x (columns - 1) points.
    square_m
        Side of a square in metres.
    marker_m
        Side of a marker in metres, less than that of a square.
    dictionary
        Name of one of OpenCV's predefined dictionaries, such as ``DICT_5X5_100``.
    legacy_pattern
        Whether the board has the layout of OpenCV before 4.6, which differs if `rows` is even.
    border_bits
        Width of the markers' black border in bits, 1 or 2.
    first_id, ids, inverted
        As of every board with markers; markers are numbered row by row.

    Raises
    ------
    InputError
        A number out of its range, an unknown dictionary or one with too few markers.

    Examples
    --------
    >>> Charuco(5, 7, square_m=0.03, marker_m=0.022, dictionary="DICT_5X5_100").point_count
    24
    """

    family: ClassVar[str] = "charuco"
    scale: ClassVar[str] = "square_m"
    usual_measures: ClassVar[Mapping[str, Any]] = {
        "rows": 7,
        "columns": 10,
        "marker_m": 0.75,
        "dictionary": "DICT_5X5_100",
    }

    rows: int
    columns: int
    square_m: float
    marker_m: float
    dictionary: str
    legacy_pattern: bool = False
    border_bits: int = field(default=1, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", count(self.rows, 3, 1000, "charuco: rows"))
        object.__setattr__(self, "columns", count(self.columns, 3, 1000, "charuco: columns"))
        object.__setattr__(self, "square_m", positive(self.square_m, "charuco: square_m"))
        object.__setattr__(self, "marker_m", positive(self.marker_m, "charuco: marker_m"))
        object.__setattr__(self, "legacy_pattern", bool(self.legacy_pattern))
        object.__setattr__(self, "border_bits", border(self.border_bits, "charuco"))
        if self.marker_m >= self.square_m:
            raise InputError(
                f"charuco: marker_m {self.marker_m:g}, expected less than square_m {self.square_m:g}",
                code=Code.OUT_OF_RANGE,
            )
        check_point_count((self.rows - 1) * (self.columns - 1), "charuco")
        self._check_numbers()

    def _layout(self) -> FloatArray:
        return grid(self.rows - 1, self.columns - 1, self.square_m)

    @property
    def _dark(self) -> NDArray[np.bool_]:
        """(R, C) which squares are dark; the markers are in the others."""
        return chequered(self.rows, self.columns, int(self.legacy_pattern and self.rows % 2 == 0))

    def _marker_count(self) -> int:
        return self.rows * self.columns // 2

    @property
    def _inset_m(self) -> float:
        return (self.square_m - self.marker_m) / 2

    def _outlines(self) -> FloatArray:
        row, column = np.nonzero(~self._dark)
        first = np.full(2, self._inset_m - self.square_m)
        return on_lattice(first, self.square_m, self.marker_m, np.column_stack([column, row]))

    def artwork(self) -> Artwork:
        """Return squares and markers; the origin is one square in from the upper left corner."""
        dark = self._dark
        ids = np.full(dark.shape, -1, dtype=np.int64)
        ids[~dark] = self.marker_ids
        corner = np.full(2, -self.square_m)
        layers = (
            Squares(corner, self.square_m, self.square_m, dark),
            Markers(
                corner + self._inset_m, self.square_m, self.marker_m, ids, self.dictionary, self.border_bits
            ),
        )
        return Artwork(layers, self.square_m / 4, self.inverted)

    @property
    def caption(self) -> str:
        """The board in one line."""
        legacy = ", layout of OpenCV before 4.6" if self.legacy_pattern else ""
        bits = ", border of two bits" if self.border_bits == 2 else ""
        return (
            f"ChArUco board, {self.rows} rows x {self.columns} columns of squares, side "
            f"{mm(self.square_m)}, markers {mm(self.marker_m)} of {self.dictionary}"
            f"{legacy}{bits}{self._numbers}"
        )

    @property
    def spacing_m(self) -> float:
        """Side of a square."""
        return self.square_m
