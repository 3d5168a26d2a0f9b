"""What targets with coded markers share: numbers, and where each marker is."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, IndexArray, count
from handeye.types.target.base import Target
from handeye.types.target.dictionaries import check_dictionary, marker_count


class Coded(Target):
    """A board with markers of one dictionary, by which its points are known.

    Attributes
    ----------
    dictionary
        OpenCV's name.
    border_bits
        Width of the markers' black border in bits.
    inverted
        Whether all is printed light on dark.
    """

    dictionary: str
    border_bits: int
    inverted: bool

    @cached_property
    def marker_ids(self) -> IndexArray:
        """(M,) number of each marker in the dictionary, read-only."""
        numbers = self._marker_ids()
        numbers.flags.writeable = False
        return numbers

    @cached_property
    def outlines(self) -> FloatArray:
        """(M, 4, 2) corners of each marker in the plane of the board, metres, read-only.

        In the order of OpenCV: from the corner at the upper left of the marker as OpenCV draws it, clockwise.
        """
        outlines = self._outlines()
        outlines.flags.writeable = False
        return outlines

    @abstractmethod
    def _marker_ids(self) -> IndexArray:
        """Return the number (M,) of each marker."""

    @abstractmethod
    def _outlines(self) -> FloatArray:
        """Return the corners (M, 4, 2) of each marker."""


class MarkerCorners(Coded):
    """A board whose points are the corners of its markers, point ``4 m + k`` being a corner of marker m."""

    corner_order: ClassVar[tuple[int, int, int, int]] = (0, 1, 2, 3)
    """Our corners of a marker among those that OpenCV lists."""

    def _outlines(self) -> FloatArray:
        return self.points[:, :2].reshape(-1, 4, 2)[:, np.argsort(self.corner_order)]

    @property
    @abstractmethod
    def gap_m(self) -> float:
        """Width of the white around a marker in which there is nothing else."""


@dataclass(frozen=True, kw_only=True)
class Numbered(Coded):
    """A coded board of several markers.

    Parameters
    ----------
    first_id
        Number of the first marker; the others follow.
    ids
        Numbers of all markers in their order on the board, where they do not follow each other.
    inverted
        Whether it is printed light on dark.
    """

    inverted: bool = False
    first_id: int = 0
    ids: tuple[int, ...] | None = None

    def _marker_ids(self) -> IndexArray:
        if self.ids is not None:
            return np.array(self.ids, dtype=np.int64)
        return self.first_id + np.arange(self._marker_count())

    @abstractmethod
    def _marker_count(self) -> int:
        """Return the number of markers M."""

    def _check_numbers(self) -> None:
        """Check dictionary and numbers.

        Raises
        ------
        InputError
            An unknown dictionary, a number that it does not have or that is twice, too few or too many.
        """
        what, number = self.family, self._marker_count()
        check_dictionary(self.dictionary, number, what)
        highest = marker_count(self.dictionary) - 1
        object.__setattr__(self, "first_id", count(self.first_id, 0, highest, f"{what}: first_id"))
        if self.ids is None:
            if self.first_id + number - 1 > highest:
                raise InputError(
                    f"{what}: markers {self.first_id} to {self.first_id + number - 1}, but {self.dictionary} "
                    f"ends at {highest}",
                    code=Code.OUT_OF_RANGE,
                )
            return
        ids = tuple(count(value, 0, highest, f"{what}: ids") for value in self.ids)
        if len(ids) != number or len(set(ids)) != number:
            raise InputError(
                f"{what}: {len(set(ids))} different numbers in ids, expected {number}, one for each marker",
                code=Code.INVALID_FIELD,
            )
        if self.first_id not in {0, ids[0]}:
            raise InputError(
                f"{what}: first_id {self.first_id}, but ids begins with {ids[0]}", code=Code.INVALID_FIELD
            )
        follows = ids == tuple(range(ids[0], ids[0] + number))
        object.__setattr__(self, "first_id", ids[0] if follows else 0)
        object.__setattr__(self, "ids", None if follows else ids)

    @property
    def _numbers(self) -> str:
        """How the numbers differ from the usual, for the caption."""
        text = ", light on dark" if self.inverted else ""
        if self.ids is not None:
            return f", ids {_listed(self.ids)}{text}"
        return f", ids from {self.first_id}{text}" if self.first_id else text


def _listed(numbers: Sequence[int]) -> str:
    shown = ", ".join(map(str, numbers[:6]))
    return shown if len(numbers) <= 6 else f"{shown}, ..."


def on_lattice(origin: FloatArray, pitch_m: float, side_m: float, places: IndexArray) -> FloatArray:
    """Return the corners (M, 4, 2) of upright squares at places (M, 2), column and row, of a lattice."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * side_m
    return (origin + places * pitch_m)[:, np.newaxis] + square


def border(bits: int, what: str) -> int:
    """Return a width of a border in bits.

    Raises
    ------
    InputError
        Not 1 or 2.
    """
    return count(bits, 1, 2, f"{what}: border_bits")
