"""Symmetries of the targets, by geometry: pictures are painted and turned, nothing is taken from the code."""

import numpy as np
import pytest
from hypothesis import given

from handeye.types import AprilGrid, Charuco, Chessboard, CircleGrid, Target
from strategies import targets


def turned(points: np.ndarray, quarters: int) -> np.ndarray:
    """Points (P, 3) turned about their centre by quarter turns from x to y."""
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    centre = points.mean(axis=0)
    return (points - centre) @ np.linalg.matrix_power(quarter, quarters).T + centre


@given(targets())
def test_symmetries_are_turns_about_the_centre_and_a_group(target: Target) -> None:
    symmetries = [tuple(s.tolist()) for s in target.symmetries]
    assert symmetries[0] == tuple(range(target.point_count))
    assert len(set(symmetries)) == len(symmetries)
    for s in symmetries:
        matches = [np.allclose(target.points[list(s)], turned(target.points, q), atol=1e-9) for q in range(4)]
        assert sum(matches) == 1
    for a in symmetries:
        for b in symmetries:
            assert tuple(np.array(a)[list(b)]) in symmetries


@given(targets())
def test_turns_are_all_turns_of_the_points(target: Target) -> None:
    points = target.points
    found = {turn.quarters: turn.permutation for turn in target.turns}
    for q in range(4):
        image = turned(points, q)
        distances = np.linalg.norm(image[:, None] - points[None], axis=2)
        if (distances.min(axis=1) < 1e-9).all():
            np.testing.assert_array_equal(found[q], distances.argmin(axis=1))
        else:
            assert q not in found


@pytest.mark.parametrize("rows", range(2, 8))
@pytest.mark.parametrize("columns", range(2, 8))
def test_chessboard_colours_fall_on_colours(rows: int, columns: int) -> None:
    squares = np.add.outer(np.arange(rows + 1), np.arange(columns + 1)) % 2
    expected = sum(np.array_equal(np.rot90(squares, quarters), squares) for quarters in range(4))
    board = Chessboard(rows, columns, 0.02)
    assert len(board.symmetries) == expected
    for turn in board.turns:
        is_symmetry = any(np.array_equal(turn.permutation, s) for s in board.symmetries)
        assert is_symmetry == np.array_equal(np.rot90(squares, turn.quarters), squares)


@pytest.mark.parametrize(
    ("rows", "columns", "asymmetric", "expected"),
    [
        (4, 4, False, 4),
        (5, 5, False, 4),
        (4, 5, False, 2),
        (11, 4, True, 1),  # OpenCV's sample board
        (10, 4, True, 2),
        (4, 2, True, 2),  # as wide as high, but the corners of the lattice differ
        (2, 2, True, 2),
        (3, 2, True, 1),
    ],
)
def test_circle_grids(rows: int, columns: int, asymmetric: bool, expected: int) -> None:
    assert len(CircleGrid(rows, columns, 0.02, 0.01, asymmetric).symmetries) == expected


def test_a_marked_circle_stays_where_it_is() -> None:
    for marked in range(9):
        symmetries = CircleGrid(3, 3, 0.02, 0.01, marked=marked).symmetries
        assert len(symmetries) == (4 if marked == 4 else 1)
    assert len(CircleGrid(3, 5, 0.02, 0.01, marked=7).symmetries) == 2
    assert len(CircleGrid(10, 10, 0.0254, 0.0127, marked=90).symmetries) == 1


@pytest.mark.parametrize("target", [Charuco(4, 4, 0.04, 0.03, "DICT_4X4_50"), AprilGrid(3, 3, 0.05, 0.3)])
def test_coded_targets_have_none(target: Target) -> None:
    assert len(target.symmetries) == 1
    assert len(target.turns) == 4
