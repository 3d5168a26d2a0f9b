"""Every family through every lens: where the points are, what they are called, and what is not there."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handeye.detection import Detection, NotFound, Reason, detect
from handeye.detection.base import is_mirrored
from handeye.errors import DetectionError, InputError
from handeye.types import AprilGrid, Charuco, Chessboard, CircleGrid, Target
from scenes import CAMERAS, PINHOLE, TARGETS, TILTED, scene

# Root mean square distance from the projection, in pictures without noise and blur, and in usual ones.
EXACT_PX = {"chessboard": 0.015, "charuco": 0.035, "april grid": 0.05, "aruco grid": 0.05, "marker": 0.05}
CIRCLES_PX = 0.01
NOISY_PX = 0.08


@pytest.mark.parametrize("lens", CAMERAS)
@pytest.mark.parametrize("name", TARGETS)
def test_points_are_where_they_are_projected(name: str, lens: str) -> None:
    board = scene(TARGETS[name], CAMERAS[lens], share=0.6)
    found = detect(board.picture(), board.target)
    assert isinstance(found, Detection), found
    assert len(found) >= (0.85 if name.endswith("grid") else 1) * board.target.point_count
    assert board.rms_px(found) < EXACT_PX.get(name, CIRCLES_PX)


@pytest.mark.parametrize("name", TARGETS)
def test_noise_blur_and_uneven_light_matter_little(name: str) -> None:
    board = scene(TARGETS[name], CAMERAS["brown_conrady_5"], (-0.3, 0.4, -0.3))
    image = board.picture(blur_px=0.7, noise=3.0, gradient=(0.5, -0.3), dark=40, light=180)
    found = detect(image, board.target)
    assert isinstance(found, Detection), found
    assert len(found) >= (0.6 if name == "april grid" else 0.9) * board.target.point_count
    assert board.rms_px(found) < NOISY_PX


@pytest.mark.parametrize("roll_deg", [-160, -90, 45, 100, 180])
@pytest.mark.parametrize("name", ["charuco", "april grid", "marked circles", "asymmetric circles"])
def test_labels_without_symmetry_are_right_however_the_board_is_turned(name: str, roll_deg: float) -> None:
    target = TARGETS[name]
    assert len(target.symmetries) == 1
    board = scene(target, PINHOLE, (0.2, -0.1, np.deg2rad(roll_deg)), share=0.5)
    found = detect(board.picture(), target)
    assert board.errors_px(found).max() < 0.3
    assert isinstance(found, Detection)
    assert len(found) >= 0.85 * target.point_count
    assert (np.diff(found.point_ids) > 0).all()


@pytest.mark.parametrize("roll_deg", [-160, -90, 30, 120])
@pytest.mark.parametrize("name", ["chessboard", "circles"])
def test_labels_are_right_up_to_symmetry_and_never_mirrored(name: str, roll_deg: float) -> None:
    target = TARGETS[name]
    board = scene(target, PINHOLE, (-0.2, 0.3, np.deg2rad(roll_deg)), share=0.5)
    found = detect(board.picture(), target)
    assert isinstance(found, Detection), found
    assert board.rms_px(found) < 0.02
    assert not is_mirrored(target.points[found.point_ids, :2], found.pixels)


@pytest.mark.parametrize("name", TARGETS)
def test_a_mirrored_board_is_never_labeled_as_if_seen_from_its_front(name: str) -> None:
    board = scene(TARGETS[name])
    found = detect(np.ascontiguousarray(board.picture()[:, ::-1]), board.target)
    if isinstance(found, Detection):  # a chessboard, a plain grid, marker 582: like themselves in a mirror
        assert name in {"chessboard", "circles", "asymmetric circles", "marked circles", "marker"}
        assert not is_mirrored(board.target.points[found.point_ids, :2], found.pixels)


@pytest.mark.parametrize("at", [(0.85, 0.0), (-0.8, -0.6), (0.0, 0.95)])
@pytest.mark.parametrize("name", ["charuco", "april grid"])
def test_boards_with_markers_are_found_in_part(name: str, at: tuple[float, float]) -> None:
    board = scene(TARGETS[name], at=at, share=0.8)
    found = detect(board.picture(), board.target)
    assert isinstance(found, Detection), found
    assert 4 <= len(found) < 0.9 * board.target.point_count
    assert board.errors_px(found).max() < 0.15


@pytest.mark.parametrize("name", ["chessboard", "circles", "asymmetric circles", "marked circles"])
def test_others_are_not_found_when_cut_in_half(name: str) -> None:
    board = scene(TARGETS[name], at=(1.0, 0.1), share=0.7)
    found = detect(board.picture(), board.target)
    assert isinstance(found, NotFound), found
    assert found.evidence
    assert found.hint


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (Chessboard(6, 9, 0.03), Chessboard(5, 7, 0.03)),
        (Chessboard(6, 9, 0.03), Chessboard(7, 10, 0.03)),
        (CircleGrid(6, 8, 0.03, 0.016), CircleGrid(5, 7, 0.03, 0.016)),
        (CircleGrid(6, 8, 0.03, 0.016), CircleGrid(6, 10, 0.03, 0.016)),
        (CircleGrid(6, 8, 0.03, 0.016), CircleGrid(6, 8, 0.03, 0.016, marked=10)),
        (Charuco(6, 8, 0.03, 0.0225, "DICT_4X4_50"), Charuco(8, 6, 0.03, 0.0225, "DICT_4X4_50")),
        (Charuco(6, 8, 0.03, 0.0225, "DICT_4X4_50"), Charuco(6, 8, 0.03, 0.0225, "DICT_6X6_250")),
        (Charuco(6, 8, 0.03, 0.0225, "DICT_4X4_50"), AprilGrid(3, 4, 0.04, 0.3)),
        (AprilGrid(3, 4, 0.04, 0.3), AprilGrid(4, 3, 0.04, 0.3)),
        (AprilGrid(3, 4, 0.04, 0.3), AprilGrid(3, 4, 0.04, 0.3, border_bits=1)),
    ],
)
def test_another_board_is_refused_with_a_reason(shown: Target, expected: Target) -> None:
    found = detect(scene(shown, turn=(0.1, 0.2, 0.1)).picture(), expected)
    assert isinstance(found, NotFound), found
    assert found.reason in {Reason.WRONG_SIZE, Reason.OTHER_BOARD, Reason.INCONSISTENT}
    error = found.error("im_07")
    assert isinstance(error, DetectionError)
    assert error.code == found.reason
    assert "im_07" in error.message
    assert error.hint


def test_the_size_that_is_visible_is_named() -> None:
    found = detect(scene(Chessboard(6, 9, 0.03)).picture(), Chessboard(5, 7, 0.03))
    assert isinstance(found, NotFound)
    assert found.reason is Reason.WRONG_SIZE
    assert "9 x 6" in found.evidence or "6 x 9" in found.evidence


BLANKS = {
    Reason.UNDEREXPOSED: np.full((120, 160), 8, dtype=np.uint8),
    Reason.OVEREXPOSED: np.full((120, 160), 255, dtype=np.uint8),
    Reason.LOW_CONTRAST: np.full((120, 160), 120, dtype=np.uint8),
    Reason.IMAGE_TOO_SMALL: np.full((10, 160), 120, dtype=np.uint8),
}


@pytest.mark.parametrize("reason", BLANKS)
@pytest.mark.parametrize("name", TARGETS)
def test_blank_and_tiny_pictures_are_explained(name: str, reason: Reason) -> None:
    found = detect(BLANKS[reason], TARGETS[name])
    assert isinstance(found, NotFound)
    assert found.reason is reason


@pytest.mark.parametrize("name", TARGETS)
def test_a_picture_out_of_focus_is_explained(name: str) -> None:
    board = scene(TARGETS[name])
    found = detect(cv2.GaussianBlur(board.picture(), (0, 0), 24), board.target)
    assert isinstance(found, NotFound)
    assert found.reason is Reason.BLURRED


@pytest.mark.parametrize("size", [(1, 1), (24, 24), (25, 400), (400, 24), (31, 33)])
@pytest.mark.parametrize("name", TARGETS)
def test_small_pictures_of_anything_are_no_board(name: str, size: tuple[int, int]) -> None:
    image = np.random.default_rng(5).integers(0, 256, size, dtype=np.uint8)
    assert isinstance(detect(image, TARGETS[name]), NotFound)


@pytest.mark.parametrize("shape", [(60, 80, 3), (60, 80, 1), (0, 0, 0)])
def test_colour_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="grey"):
        detect(np.zeros(shape, dtype=np.uint8), TARGETS["chessboard"])


@pytest.mark.parametrize("dtype", [np.uint16, np.float32, np.bool_])
def test_values_other_than_bytes_are_refused(dtype: type) -> None:
    with pytest.raises(InputError, match="uint8"):
        detect(np.zeros((60, 80), dtype=dtype), TARGETS["chessboard"])


def test_no_pixels_at_all() -> None:
    found = detect(np.zeros((0, 80), dtype=np.uint8), TARGETS["charuco"])
    assert isinstance(found, NotFound)
    assert found.reason is Reason.IMAGE_TOO_SMALL


@pytest.mark.parametrize("name", TARGETS)
def test_views_that_are_not_contiguous_are_fine(name: str) -> None:
    board = scene(TARGETS[name])
    image = board.picture()
    wide = np.repeat(image, 2, axis=1)[:, ::2]
    assert not wide.flags.c_contiguous
    np.testing.assert_array_equal(detect(wide, board.target).pixels, detect(image, board.target).pixels)


@settings(max_examples=25)
@given(
    st.sampled_from(sorted(TARGETS)),
    st.integers(0, 2**31),
    st.sampled_from(["bytes", "binary", "smooth", "rows", "sparse"]),
    st.tuples(st.integers(24, 160), st.integers(24, 200)),
)
def test_noise_is_never_a_board(name: str, seed: int, kind: str, size: tuple[int, int]) -> None:
    random = np.random.default_rng(seed)
    noise = random.integers(0, 256, size, dtype=np.uint8)
    if kind == "binary":
        noise = ((noise > 127) * 255).astype(np.uint8)
    elif kind == "smooth":
        noise = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 3), None, 0, 255, cv2.NORM_MINMAX)
    elif kind == "rows":
        noise = np.ascontiguousarray(np.broadcast_to(noise[:, :1], size))
    elif kind == "sparse":
        noise = ((noise > 250) * 255).astype(np.uint8)
    assert isinstance(detect(noise, TARGETS[name]), NotFound)


def test_steep_views_are_found() -> None:
    for name in TARGETS:
        board = scene(TARGETS[name], turn=(0.0, 0.95, 0.1), share=0.6)
        assert board.rms_px(detect(board.picture(), board.target)) < 0.1, name


def test_the_labeling_of_a_symmetric_board_does_not_jump_between_like_views() -> None:
    target = TARGETS["circles"]
    first, second = (
        detect(scene(target, turn=turn).picture(), target) for turn in (TILTED, (-0.2, 0.1, -0.4))
    )
    assert isinstance(first, Detection)
    assert isinstance(second, Detection)
    for found in (first, second):
        by_id = dict(zip(found.point_ids.tolist(), found.pixels, strict=True))
        assert by_id[0][0] < by_id[7][0]
