"""The grid of AprilTags."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, count, positive
from handeye.types.target.artwork import Artwork, Markers, Squares
from handeye.types.target.base import check_point_count, mm
from handeye.types.target.coded import MarkerCorners, Numbered, border
from handeye.types.target.dictionaries import marker_bits


@dataclass(frozen=True)
class AprilGrid(Numbered, MarkerCorners):
    """A grid of AprilTags laid out as in Kalibr; its points are the four corners of each tag.

    Seen from the front with the tags upright as Kalibr prints them, tag 0 is at the lower left, ids grow to
    the right and then upwards. Point ``4 tag + k`` is corner k of a tag, counter-clockwise from the lower
    left: 0 lower left, 1 lower right, 2 upper right, 3 upper left. ::

        11---10  15---14
        |tag 2|  |tag 3|
        8-----9  12---13
        3-----2  7-----6
        |tag 0|  |tag 1|
        0-----1  4-----5

    OpenCV's ArUco module takes these tags for upright when they stand on their head: of the four corners
    that it lists, ours are those with the indices 1, 0, 3, 2.

    The origin is point 0, x to the right, y down (so the other points have y <= 0) and z into the board.
    Kalibr's frame has the same origin and x, but y up and z out of the board: half a turn about x leads from
    one to the other. The tags tell the corners apart, so the board has no symmetry but the identity.

    Parameters
    ----------
    rows, columns
        Number of tags (Kalibr: `tagRows`, `tagCols`), each 1 to 100.
    tag_m
        Side of a tag in metres, over its black border (Kalibr: `tagSize`).
    spacing_ratio
        Space between two tags divided by the side of a tag (Kalibr: `tagSpacing`), above 0 to 10.
    dictionary
        OpenCV's name of the family of tags.
    border_bits
        Width of the black border in bits: 2 as Kalibr prints, 1 elsewhere.
    first_id, ids, inverted
        As of every board with markers; tags are numbered as drawn above.

    Raises
    ------
    InputError
        A number out of its range, a dictionary that is no AprilTag family, or more tags than it has.

    Examples
    --------
    >>> AprilGrid(6, 6, tag_m=0.03, spacing_ratio=0.3, dictionary="DICT_APRILTAG_36h11").point_count
    144
    """

    family: ClassVar[str] = "aprilgrid"
    scale: ClassVar[str] = "tag_m"
    usual_measures: ClassVar[Mapping[str, Any]] = {"rows": 6, "columns": 6, "spacing_ratio": 0.3}
    corner_order: ClassVar[tuple[int, int, int, int]] = (1, 0, 3, 2)

    rows: int
    columns: int
    tag_m: float
    spacing_ratio: float
    dictionary: str = "DICT_APRILTAG_36h11"
    border_bits: int = 2

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", count(self.rows, 1, 100, "aprilgrid: rows"))
        object.__setattr__(self, "columns", count(self.columns, 1, 100, "aprilgrid: columns"))
        object.__setattr__(self, "tag_m", positive(self.tag_m, "aprilgrid: tag_m"))
        object.__setattr__(self, "spacing_ratio", positive(self.spacing_ratio, "aprilgrid: spacing_ratio"))
        object.__setattr__(self, "border_bits", border(self.border_bits, "aprilgrid"))
        if self.spacing_ratio > 10:
            raise InputError(
                f"aprilgrid: spacing_ratio {self.spacing_ratio:g}, expected at most 10",
                code=Code.OUT_OF_RANGE,
                hint="it is a ratio to the side of a tag, not a length",
            )
        check_point_count(4 * self.rows * self.columns, "aprilgrid")
        self._check_numbers()
        if not self.dictionary.startswith("DICT_APRILTAG_"):
            raise InputError(
                f"aprilgrid: dictionary {self.dictionary}, expected a family such as DICT_APRILTAG_36h11",
                code=Code.UNKNOWN_DICTIONARY,
            )

    def _marker_count(self) -> int:
        return self.rows * self.columns

    def _layout(self) -> FloatArray:
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        lower_left = np.column_stack([column, -row]) * self.spacing_m
        corners = np.array([[0, 0], [1, 0], [1, -1], [0, -1]]) * self.tag_m
        return (lower_left[:, np.newaxis] + corners).reshape(-1, 2)

    def artwork(self) -> Artwork:
        """Return the tags, with a border of two bits also the squares that Kalibr prints between them."""
        # Of the lattice the upper left tag is the first; the origin is at the lower left one.
        top = np.array([0.0, -(self.rows - 1) * self.spacing_m - self.tag_m])
        ids = self.marker_ids.reshape(self.rows, self.columns)[::-1]
        tags = Markers(top, self.spacing_m, self.tag_m, ids, self.dictionary, self.border_bits, on_head=True)
        cells = marker_bits(self.dictionary) + 2 * self.border_bits
        quiet = max(self.gap_m, self.tag_m / cells) / 2
        if self.border_bits == 1 or self.spacing_ratio >= 1:
            return Artwork((tags,), quiet, self.inverted)
        dark = np.ones((self.rows + 1, self.columns + 1), dtype=bool)
        squares = Squares(top - self.gap_m, self.spacing_m, self.gap_m, dark)
        return Artwork((tags, squares), quiet, self.inverted)

    @property
    def caption(self) -> str:
        """The grid in one line."""
        bits = "one bit" if self.border_bits == 1 else "two bits"
        return (
            f"AprilGrid, {self.rows} rows x {self.columns} columns of tags, side {mm(self.tag_m)}, spacing "
            f"{self.spacing_ratio:g} of it, {self.dictionary}, border of {bits}{self._numbers}"
        )

    @property
    def spacing_m(self) -> float:
        """Distance of neighbouring tags."""
        return self.tag_m * (1 + self.spacing_ratio)

    @property
    def gap_m(self) -> float:
        """Space between two tags."""
        return self.tag_m * self.spacing_ratio
