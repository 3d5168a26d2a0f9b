"""What the core takes and gives for a solve."""

import numpy as np
import pytest

from handeye import _core
from handeye.benchmarks.problems import SIGMA_PX, Cell, make_cell
from handeye.errors import DegenerateError, InputError

VIEWS, POINTS = 5, 16


def cell() -> Cell:
    return make_cell("brown_conrady_5", VIEWS, POINTS, seed=3)


def test_covariance_is_the_inverse_of_the_information() -> None:
    solution = cell().problem().solve(cell().X_start, cell().Y_start, cell().model())
    scale = np.sqrt(np.diagonal(solution.covariance))
    expected = _core.Belief(solution.information).covariance
    assert np.abs((solution.covariance - expected) / np.outer(scale, scale)).max() < 1e-12
    product = solution.information @ solution.covariance * np.outer(1 / scale, scale)
    assert np.abs(product - np.eye(12)).max() < 1e-6


def test_a_singular_information_has_no_covariance() -> None:
    given = cell()
    still = _core.Problem(
        given.lens,
        given.parameters,
        np.tile(given.points, (3, 1)),
        np.zeros(3 * POINTS),
        np.tile(given.pixels[0], (3, 1)),
        [0, POINTS, 2 * POINTS, 3 * POINTS],
        np.repeat(given.motions[:1], 3, axis=0),
    )
    solution = still.solve(given.X, given.Y, _core.Model([SIGMA_PX] * 3), max_iterations=0)
    assert solution.ending == "degenerate"
    with pytest.raises(DegenerateError):
        _ = solution.covariance


@pytest.mark.parametrize("dtype", [list, np.int64, np.int32, np.uint8])
def test_offsets_may_be_any_whole_numbers(dtype: type) -> None:
    given = cell()
    points = np.tile(given.points, (VIEWS, 1))
    flat = (given.lens, given.parameters, points, np.zeros(len(points)), given.pixels.reshape(-1, 2))
    offsets = list(range(0, VIEWS * POINTS + 1, POINTS))
    chosen = offsets if dtype is list else np.array(offsets, dtype=dtype)
    problem = _core.Problem(*flat, chosen, given.motions)
    assert problem.squared_error(given.X, given.Y) == given.problem().squared_error(given.X, given.Y)
    negative = np.array(offsets)
    negative[1] = -1
    with pytest.raises((InputError, OverflowError)):
        _core.Problem(*flat, negative, given.motions)


def test_arrays_of_any_layout_and_type_are_taken() -> None:
    given = cell()
    expected = given.problem().squared_error(given.X, given.Y)
    wide = np.zeros((4, 8))
    wide[:, ::2] = given.X
    packed = np.zeros(1, dtype=[("flag", "u1"), ("pose", "f8", (4, 4))])
    packed["pose"] = given.X
    for X in (np.asfortranarray(given.X), wide[:, ::2], given.X.tolist(), packed["pose"][0]):
        assert given.problem().squared_error(X, given.Y) == expected
    single = given.problem().squared_error(given.X.astype(np.float32), given.Y)
    assert single == pytest.approx(expected, rel=1e-2)
