"""With a prediction: the same points as without, wherever the prediction puts them."""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from handeye.detection import Detection, NotFound, Prediction, Reason, detect
from handeye.detection.part import Part, jacobians, mapped
from handeye.detection.predicted import expected_part
from handeye.errors import InputError
from handeye.types import Chessboard
from scenes import CAMERAS, PINHOLE, TARGETS, Scene, scene

MODULE = sys.modules[detect.__module__]
SAME_PX = 0.01


def predicted(board: Scene, shift: tuple[float, float] = (3.0, -4.0), margin_px: float = 10.0) -> Prediction:
    return Prediction(board.pixels + np.array(shift), margin_px)


def looks(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether each look from now on is at a part of an image."""
    seen: list[bool] = []

    def watched(finder: Any) -> Any:
        def find(image: Any, target: Any, part: Part | None) -> Any:
            seen.append(part is not None)
            return finder(image, target, part)

        return find

    finders = {family: watched(finder) for family, finder in MODULE._FINDERS.items()}
    monkeypatch.setattr(MODULE, "_FINDERS", finders)
    return seen


@pytest.mark.parametrize("lens", ["pinhole", "brown_conrady_5", "kannala_brandt"])
@pytest.mark.parametrize("name", TARGETS)
def test_points_are_the_same_and_only_a_part_is_looked_at(
    name: str, lens: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    board = scene(TARGETS[name], CAMERAS[lens], share=0.5, at=(0.2, -0.1))
    image = board.picture(blur_px=0.6, noise=1.5)
    whole = detect(image, board.target)
    assert isinstance(whole, Detection), whole
    seen = looks(monkeypatch)
    part = detect(image, board.target, predicted=predicted(board))
    assert isinstance(part, Detection), part
    # Tags this small need the image as it is: then there is nothing to gain from a part.
    assert seen == [name != "april grid"]
    assert len(part) >= 0.9 * len(whole)
    _, here, there = np.intersect1d(part.point_ids, whole.point_ids, return_indices=True)
    assert np.abs(part.pixels[here] - whole.pixels[there]).max() < SAME_PX
    assert board.rms_px(part) < 0.08


@pytest.mark.parametrize("name", TARGETS)
def test_a_prediction_elsewhere_costs_time_only(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    board = scene(TARGETS[name], share=0.45, at=(-0.35, 0.2))
    image = board.picture()
    whole = detect(image, board.target)
    seen = looks(monkeypatch)
    for shift in ((260.0, 30.0), (45.0, 0.0), (5000.0, 0.0)):
        seen.clear()
        found = detect(image, board.target, predicted=predicted(board, shift, 0.0))
        assert isinstance(found, Detection), found
        np.testing.assert_array_equal(found.point_ids, whole.point_ids)
        assert np.abs(found.pixels - whole.pixels).max() < SAME_PX


@pytest.mark.parametrize("name", ["charuco", "april grid"])
def test_a_part_that_cuts_the_board_is_not_enough(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    board = scene(TARGETS[name], share=0.6)
    image = board.picture()
    whole = detect(image, board.target)
    assert isinstance(whole, Detection)
    seen = looks(monkeypatch)
    found = detect(image, board.target, predicted=predicted(board, (70.0, 30.0), 0.0))
    assert seen == [True, False]
    assert isinstance(found, Detection)
    np.testing.assert_array_equal(found.pixels, whole.pixels)


@pytest.mark.parametrize("name", ["charuco", "april grid"])
def test_a_board_cut_by_the_image_is_found_in_the_part(name: str) -> None:
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


def test_a_part_is_the_board_seen_squarely() -> None:
    board = scene(TARGETS["chessboard"], turn=(0.3, 0.6, 0.7), share=0.5)
    image = board.picture()
    part = expected_part(image, board.target, predicted(board, (0.0, 0.0)), 24)
    assert part is not None
    places = part.inverse(board.pixels).reshape(6, 9, 2)
    across, down = np.diff(places, axis=1), np.diff(places, axis=0)
    np.testing.assert_allclose(across, np.broadcast_to(across[0, 0], across.shape), atol=1e-3)
    np.testing.assert_allclose(down, np.broadcast_to(down[0, 0], down.shape), atol=1e-3)
    # What it shows there is what the image shows, dark squares and light ones.
    middles = ((places[:-1, :-1] + places[1:, 1:]) / 2).reshape(-1, 2)
    u, v = np.rint(middles).astype(int).T
    x, y = np.rint(part.places(middles)).astype(int).T
    assert np.abs(part.picture[v, u].astype(int) - image[y, x]).max() < 20
    # A prediction that takes most of the image is no part of it.
    near = replace(board, pose=scene(board.target, turn=(0.0, 0.0, 0.0), share=0.95).pose)
    assert expected_part(image[:60, :60].copy(), board.target, predicted(near), 24) is None


def test_parts_map_places_and_shapes() -> None:
    homography = np.array([[1.2, 0.1, 5.0], [-0.2, 0.9, 7.0], [1e-4, -2e-4, 1.0]])
    part = Part(np.zeros((50, 60), dtype=np.uint8), homography)
    places = np.random.default_rng(0).uniform(0, 50, (7, 2))
    np.testing.assert_allclose(part.inverse(part.places(places)), places, atol=1e-9)
    J = jacobians(homography, places)
    for axis in range(2):
        step = 1e-6 * np.eye(2)[axis]
        slope = (mapped(homography, places + step) - mapped(homography, places - step)) / 2e-6
        np.testing.assert_allclose(J[:, :, axis], slope, atol=1e-6)
    round_shapes = np.broadcast_to(9 * np.eye(2), (7, 2, 2))
    np.testing.assert_allclose(part.shapes(places, round_shapes), 9 * J @ J.swapaxes(1, 2))
    half = Part.whole(np.zeros((40, 60), dtype=np.uint8), 0.5)
    np.testing.assert_allclose(half.places(np.array([[0.0, 0.0]])), [[0.5, 0.5]])
