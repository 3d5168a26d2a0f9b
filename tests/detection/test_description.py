"""A wrong description is answered with the board that is shown, or with corners under their right names."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from handeye.datasets.images import read_image
from handeye.detection import Detection, NotFound, Reason, detect, shown_board, without_lengths
from handeye.types import AprilGrid, ArucoGrid, ArucoMarker, Charuco, Chessboard, CircleGrid, Target
from scenes import scene

CHARUCO = Charuco(6, 8, 0.03, 0.0225, "DICT_4X4_50")
TAGS = AprilGrid(3, 4, 0.04, 0.3)
GRID = ArucoGrid(4, 3, 0.04, 0.01, "DICT_5X5_250")
MARKER = ArucoMarker(0.1, "DICT_ARUCO_ORIGINAL", 582)
CHESSBOARD = Chessboard(6, 9, 0.03)
CIRCLES = CircleGrid(6, 8, 0.03, 0.016)
SHIFTED = CircleGrid(7, 4, 0.02, 0.018, asymmetric=True)
BOARDS: dict[str, Any] = {
    "charuco": CHARUCO, "tags": TAGS, "grid": GRID, "marker": MARKER, "chessboard": CHESSBOARD,
    "circles": CIRCLES, "shifted": SHIFTED,
}  # fmt: skip
TURN = (0.1, 0.2, 0.1)


@pytest.mark.parametrize(
    ("name", "described", "words"),
    [
        ("charuco", {"rows": 8, "columns": 6}, "rows = 6, columns = 8"),
        ("charuco", {"rows": 5, "columns": 7}, "rows = 6, columns = 8"),
        ("charuco", {"columns": 9}, "columns = 8"),
        ("charuco", {"dictionary": "DICT_5X5_100"}, 'dictionary = "DICT_4X4_50"'),
        ("charuco", {"first_id": 3}, "first_id = 0"),
        ("charuco", {"inverted": True}, "inverted = false"),
        ("charuco", {"border_bits": 2}, "border_bits = 1"),
        ("tags", {"rows": 4, "columns": 3}, "rows = 3, columns = 4"),
        ("tags", {"columns": 5}, "columns = 4"),
        ("tags", {"border_bits": 1}, "border_bits = 2"),
        ("tags", {"dictionary": "DICT_APRILTAG_25h9"}, 'dictionary = "DICT_APRILTAG_36h11"'),
        ("tags", {"first_id": 5}, "first_id = 0"),
        ("tags", {"first_id": 4}, "first_id = 0"),
        ("grid", {"rows": 3, "columns": 4}, "rows = 4, columns = 3"),
        ("grid", {"columns": 4}, "columns = 3"),
        ("grid", {"dictionary": "DICT_4X4_50"}, 'dictionary = "DICT_5X5_50"'),
        ("grid", {"ids": (5, 9, 1, 22, 7, 8, 30, 2, 4, 11, 12, 13)}, "first_id = 0"),
        ("marker", {"id": 5}, "id = 582"),
        ("marker", {"dictionary": "DICT_4X4_50", "id": 3}, 'dictionary = "DICT_ARUCO_ORIGINAL", id = 582'),
        ("chessboard", {"rows": 7, "columns": 10}, "--rows 6 --columns 9"),
        ("chessboard", {"rows": 5}, "--rows 6 --columns 9"),
        ("circles", {"rows": 7}, "rows = 6"),
        ("shifted", {"rows": 4, "columns": 7}, "rows = 7, columns = 4"),
        ("shifted", {"asymmetric": False, "diameter_m": 0.01}, "asymmetric = true"),
    ],
)
def test_the_board_shown_is_named(name: str, described: dict[str, Any], words: str) -> None:
    board: Target = BOARDS[name]
    found = detect(scene(board, turn=TURN).picture(), board.changed(**described))
    assert isinstance(found, NotFound), found
    assert found.shown is not None
    assert (
        without_lengths(found.shown).split("dictionary")[0] == without_lengths(board).split("dictionary")[0]
    )
    assert found.reason is (
        Reason.WRONG_SIZE if set(described) <= {"rows", "columns"} else Reason.OTHER_BOARD
    )
    assert words in found.hint
    assert found.shown.caption in found.evidence


@pytest.mark.parametrize(
    "shown",
    [
        CHARUCO.changed(first_id=17),
        CHARUCO.changed(inverted=True),
        TAGS.changed(inverted=True),
        TAGS.changed(first_id=30),
        GRID.changed(first_id=33),
        GRID.changed(inverted=True),
        GRID.changed(ids=(5, 9, 1, 22, 7, 8, 30, 2, 4, 11, 12, 13)),
        GRID.changed(border_bits=2),
        MARKER.changed(inverted=True),
    ],
    ids=lambda board: board.caption,
)
def test_what_few_boards_have_is_found_and_named(shown: Target) -> None:
    board = scene(shown, turn=TURN)
    image = board.picture()
    found = detect(image, shown)
    assert isinstance(found, Detection), found
    assert len(found) >= 0.9 * shown.point_count
    assert board.errors_px(found).max() < 0.3
    usual = {"first_id": 0, "ids": None, "inverted": False, "border_bits": 1}
    plain = shown.changed(**{name: value for name, value in usual.items() if name in shown.fields()})
    missing = detect(image, plain)
    assert isinstance(missing, NotFound), missing
    assert missing.shown == shown


@pytest.mark.parametrize("described", [CHARUCO, TAGS, GRID, MARKER, CHESSBOARD, CIRCLES])
@pytest.mark.parametrize("name", BOARDS)
def test_a_board_of_another_family_is_named(name: str, described: Target) -> None:
    board: Target = BOARDS[name]
    if type(board) is type(described):
        return
    found = detect(scene(board, turn=TURN).picture(), described)
    if name == "marker" and not isinstance(described, AprilGrid | ArucoGrid | Charuco):
        return  # one marker may lie beside any board that has none
    assert isinstance(found, NotFound), found
    assert found.shown is not None, found
    assert found.shown.family == board.family
    assert board.family in found.evidence


@pytest.mark.parametrize("legacy", [False, True])
def test_the_other_layout_of_a_charuco_board_is_tried(legacy: bool) -> None:
    shown = CHARUCO.changed(legacy_pattern=legacy)
    board = scene(shown, turn=TURN)
    found = detect(board.picture(), CHARUCO.changed(legacy_pattern=not legacy))
    assert board.errors_px(found).max() < 0.1
    assert isinstance(found, Detection)
    assert f"legacy_pattern = {str(legacy).lower()}" in found.note
    as_described = detect(board.picture(), shown)
    assert isinstance(as_described, Detection)
    assert as_described.note == ""


def side_by_side(left: Target, right: Target) -> np.ndarray:
    """One picture of two boards."""
    return np.hstack([scene(board, turn=TURN, share=0.7).picture() for board in (left, right)])


def test_boards_in_one_picture_are_told_apart_by_their_numbers() -> None:
    here, there = GRID, GRID.changed(first_id=40)
    image = side_by_side(here, there)
    for board, shift in ((here, 0), (there, image.shape[1] / 2)):
        found = detect(image, board)
        assert isinstance(found, Detection), found
        truth = scene(board, turn=TURN, share=0.7).pixels + np.array([shift, 0])
        assert np.abs(found.pixels - truth[found.point_ids]).max() < 0.3


@pytest.mark.parametrize("board", [CHARUCO, TAGS, GRID, MARKER])
def test_the_same_board_twice_is_said(board: Target) -> None:
    found = detect(side_by_side(board, board), board)
    assert isinstance(found, NotFound)
    assert found.reason is Reason.REPEATED
    assert "twice" in found.evidence


def test_the_same_board_twice_is_said_of_one_that_is_cut_and_of_chessboards() -> None:
    image = side_by_side(CHARUCO, CHARUCO)
    cut = image[:, : round(0.72 * image.shape[1])]
    found = detect(cut, CHARUCO)
    assert isinstance(found, Detection) or found.reason is Reason.REPEATED
    board = Chessboard(6, 9, 0.025)
    found = detect(side_by_side(board, board), board)
    assert isinstance(found, NotFound)
    assert found.reason is Reason.REPEATED
    other = detect(side_by_side(board, Chessboard(5, 7, 0.025)), board)
    assert isinstance(other, Detection)


def test_a_board_described_as_one_of_its_own_parts_is_not_found_under_wrong_names() -> None:
    """A grid whose numbers begin in the middle of the one that is shown."""
    for first in range(1, 9):
        board = scene(GRID, turn=TURN)
        found = detect(board.picture(), GRID.changed(first_id=first))
        assert isinstance(found, NotFound), first
        assert found.shown == GRID


@pytest.mark.parametrize(("left", "top"), [(12, 20), (440, 380)])
def test_two_markers_at_the_edge_of_a_picture_are_no_grid(left: int, top: int) -> None:
    """They may be two single markers, or belong to a board that goes on outside."""
    image = np.full((480, 640), 200, dtype=np.uint8)
    markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    for k, number in enumerate((57, 83)):
        printed = cv2.aruco.generateImageMarker(markers, number, 84)
        image[top : top + 84, left + 110 * k : left + 110 * k + 84] = np.where(printed > 0, 220, 30)
    missing = detect(image, ArucoMarker(0.1, "DICT_5X5_100", 3))
    assert isinstance(missing, NotFound)
    assert missing.shown in [ArucoMarker(0.1, "DICT_5X5_100", number) for number in (57, 83)]
    missing = detect(image, GRID)
    assert isinstance(missing, NotFound)
    assert missing.shown is None
    middle = np.roll(image, (200 - top, 220 - left), axis=(0, 1))
    missing = detect(middle, GRID)
    assert isinstance(missing, NotFound)
    assert isinstance(missing.shown, ArucoGrid)
    assert missing.shown.marker_ids.tolist() == [57, 83]


@pytest.mark.parametrize("name", BOARDS)
def test_any_board_is_recognised(name: str) -> None:
    board: Target = BOARDS[name]
    shown = shown_board(scene(board, turn=TURN).picture())
    assert shown is not None
    assert shown.family == board.family
    sizes = [{getattr(one, side, 0) for side in ("rows", "columns")} for one in (shown, board)]
    assert sizes[0] == sizes[1]


def test_clutter_is_no_board() -> None:
    random = np.random.default_rng(2)
    for _ in range(3):
        image = np.full((400, 500), 120, dtype=np.uint8)
        for _ in range(80):
            x, y, w, h = (random.uniform(0, 1, 4) * [500, 400, 120, 120]).astype(int).tolist()
            cv2.rectangle(image, (x, y), (x + w, y + h), float(random.uniform(0, 255)), -1)
        for board in BOARDS.values():
            missing = detect(image, board)
            assert isinstance(missing, NotFound), board
            assert missing.shown is None, missing


@pytest.mark.parametrize(
    ("case", "points"), [("legacy_8x11", 70), ("single_aruco_582", 4), ("moveit_aruco_grid_4x3", 48)]
)
def test_boards_of_the_main_tools_are_found(case: str, points: int, data_folder: Path) -> None:
    folder = data_folder / "cases" / "charuco_boards"
    if not folder.is_dir():
        pytest.skip("the cases are not among the public data")
    fields = json.loads((folder / f"{case}.json").read_text())
    fields["family"] = fields["family"].removesuffix(" (not there)").replace("aruco grid", "aruco_grid")
    if fields["family"] == "aruco":
        fields |= {"family": "aruco_marker", "marker_m": fields.pop("side_m")}
    target = Target.from_dict(fields)
    image = read_image(folder / f"{case}.jpg")
    found = detect(image, target)
    assert isinstance(found, Detection), found
    assert len(found) == points
    assert ("legacy_pattern = true" in found.note) == (case == "legacy_8x11")
    if isinstance(target, Charuco):
        stated = detect(image, target.changed(legacy_pattern=True))
        assert isinstance(stated, Detection)
        np.testing.assert_array_equal(stated.pixels, found.pixels)
