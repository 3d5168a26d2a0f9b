"""What a detection is, and how its points are called."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handeye.detection import Detection, NotFound, Reason, relabeled
from handeye.detection.base import affine, is_mirrored, ordered, x_axis
from handeye.errors import InputError
from handeye.types import Chessboard, CircleGrid


@pytest.mark.parametrize(
    ("ids", "pixels"),
    [
        ([], np.zeros((0, 2))),
        ([0, 1], [[1.0, 2.0]]),
        ([0, 0], [[1.0, 2.0], [3.0, 4.0]]),
        ([0], [[np.nan, 1.0]]),
        ([0], [[np.inf, 1.0]]),
        ([0], [[1.0, 2.0, 3.0]]),
        ([0.5], [[1.0, 2.0]]),
    ],
)
def test_unusable_points_are_refused(ids: list[int], pixels: object) -> None:
    with pytest.raises(InputError):
        Detection(ids, pixels)  # type: ignore[arg-type]


def test_a_detection_does_not_change() -> None:
    pixels = np.array([[1.0, 2.0]])
    found = Detection([3], pixels)
    pixels[:] = 0
    assert found.pixels.tolist() == [[1.0, 2.0]]
    with pytest.raises(ValueError, match="read-only"):
        found.pixels[0, 0] = 5


@pytest.mark.parametrize("reason", Reason)
def test_every_reason_has_a_hint_and_an_error(reason: Reason) -> None:
    missed = NotFound(reason, "nothing there")
    error = missed.error("im_1")
    assert error.code == reason
    assert error.hint == missed.hint != ""


@given(st.floats(-3.1, 3.1), st.floats(0.1, 10))
def test_affine_and_mirror(angle: float, scale: float) -> None:
    random = np.random.default_rng(0)
    plane = random.normal(size=(8, 2))
    A = scale * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    found, shift = affine(plane, plane @ A + [3, 4])
    np.testing.assert_allclose(found, A, atol=1e-9 * scale)
    np.testing.assert_allclose(shift, [3, 4], atol=1e-9)
    assert not is_mirrored(plane, plane @ A)
    assert is_mirrored(plane, plane @ A * [-1, 1])


@pytest.mark.parametrize("target", [Chessboard(5, 7, 0.1), CircleGrid(4, 4, 0.1, 0.05)])
def test_of_all_labels_the_one_with_x_to_the_right_is_taken(target: Chessboard | CircleGrid) -> None:
    pixels = 100 * target.points[:, :2] + 50
    assert len(target.symmetries) > 1
    for permutation in target.symmetries:
        turned = relabeled(Detection(np.arange(len(pixels)), pixels), permutation)
        found = ordered(target, turned.point_ids[::-1], turned.pixels[::-1])
        assert found.point_ids.tolist() == list(range(len(pixels)))
        np.testing.assert_array_equal(found.pixels, pixels)
        assert x_axis(target, found)[0] > 0
