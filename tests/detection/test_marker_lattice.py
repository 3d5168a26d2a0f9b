"""A lattice of markers that says nothing of what lies beside it."""

from types import SimpleNamespace
from typing import Any, cast

import cv2
import numpy as np
import pytest

from handeye.detection import marker_lattice
from handeye.detection.marker_reading import Reading


def test_places_beside_markers_that_give_no_map_are_in_no_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenCV returns no homography where the markers lie on one line; a rendered board far away had that."""
    corners = np.zeros((4, 4, 2)) + np.arange(4)[:, None, None]
    lattice = SimpleNamespace(
        reading=SimpleNamespace(corners=corners),
        places=np.array([[0, 0], [1, 0], [0, 1], [1, 1]]),
        shape=(2, 2),
    )
    monkeypatch.setattr(cv2, "findHomography", lambda *_: (None, None))
    beside = np.array([[2, 0], [2, 1]])
    found = marker_lattice._in_picture(beside, cast("Any", lattice), (640, 480))
    np.testing.assert_array_equal(found, [False, False])


def test_three_markers_give_no_map() -> None:
    """OpenCV ends with an error for fewer than four; a drawn board of which three were seen had that."""
    corners = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]]) + 15.0 * np.array(
        [[[0, 0]], [[1, 0]], [[0, 1]]]
    )
    lattice = SimpleNamespace(
        reading=SimpleNamespace(corners=corners), places=np.array([[0, 0], [1, 0], [0, 1]]), shape=(2, 2)
    )
    found = marker_lattice._in_picture(np.array([[1, 1]]), cast("Any", lattice), (640, 480))
    np.testing.assert_array_equal(found, [False])


def test_a_marker_turned_half_around_is_not_beside_another() -> None:
    """The mean of their axes is nothing; that ended the search with a singular matrix."""
    square = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]])
    right = np.array([15.0, 0])
    corners = np.stack([square, square + right, np.roll(square, 2, axis=0) + 2 * right])
    nothing = np.zeros(0, dtype=np.int64)
    reading = Reading("DICT_4X4_1000", 1, False, np.array([4, 5, 6]), corners, nothing)
    lattices = marker_lattice.lattices_of(reading)
    assert [lattice.ids.tolist() for lattice in lattices] == [[4, 5], [6]]
