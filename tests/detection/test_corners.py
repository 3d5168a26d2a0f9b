"""Corners that are corners: narrow margins, shadows, reflections, and how well each is said to be known."""

import cv2
import numpy as np
import pytest

from handeye import _core
from handeye.cameras.render import clutter
from handeye.detection import Detection, NotFound, detect
from handeye.detection.markers import NO_IDS, Seen
from handeye.detection.saddles import find_saddles
from handeye.detection.tags import measured
from handeye.types import AprilGrid, ArucoGrid, ArucoMarker, Chessboard
from scenes import CAMERAS, HEIGHT_PX, TARGETS, TILTED, WIDTH_PX, Scene, scene

TURNS = ((0.35, -0.3, 0.2), (-0.5, 0.2, 1.4), (0.1, 0.6, -2.5))


def shadowed(image: np.ndarray, at: float, angle: float) -> np.ndarray:
    """A picture of which one side lies in the shadow of a straight edge."""
    v, u = np.indices(image.shape)
    away = (u - WIDTH_PX / 2) * np.cos(angle) + (v - HEIGHT_PX / 2) * np.sin(angle) - at
    lit = cv2.GaussianBlur(np.where(away > 0, 0.4, 1.0) * image, (0, 0), 0.7)
    return np.rint(lit).astype(np.uint8)


def worst_px(board: Scene, found: Detection) -> float:
    """Largest error under whichever of the labels that look alike fits best."""
    return min(
        float(np.linalg.norm(found.pixels - board.pixels[p[found.point_ids]], axis=1).max())
        for p in board.target.symmetries
    )


@pytest.mark.parametrize("margin", [0.2, 0.3, 0.45])
@pytest.mark.parametrize("size", [(3, 3), (3, 4), (4, 5), (5, 8)])
def test_the_edge_of_a_board_before_a_dark_ground_has_no_corners(
    size: tuple[int, int], margin: float
) -> None:
    for turn in TURNS:
        board = scene(Chessboard(*size, 0.03), turn=turn, share=0.5)
        image = board.picture(margin_m=margin * 0.03, background=20.0, blur_px=0.8, noise=2.0)
        found = detect(image, board.target)
        assert isinstance(found, Detection), (turn, found)
        assert worst_px(board, found) < 0.1
        np.testing.assert_array_equal(found.pixels, detect(image, board.target).pixels)
        other = detect(image, Chessboard(size[0] + 2, size[1], 0.03))
        assert isinstance(other, NotFound), (turn, other)


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, 4.0])
@pytest.mark.parametrize("name", ["chessboard", "charuco"])
def test_corners_at_the_edge_of_a_shadow_are_right_or_left_out(name: str, angle: float) -> None:
    board = scene(TARGETS[name], turn=(0.2, -0.2, 0.1), share=0.7)
    left_out = 0
    for at in (-40.0, 5.0, 33.0):
        found = detect(shadowed(board.picture(), at, angle), board.target)
        assert isinstance(found, Detection), (at, found)
        left_out += board.target.point_count - len(found)
        assert worst_px(board, found) < 0.3, at
    assert left_out > 0


@pytest.mark.parametrize("gamma", [0.45, 2.2])
@pytest.mark.parametrize(
    "target", [AprilGrid(4, 5, 0.04, 0.3, border_bits=1), ArucoGrid(4, 5, 0.04, 0.012, "DICT_5X5_100")]
)
def test_grey_values_that_are_not_proportional_to_light_shift_no_marker(
    target: AprilGrid | ArucoGrid, gamma: float
) -> None:
    board = scene(target, CAMERAS["brown_conrady_5"], turn=(0.2, -0.3, 0.1), share=0.8)
    light = cv2.GaussianBlur(board.picture(), (0, 0), 0.8) / 255.0
    image = np.rint(255 * light**gamma).astype(np.uint8)
    found = detect(image, target)
    assert isinstance(found, Detection), found
    assert board.rms_px(found) < 0.03
    assert board.rms_px(detect(cv2.GaussianBlur(board.picture(), (0, 0), 0.8), target)) < 0.06


def test_bits_next_to_a_blurred_side_do_not_move_it() -> None:
    board = scene(AprilGrid(5, 6, 0.035, 0.3, border_bits=1), turn=(0.2, -0.3, 0.1), share=0.5)
    assert board.rms_px(detect(board.picture(blur_px=1.2), board.target)) < 0.028


def test_all_corners_tell_the_directions_of_edges_in_noise() -> None:
    board = scene(AprilGrid(5, 6, 0.035, 0.3, border_bits=1), turn=(0.2, -0.3, 0.1), share=0.5)
    assert board.rms_px(detect(board.picture(3, blur_px=0.6, noise=3.0), board.target)) < 0.026


def test_a_strong_lens_does_not_count_as_noise() -> None:
    board = scene(TARGETS["charuco"], CAMERAS["brown_conrady_4"], turn=TURNS[0], share=0.6)
    found = detect(board.picture(blur_px=0.8, noise=0.5), board.target)
    assert isinstance(found, Detection), found
    assert found.sigmas_px is not None
    assert len(found) < 40
    assert np.median(found.sigmas_px) < 0.006


@pytest.mark.parametrize("name", ["chessboard", "circles", "charuco", "april grid"])
def test_stated_deviations_are_of_the_size_of_the_errors(name: str) -> None:
    ratios: list[float] = []
    for seed, noise in enumerate((1.0, 3.0, 6.0)):
        board = scene(TARGETS[name], CAMERAS["brown_conrady_4"], turn=TURNS[0], share=0.6)
        found = detect(board.picture(seed, blur_px=0.8, noise=noise), board.target)
        assert isinstance(found, Detection), found
        assert found.sigmas_px is not None
        best = min(
            (
                ((found.pixels - board.pixels[p[found.point_ids]]) ** 2).sum(axis=1)
                for p in board.target.symmetries
            ),
            key=np.sum,
        )
        ratios.extend(best / 2 / found.sigmas_px**2)
    assert 0.4 < np.mean(ratios) < 1.8


def test_corners_in_little_light_are_said_to_be_less_certain() -> None:
    board = scene(TARGETS["chessboard"], turn=(0.0, 0.0, 0.0), share=0.7)
    light = np.where(np.arange(WIDTH_PX) < WIDTH_PX / 2, 1.0, 0.3)
    random = np.random.default_rng(4)
    grey = board.picture(blur_px=0.7) * cv2.GaussianBlur(light[np.newaxis], (0, 0), 20)
    image = np.rint((grey + random.normal(scale=2.0, size=grey.shape)).clip(0, 255)).astype(np.uint8)
    found = detect(image, board.target)
    assert isinstance(found, Detection)
    assert found.sigmas_px is not None
    dark = found.pixels[:, 0] > WIDTH_PX / 2 + 40
    assert np.median(found.sigmas_px[dark]) > 1.8 * np.median(
        found.sigmas_px[found.pixels[:, 0] < WIDTH_PX / 2 - 40]
    )


def test_a_board_of_which_some_corners_are_hidden_is_found_without_them() -> None:
    board = scene(TARGETS["chessboard"], turn=TILTED, share=0.7)
    image = board.picture()
    at = board.pixels[22]
    cv2.circle(image, (int(at[0]), int(at[1])), 9, 128, -1)
    found = detect(image, board.target)
    assert isinstance(found, Detection), found
    assert board.target.point_count - 6 <= len(found) < board.target.point_count
    assert worst_px(board, found) < 0.1


def test_clutter_alone_is_no_board() -> None:
    for seed in range(6):
        image = clutter(WIDTH_PX, HEIGHT_PX, np.random.default_rng(seed))
        for target in (Chessboard(3, 3, 0.03), Chessboard(3, 4, 0.03), Chessboard(5, 7, 0.03)):
            assert isinstance(detect(image, target), NotFound)


def test_crossings_know_where_it_is_dark() -> None:
    image = np.full((60, 60), 220, dtype=np.uint8)
    image[:30, :30] = image[30:, 30:] = 30
    found = find_saddles(image)
    assert len(found) == 1
    np.testing.assert_allclose(found.places, [[29.5, 29.5]], atol=0.3)
    first, second = found.angles[0]
    middle = (first + second) / 2
    # Dark is to the upper left and the lower right.
    assert abs(np.sin(middle - np.pi / 4)) < 0.2
    assert abs(second - first - np.pi / 2) < 0.2


def test_a_lone_crossing_has_no_neighbours() -> None:
    assert (_core.crossing_neighbours(np.zeros((1, 2)), np.array([[0.0, 1.5]]), 0.3) == -1).all()
    assert _core.crossing_neighbours(np.zeros((0, 2)), np.zeros((0, 2)), 0.3).shape == (0, 4)


def test_an_outline_of_a_marker_with_two_corners_in_one_place_is_none() -> None:
    target = ArucoMarker(0.1, "DICT_5X5_100", 3)
    corners = np.array([[[100.0, 100.0], [100.0, 100.0], [160.0, 160.0], [100.0, 160.0]]])
    outlines = Seen(np.array([3]), corners, NO_IDS)
    assert isinstance(measured(scene(target).picture(), target, outlines), NotFound)
