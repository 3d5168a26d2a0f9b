"""Points of the targets, against OpenCV where it has them."""

from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handeye.errors import InputError
from handeye.types import AprilGrid, ArucoGrid, ArucoMarker, Charuco, Chessboard, CircleGrid, Target
from handeye.types.target import Coded
from handeye.types.target.dictionaries import DICTIONARIES, dictionary_of_number, marker_bits
from strategies import plain_values, targets

GOOD: list[Target] = [
    Chessboard(6, 9, 0.025),
    CircleGrid(4, 11, 0.02, 0.01, marked=3, marked_diameter_m=0.012),
    Charuco(5, 7, 0.04, 0.03, "DICT_5X5_100"),
    AprilGrid(6, 6, 0.088, 0.3),
    ArucoGrid(4, 3, 0.04, 0.004, "DICT_5X5_250", ids=tuple(range(20, 8, -1))),
    ArucoMarker(0.1, "DICT_ARUCO_ORIGINAL", 582),
]


def test_chessboard_points_run_along_the_rows() -> None:
    board = Chessboard(6, 9, 0.025)
    assert board.point_count == 54
    np.testing.assert_allclose(
        board.points[[0, 1, 9, 53]], [[0, 0, 0], [0.025, 0, 0], [0, 0.025, 0], [0.2, 0.125, 0]]
    )
    assert board.radius_m == 0
    assert not board.radii_m.any()


def test_asymmetric_grid_is_that_of_opencv() -> None:
    grid = CircleGrid(11, 4, 0.02, 0.016, asymmetric=True)
    expected = [[(2 * j + i % 2) * 0.02, i * 0.02, 0] for i in range(11) for j in range(4)]
    np.testing.assert_allclose(grid.points, expected)
    assert grid.radius_m == 0.008


def test_a_marked_circle_has_its_own_radius() -> None:
    grid = CircleGrid(3, 3, 0.02, 0.01, marked=4, marked_diameter_m=0.014)
    np.testing.assert_allclose(grid.radii_m, [0.005] * 4 + [0.007] + [0.005] * 4)
    assert CircleGrid(3, 3, 0.02, 0.01, marked=4).radii_m.max() == 0.005


@pytest.mark.parametrize(
    ("rows", "columns", "legacy"), [(5, 7, False), (4, 6, False), (4, 6, True), (3, 3, False)]
)
def test_charuco_points_are_those_of_opencv_from_the_first_corner(
    rows: int, columns: int, legacy: bool
) -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    board = cv2.aruco.CharucoBoard((columns, rows), 0.04, 0.03, dictionary)
    board.setLegacyPattern(legacy)
    ours = Charuco(rows, columns, 0.04, 0.03, "DICT_5X5_100", legacy)
    np.testing.assert_allclose(
        ours.points + np.array([0.04, 0.04, 0]), board.getChessboardCorners(), atol=1e-7
    )
    assert len(board.getIds()) <= rows * columns // 2


def test_aprilgrid_points_are_those_of_kalibr() -> None:
    grid = AprilGrid(rows=2, columns=3, tag_m=0.08, spacing_ratio=0.25)
    # Kalibr's points: a lattice of 2 rows x 2 columns a tag, x right, y up, from the lower left.
    steps = np.array([0, 0.08, 0.10, 0.18, 0.20, 0.28])
    kalibr = np.array([[x, y, 0] for y in steps[:4] for x in steps])
    ids_of_tag = {0: [0, 1, 7, 6], 2: [4, 5, 11, 10], 3: [12, 13, 19, 18]}
    for tag, ids in ids_of_tag.items():
        np.testing.assert_allclose(grid.points[4 * tag : 4 * tag + 4], kalibr[ids] * [1, -1, 1], atol=1e-12)


def test_aprilgrid_tags_stand_on_their_head_for_opencv() -> None:
    # Tag 0 of 36h11 as its code says, upright; bits row by row, the highest first (AprilTag, Olson 2011).
    bits = np.array([0xD5D628584 >> (35 - i) & 1 for i in range(36)]).reshape(6, 6)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    opencv = (cv2.aruco.generateImageMarker(dictionary, 0, 8)[1:7, 1:7] > 0).astype(int)
    np.testing.assert_array_equal(np.rot90(opencv, 2), bits)
    # OpenCV lists corners clockwise from its upper left, we counter-clockwise from the lower left.
    upright_of_opencv = [(0, 1), (1, 1), (1, 0), (0, 0)]  # x, y up
    on_its_head = [(1 - x, 1 - y) for x, y in upright_of_opencv]
    assert [on_its_head[i] for i in (1, 0, 3, 2)] == [(0, 0), (1, 0), (1, 1), (0, 1)]


@pytest.mark.parametrize(("rows", "columns", "first"), [(4, 3, 0), (1, 5, 7), (3, 3, 100)])
def test_aruco_grid_is_that_of_opencv(rows: int, columns: int, first: int) -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_250)
    ids = np.arange(first, first + rows * columns)
    board = cv2.aruco.GridBoard((columns, rows), 0.04, 0.004, dictionary, ids)
    ours = ArucoGrid(rows, columns, 0.04, 0.004, "DICT_5X5_250", first_id=first)
    np.testing.assert_allclose(ours.points.reshape(-1, 4, 3), board.getObjPoints(), atol=1e-7)
    np.testing.assert_array_equal(ours.marker_ids, np.ravel(board.getIds()))
    np.testing.assert_array_equal(ours.outlines.reshape(-1, 2), ours.points[:, :2])


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("shape", [(6, 5), (5, 6), (7, 7), (4, 4)])
def test_charuco_markers_are_those_of_opencv(shape: tuple[int, int], legacy: bool) -> None:
    rows, columns = shape
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    board = cv2.aruco.CharucoBoard((columns, rows), 0.04, 0.03, dictionary)
    board.setLegacyPattern(legacy)
    ours = Charuco(rows, columns, 0.04, 0.03, "DICT_5X5_100", legacy)
    there = np.asarray(board.getObjPoints())[:, :, :2] - 0.04
    np.testing.assert_allclose(ours.outlines, there, atol=1e-7)
    np.testing.assert_array_equal(ours.marker_ids, np.ravel(board.getIds()))


def test_ids_that_follow_are_a_first_id_and_defaults_are_not_written() -> None:
    listed = ArucoGrid(2, 2, 0.04, 0.01, "DICT_4X4_50", ids=(5, 6, 7, 8))
    assert listed == ArucoGrid(2, 2, 0.04, 0.01, "DICT_4X4_50", first_id=5)
    assert listed.to_dict() == {
        "family": "aruco_grid", "rows": 2, "columns": 2, "marker_m": 0.04, "separation_m": 0.01,
        "dictionary": "DICT_4X4_50", "first_id": 5,
    }  # fmt: skip
    shuffled = Charuco(3, 3, 0.04, 0.03, "DICT_4X4_50", ids=(9, 2, 4, 30))
    assert shuffled.to_dict()["ids"] == [9, 2, 4, 30]
    assert shuffled.marker_ids.tolist() == [9, 2, 4, 30]


def test_files_of_before_are_read() -> None:
    charuco = {"family": "charuco", "rows": 5, "columns": 7, "square_m": 0.04, "marker_m": 0.03}
    assert Target.from_dict({**charuco, "dictionary": "DICT_5X5_100", "legacy_pattern": False}) == GOOD[2]
    tags = {"family": "aprilgrid", "rows": 6, "columns": 6, "tag_m": 0.088, "spacing_ratio": 0.3}
    assert Target.from_dict(tags) == GOOD[3]


@pytest.mark.parametrize("target", [target for target in GOOD if isinstance(target, Coded)], ids=str)
def test_marker_arrays_are_frozen(target: Coded) -> None:
    for array in (target.marker_ids, target.outlines):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_dictionaries_are_those_of_opencv() -> None:
    for number, (name, markers) in enumerate(DICTIONARIES.items()):
        assert getattr(cv2.aruco, name) == number
        assert cv2.aruco.getPredefinedDictionary(number).bytesList.shape[0] == markers
        assert dictionary_of_number(number, "test") == name
        assert cv2.aruco.getPredefinedDictionary(number).markerSize == marker_bits(name)
    for number in (-1, len(DICTIONARIES)):
        with pytest.raises(InputError):
            dictionary_of_number(number, "test")


@given(targets())
def test_dict_reads_back_and_arrays_are_frozen(target: Target) -> None:
    twin = Target.from_dict(target.to_dict())
    assert twin == target
    assert hash(twin) == hash(target)
    assert twin.points.shape == (target.point_count, 3)
    assert twin.radii_m.shape == (target.point_count,)
    assert not twin.points[:, 2].any()
    assert not twin.points[0].any()
    for array in (twin.points, twin.radii_m, twin.symmetries[0]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


@pytest.mark.parametrize(
    ("target", "changes"),
    [
        (GOOD[0], {"rows": 1}),
        (GOOD[0], {"rows": 6.0}),
        (GOOD[0], {"columns": 1001}),
        (GOOD[0], {"rows": 1000, "columns": 1000}),
        (GOOD[0], {"pitch_m": 0}),
        (GOOD[0], {"pitch_m": float("inf")}),
        (GOOD[0], {"pitch_m": 1e200}),
        (GOOD[0], {"pitch_mm": 25}),
        (GOOD[0], {"family": "checkers"}),
        (GOOD[0], {"family": None}),
        (GOOD[1], {"diameter_m": 0.02}),
        (GOOD[1], {"marked": 44}),
        (GOOD[1], {"marked": -1}),
        (GOOD[1], {"marked_diameter_m": 0.01}),
        (GOOD[1], {"marked_diameter_m": 0.03}),
        (GOOD[1], {"marked_diameter_m": 0.0}),
        (GOOD[2], {"marker_m": 0.04}),
        (GOOD[2], {"dictionary": "DICT_5X5"}),
        (GOOD[2], {"rows": 2}),
        (GOOD[2], {"rows": 15, "columns": 15}),
        (GOOD[3], {"spacing_ratio": 26.4}),
        (GOOD[3], {"dictionary": "DICT_5X5_1000"}),
        (GOOD[3], {"rows": 30, "columns": 30}),
        (GOOD[3], {"border_bits": 3}),
        (GOOD[3], {"first_id": 560}),
        (GOOD[3], {"first_id": -1}),
        (GOOD[2], {"ids": [1, 2, 3]}),
        (GOOD[2], {"ids": [0, *range(16)]}),
        (GOOD[2], {"ids": [*range(100, 117)]}),
        (GOOD[2], {"border_bits": 0}),
        (GOOD[4], {"first_id": 3}),
        (GOOD[4], {"separation_m": 0.0}),
        (GOOD[4], {"separation_m": 3.0}),
        (GOOD[4], {"rows": 200}),
        (GOOD[5], {"id": 1024}),
        (GOOD[5], {"marker_m": -1.0}),
        (GOOD[5], {"rows": 1}),
    ],
)
def test_what_is_no_target_is_refused(target: Target, changes: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        Target.from_dict({**target.to_dict(), **changes})


def test_a_diameter_of_the_marked_circle_needs_a_marked_circle() -> None:
    with pytest.raises(InputError):
        CircleGrid(3, 3, 0.02, 0.01, marked_diameter_m=0.012)


@given(plain_values(), st.sampled_from(GOOD), st.integers(0, 8))
def test_hostile_values_raise_only_our_error(value: object, target: Target, index: int) -> None:
    with pytest.raises(InputError):
        Target.from_dict(value)
    good = target.to_dict()
    try:
        Target.from_dict({**good, list(good)[index % len(good)]: value})
    except InputError:
        return
