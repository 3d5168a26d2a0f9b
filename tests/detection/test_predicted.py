"""With a prediction: the same points as without, wherever the prediction puts them."""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from handeye.detection import Detection, NotFound, Prediction, Reason, charuco, detect
from handeye.detection.part import Part, jacobians, mapped
from handeye.detection.predicted import where_expected
from handeye.detection.registration import drawn
from handeye.errors import InputError
from handeye.types import AprilGrid, Charuco, Chessboard, CircleGrid, Target
from scenes import CAMERAS, PINHOLE, TARGETS, Scene, scene

MODULE = sys.modules[detect.__module__]
SAME_PX = 0.01


def predicted(board: Scene, shift: tuple[float, float] = (3.0, -4.0), margin_px: float = 10.0) -> Prediction:
    return Prediction(board.pixels + np.array(shift), margin_px)


def looks(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is looked at from now on: the places expected, the whole image."""
    seen: list[str] = []

    def watched(function: Any, what: str) -> Any:
        def called(*arguments: Any) -> Any:
            seen.append(what)
            return function(*arguments)

        return called

    kinds = tuple(
        replace(kind, find=watched(kind.find, "whole"), confirm=watched(kind.confirm, "expected"))
        for kind in MODULE.KINDS
    )
    monkeypatch.setattr(MODULE, "KINDS", kinds)
    return seen


@pytest.mark.parametrize("lens", ["pinhole", "brown_conrady_5", "kannala_brandt"])
@pytest.mark.parametrize("name", TARGETS)
def test_points_are_the_same_without_a_look_at_the_whole_image(
    name: str, lens: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    board = scene(TARGETS[name], CAMERAS[lens], share=0.5, at=(0.2, -0.1))
    image = board.picture(blur_px=0.6, noise=1.5)
    whole = detect(image, board.target)
    assert isinstance(whole, Detection), whole
    seen = looks(monkeypatch)
    part = detect(image, board.target, predicted=predicted(board))
    assert isinstance(part, Detection), part
    assert seen == ["expected"]
    assert len(part) >= 0.95 * len(whole)
    _, here, there = np.intersect1d(part.point_ids, whole.point_ids, return_indices=True)
    assert np.abs(part.pixels[here] - whole.pixels[there]).max() < SAME_PX
    assert board.rms_px(part) < 0.08


@pytest.mark.parametrize(
    ("asked", "shown"),
    [
        (Chessboard(6, 9, 0.03), Chessboard(7, 9, 0.03)),
        (CircleGrid(6, 8, 0.03, 0.016), CircleGrid(6, 9, 0.03, 0.016)),
        (CircleGrid(6, 8, 0.03, 0.016, marked=19), CircleGrid(6, 8, 0.03, 0.016)),
        (Charuco(6, 8, 0.03, 0.0225, "DICT_4X4_50"), Charuco(6, 8, 0.03, 0.0225, "DICT_5X5_50")),
        (AprilGrid(3, 4, 0.04, 0.3), AprilGrid(3, 4, 0.04, 0.3, "DICT_APRILTAG_25h9")),
    ],
)
def test_another_board_there_is_not_taken_for_it(
    asked: Target, shown: Target, monkeypatch: pytest.MonkeyPatch
) -> None:
    board = scene(shown, share=0.6)
    guess = Prediction(Scene(PINHOLE, asked, board.pose).pixels, 8.0)
    seen = looks(monkeypatch)
    found = detect(board.picture(), asked, predicted=guess)
    assert seen[-1] == "whole"
    assert isinstance(found, NotFound)


@pytest.mark.parametrize("name", TARGETS)
def test_a_prediction_one_line_off_misleads_nobody(name: str) -> None:
    board = scene(TARGETS[name], share=0.5)
    image = board.picture(blur_px=0.6)
    shifted = Scene(PINHOLE, board.target, board.pose)
    pitch = np.linalg.norm(board.target.points[1] - board.target.points[0])
    matrix = board.pose.matrix.copy()
    matrix[:3, 3] += matrix[:3, 0] * pitch
    guess = Prediction(replace(shifted, pose=type(board.pose)(matrix)).pixels, 4.0)
    found = detect(image, board.target, predicted=guess)
    assert board.rms_px(found) < 0.1


def test_a_hidden_part_of_a_board_is_left_out_and_light_circles_are_found() -> None:
    for name in ("circles", "charuco", "april grid"):
        board = scene(TARGETS[name], share=0.6)
        image = board.picture(blur_px=0.6, noise=1.0)
        middle = np.rint(board.pixels[len(board.pixels) // 2]).astype(int)
        image[middle[1] - 26 : middle[1] + 26, middle[0] - 26 : middle[0] + 26] = 90
        found = detect(image, board.target, predicted=predicted(board))
        assert board.errors_px(found).max() < 0.2
        assert len(board.target.points) > len(board.errors_px(found)) > 0.7 * len(board.target.points)
    board = scene(TARGETS["circles"], share=0.6)
    found = detect(board.picture(dark=220, light=30), board.target, predicted=predicted(board))
    assert board.rms_px(found) < 0.05


@pytest.mark.parametrize("name", TARGETS)
def test_a_prediction_elsewhere_costs_time_only(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    board = scene(TARGETS[name], share=0.45, at=(-0.35, 0.2))
    image = board.picture()
    whole = detect(image, board.target)
    seen = looks(monkeypatch)
    for shift, margin_px in (
        ((260.0, 30.0), 0.0),
        ((45.0, 0.0), 0.0),
        ((5000.0, 0.0), 0.0),
        ((3.0, 0.0), 1e6),
    ):
        seen.clear()
        found = detect(image, board.target, predicted=predicted(board, shift, margin_px))
        assert isinstance(found, Detection), found
        np.testing.assert_array_equal(found.point_ids, whole.point_ids)
        assert np.abs(found.pixels - whole.pixels).max() < SAME_PX


@pytest.mark.parametrize("name", ["charuco", "april grid"])
def test_a_board_cut_by_the_image_is_found_where_expected(name: str) -> None:
    board = scene(TARGETS[name], at=(0.7, 0.0), share=0.6)
    image = board.picture()
    whole, part = detect(image, board.target), detect(image, board.target, predicted=predicted(board))
    assert isinstance(whole, Detection)
    assert isinstance(part, Detection)
    assert len(part) >= 0.9 * len(whole)
    assert board.errors_px(part).max() < 0.2


def test_a_larger_board_is_not_taken_for_a_smaller_one() -> None:
    shown = scene(Chessboard(7, 10, 0.03), share=0.6)
    asked = Chessboard(6, 9, 0.03)
    guess = Prediction(Scene(PINHOLE, asked, shown.pose).pixels, 5.0)
    found = detect(shown.picture(), asked, predicted=guess)
    assert isinstance(found, NotFound)
    assert found.reason is Reason.WRONG_SIZE


@pytest.mark.parametrize("name", TARGETS)
def test_nothing_there_is_explained_as_without(name: str) -> None:
    board = scene(TARGETS[name])
    blank = np.full((416, 520), 120, dtype=np.uint8)
    found = detect(blank, board.target, predicted=predicted(board))
    assert isinstance(found, NotFound)
    assert found.reason is Reason.LOW_CONTRAST


@pytest.mark.parametrize("name", TARGETS)
def test_predictions_that_say_nothing_are_harmless(name: str) -> None:
    board = scene(TARGETS[name], share=0.5)
    image = board.picture()
    count = board.target.point_count
    whole = detect(image, board.target)
    for pixels in (
        np.full((count, 2), np.nan),
        np.zeros((count, 2)),
        np.full((count, 2), 1e300),
        np.column_stack([np.arange(count), np.arange(count)]) * 1.0,
        np.random.default_rng(1).uniform(0, 400, (count, 2)),
    ):
        found = detect(image, board.target, predicted=Prediction(pixels, 10.0))
        assert isinstance(found, Detection)
        assert np.abs(found.pixels - whole.pixels).max() < SAME_PX


def test_predictions_are_checked() -> None:
    for pixels, margin in (([[1.0, 2.0, 3.0]], 1.0), ([[1.0, 2.0]], -1.0), ([[1.0, 2.0]], np.nan)):
        with pytest.raises(InputError, match="prediction"):
            Prediction(pixels, margin)
    board = scene(TARGETS["chessboard"])
    with pytest.raises(InputError, match="53 pixels for 54 points"):
        detect(board.picture(), board.target, predicted=Prediction(board.pixels[1:], 5.0))


@pytest.mark.parametrize("lens", ["pinhole", "brown_conrady_5"])
@pytest.mark.parametrize("name", TARGETS)
def test_a_board_is_aligned_to_a_fraction_of_a_pixel(name: str, lens: str) -> None:
    board = scene(TARGETS[name], CAMERAS[lens], turn=(0.3, 0.5, 0.7), share=0.5)
    image = board.picture(blur_px=0.6)
    found = where_expected(image, board.target, predicted(board))
    assert found is not None
    plane = board.target.points[:, :2]
    assert np.linalg.norm(found.places(plane) - board.pixels, axis=1).max() < 0.8
    assert found.likeness(plane).min() > 0.8
    # What is drawn is what is seen.
    places = plane.mean(axis=0) + np.random.default_rng(0).uniform(-0.05, 0.05, (200, 2))
    assert np.corrcoef(found.seen(places), drawn(board.target, places))[0, 1] > 0.9


def test_parts_map_places_and_shapes() -> None:
    homography = np.array([[1.2, 0.1, 5.0], [-0.2, 0.9, 7.0], [1e-4, -2e-4, 1.0]])
    part = Part(np.zeros((50, 60), dtype=np.uint8), homography)
    places = np.random.default_rng(0).uniform(0, 50, (7, 2))
    J = jacobians(homography, places)
    for axis in range(2):
        step = 1e-6 * np.eye(2)[axis]
        slope = (mapped(homography, places + step) - mapped(homography, places - step)) / 2e-6
        np.testing.assert_allclose(J[:, :, axis], slope, atol=1e-6)
    round_shapes = np.broadcast_to(9 * np.eye(2), (7, 2, 2))
    np.testing.assert_allclose(part.shapes(places, round_shapes), 9 * J @ J.swapaxes(1, 2))
    half = Part.whole(np.zeros((40, 60), dtype=np.uint8), 0.5)
    np.testing.assert_allclose(half.places(np.array([[0.0, 0.0]])), [[0.5, 0.5]])


def test_a_marker_without_extent_gives_no_corner_and_no_warning() -> None:
    squares = np.kron(np.indices((10, 10)).sum(axis=0) % 2 * 200, np.ones((20, 20))).astype(np.uint8)
    target = Charuco(5, 7, 0.035, 0.026, "DICT_4X4_50")
    steps = np.array([np.eye(2) * 20 / 0.035, np.zeros((2, 2))])
    fits = charuco._measured(squares, target, np.array([[99.4, 99.6], [59.5, 59.5]]), steps)
    np.testing.assert_allclose(fits.places[0], 99.5, atol=1e-3)
    assert np.isnan(fits.places[1]).all()
