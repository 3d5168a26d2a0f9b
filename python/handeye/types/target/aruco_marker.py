"""The single marker: ArUco or AprilTag."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from handeye.types.arrays import FloatArray, IndexArray, count, positive
from handeye.types.target.artwork import Artwork, Markers
from handeye.types.target.base import mm
from handeye.types.target.coded import MarkerCorners, border, on_lattice
from handeye.types.target.dictionaries import check_dictionary, marker_bits, marker_count


@dataclass(frozen=True)
class ArucoMarker(MarkerCorners):
    """One marker, as easy_handeye users print it; its points are its four corners.

    Seen with the marker upright as OpenCV draws it, the points run clockwise from the upper left, and the
    origin is the upper left corner. OpenCV draws AprilTags on their head, which changes the names of the
    corners and nothing else. It has no symmetry but the identity.

    Parameters
    ----------
    marker_m
        Side of the marker in metres, over its black border.
    dictionary
        Name of one of OpenCV's predefined dictionaries.
    id
        Number of the marker in the dictionary.
    border_bits
        Width of the black border in bits, 1 or 2.
    inverted
        Whether it is printed light on dark.

    Raises
    ------
    InputError
        A number out of its range, or an unknown dictionary.

    Examples
    --------
    >>> ArucoMarker(marker_m=0.1, dictionary="DICT_ARUCO_ORIGINAL", id=582).points[2].tolist()
    [0.1, 0.1, 0.0]
    """

    family: ClassVar[str] = "aruco_marker"
    scale: ClassVar[str] = "marker_m"
    usual_measures: ClassVar[Mapping[str, Any]] = {"dictionary": "DICT_ARUCO_ORIGINAL", "id": 0}

    marker_m: float
    dictionary: str
    id: int
    border_bits: int = field(default=1, kw_only=True)
    inverted: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        what = self.family
        check_dictionary(self.dictionary, 1, what)
        object.__setattr__(self, "marker_m", positive(self.marker_m, f"{what}: marker_m"))
        object.__setattr__(self, "id", count(self.id, 0, marker_count(self.dictionary) - 1, f"{what}: id"))
        object.__setattr__(self, "border_bits", border(self.border_bits, what))

    def _marker_ids(self) -> IndexArray:
        return np.array([self.id])

    def _layout(self) -> FloatArray:
        return on_lattice(np.zeros(2), self.marker_m, self.marker_m, np.zeros((1, 2), dtype=np.int64))[0]

    def artwork(self) -> Artwork:
        """Return the marker."""
        ids = np.array([[self.id]])
        marker = Markers(np.zeros(2), self.marker_m, self.marker_m, ids, self.dictionary, self.border_bits)
        return Artwork((marker,), self._bit_m, self.inverted)

    @property
    def caption(self) -> str:
        """The marker in one line."""
        bits = ", border of two bits" if self.border_bits == 2 else ""
        inverted = ", light on dark" if self.inverted else ""
        return f"Marker {self.id} of {self.dictionary}, side {mm(self.marker_m)}{bits}{inverted}"

    @property
    def spacing_m(self) -> float:
        """Two bits: what is repeated on a single marker."""
        return 2 * self._bit_m

    @property
    def gap_m(self) -> float:
        """Half a bit: papers that are cut closer are rare."""
        return self._bit_m / 2

    @property
    def _bit_m(self) -> float:
        return self.marker_m / (marker_bits(self.dictionary) + 2 * self.border_bits)
