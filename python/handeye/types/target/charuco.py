"""The ChArUco board."""

from dataclasses import dataclass
from typing import ClassVar

from handeye.errors import InputError
from handeye.types.arrays import FloatArray, count, positive
from handeye.types.target.base import Target, check_point_count, grid
from handeye.types.target.dictionaries import check_dictionary


@dataclass(frozen=True)
class Charuco(Target):
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

    Raises
    ------
    InputError
        A number out of its range, an unknown dictionary or one with too few markers.
    """

    family: ClassVar[str] = "charuco"

    rows: int
    columns: int
    square_m: float
    marker_m: float
    dictionary: str
    legacy_pattern: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", count(self.rows, 3, 1000, "charuco: rows"))
        object.__setattr__(self, "columns", count(self.columns, 3, 1000, "charuco: columns"))
        object.__setattr__(self, "square_m", positive(self.square_m, "charuco: square_m"))
        object.__setattr__(self, "marker_m", positive(self.marker_m, "charuco: marker_m"))
        object.__setattr__(self, "legacy_pattern", bool(self.legacy_pattern))
        if self.marker_m >= self.square_m:
            raise InputError(
                f"charuco: marker_m {self.marker_m:g}, expected less than square_m {self.square_m:g}",
                code="out_of_range",
            )
        check_point_count((self.rows - 1) * (self.columns - 1), "charuco")
        check_dictionary(self.dictionary, self.rows * self.columns // 2, "charuco")

    def _layout(self) -> FloatArray:
        return grid(self.rows - 1, self.columns - 1, self.square_m)
