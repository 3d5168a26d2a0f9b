"""Gains through the binding: the same for every layout of the array, number of threads and vector unit."""

import numpy as np
import pytest
from numpy.typing import NDArray

from handeye import _core
from handeye.errors import InputError

Array = NDArray[np.float64]
LENSES = {
    "pinhole": [1400.0, 1380.0, 640.0, 512.0],
    "brown_conrady_5": [1400.0, 1400.0, 640.0, 512.0, -0.1, 0.05, 1e-3, -5e-4, 0.01],
}
POINTS = np.column_stack([np.mgrid[0:4, 0:5].reshape(2, -1).T * 0.03, np.zeros(20)])


def motions(count: int) -> Array:
    random = np.random.default_rng(3)
    poses = _core.se3_exp(random.uniform(-0.4, 0.4, (count, 6)) * [1, 1, 1, 1, 1, 3])
    poses[:, 2, 3] += 0.9
    return poses


def gains(lens: str, at: object, **how: object) -> Array:
    predictor = _core.Predictor(
        lens,
        LENSES[lens],
        POINTS,
        np.zeros(20),
        np.eye(4),
        np.eye(4),
        pixel_sigma=0.2,
        image_size=(1280, 1024),
    )
    information = predictor.informations(motions(12)).sum(axis=0) + np.diag([1e-2] * 12)
    return predictor.gains(_core.Belief(information), _core.Criterion("entropy"), at, **how)  # type: ignore[arg-type]


@pytest.mark.parametrize("lens", LENSES)
def test_layout_of_the_array_does_not_matter(lens: str) -> None:
    at = motions(50)
    expected = gains(lens, at)
    assert np.isfinite(expected).sum() > 10
    for same in (np.asfortranarray(at), np.repeat(at, 2, axis=0)[::2], at.tolist()):
        np.testing.assert_array_equal(gains(lens, same), expected)


@pytest.mark.parametrize("lens", LENSES)
def test_every_vector_unit_and_thread_count_agrees(lens: str) -> None:
    at = motions(3000)
    expected = gains(lens, at, vector_unit="portable", threads=1)
    for unit in ("avx2", "avx512"):
        try:
            found = gains(lens, at, vector_unit=unit, threads=1)
        except InputError:
            continue  # This machine lacks it.
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=0)
        np.testing.assert_array_equal(gains(lens, at, vector_unit=unit, threads=3), found)
    np.testing.assert_array_equal(np.isnan(gains(lens, at)), np.isnan(expected))
    assert np.isnan(expected).any()
    assert np.isfinite(expected).sum() > 500


@pytest.mark.parametrize("shape", [(50, 6), (50, 5, 3), (49, 6, 3)])
def test_an_arm_of_other_candidates_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="the arm of"):
        gains("pinhole", motions(50), arm=np.zeros(shape))


def test_an_arm_that_moves_nothing_changes_no_gain() -> None:
    at = motions(50)
    np.testing.assert_allclose(
        gains("pinhole", at, arm=np.zeros((50, 6, 3))), gains("pinhole", at), rtol=1e-10
    )
