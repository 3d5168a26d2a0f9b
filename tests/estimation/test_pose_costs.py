"""Costs on poses: truth without noise in both mountings, minima that no neighbour beats, refusals."""

import numpy as np
import pytest
from numpy.typing import NDArray

from handeye import _core
from handeye.errors import DegenerateError, InputError
from handeye.estimation.pose_costs import POSE_COSTS, PoseViews, optimise

Array = NDArray[np.float64]
BOARD = np.array([[0.025 * i, 0.025 * j, 0.0] for i in range(8) for j in range(11)])


def transforms(random: np.random.Generator, count: int, metres: float, radians: float) -> Array:
    """Return transforms (count, 4, 4) with components of their twists up to these."""
    twists = random.uniform(-1, 1, (count, 6)) * np.repeat([metres, radians], 3)
    return _core.se3_exp(twists)


def cell(seed: int, views: int, in_hand: bool, noise: float = 0.0) -> tuple[Array, Array, PoseViews]:
    """X, Y and what is seen of them, built from the frames of a mounting."""
    random = np.random.default_rng(seed)
    T_base_flange = transforms(random, views, 0.5, 1.2)
    if in_hand:
        T_flange_camera, Y = transforms(random, 2, 0.2, 1.5)
        X, A = np.linalg.inv(T_flange_camera), np.linalg.inv(T_base_flange)
    else:
        T_base_camera, Y = transforms(random, 2, 1.0, 1.5)
        X, A = np.linalg.inv(T_base_camera), T_base_flange
    C = transforms(random, views, noise, 2 * noise) @ (X @ A @ Y)
    return X, Y, PoseViews(A, C, BOARD)


@pytest.mark.parametrize("in_hand", [True, False])
@pytest.mark.parametrize("name", POSE_COSTS)
def test_truth_without_noise_from_a_start_that_is_off(name: str, in_hand: bool) -> None:
    for seed, views in enumerate([4, 8, 15]):
        X, Y, seen = cell(seed, views, in_hand)
        off = transforms(np.random.default_rng(seed), 2, 0.02, 0.05)
        found = optimise(POSE_COSTS[name], seen, (off[0] @ X, off[1] @ Y))
        np.testing.assert_allclose(found[0], X, atol=1e-9)
        np.testing.assert_allclose(found[1], Y, atol=1e-9)


@pytest.mark.parametrize("name", POSE_COSTS)
def test_noise_moves_the_answer_by_about_as_much(name: str) -> None:
    errors: list[float] = []
    for seed in range(10):
        X, _, seen = cell(seed, 12, True, noise=1e-3)
        found = optimise(POSE_COSTS[name], seen, _core.closed_form("shah", seen.A, seen.C))
        errors.append(float(np.abs(found[0] - X).max()))
    assert 1e-5 < np.median(errors) < 3e-3


@pytest.mark.parametrize("name", [name for name, cost in POSE_COSTS.items() if cost.weights is None])
def test_no_neighbour_of_the_answer_costs_less(name: str) -> None:
    cost = POSE_COSTS[name]
    _, _, seen = cell(3, 10, True, noise=1e-3)
    X, Y = optimise(cost, seen, _core.closed_form("shah", seen.A, seen.C))

    def total(X: Array, Y: Array) -> float:
        return float(np.sum(cost.residuals(X[None, None], Y[None, None], seen) ** 2))

    best = total(X, Y)
    for step in transforms(np.random.default_rng(1), 40, 1e-4, 1e-4).reshape(-1, 2, 4, 4):
        assert total(step[0] @ X, step[1] @ Y) > best


def test_soft_l1_is_not_moved_by_a_view_that_is_far_off() -> None:
    X, _, seen = cell(5, 15, True, noise=2e-4)
    C = seen.C.copy()
    C[4] = transforms(np.random.default_rng(2), 1, 0.05, 0.1)[0] @ C[4]
    start = _core.closed_form("shah", seen.A, C)
    errors = {
        name: float(np.abs(optimise(POSE_COSTS[name], PoseViews(seen.A, C, BOARD), start)[0] - X).max())
        for name in ("soft_l1", "tabb_ahmad_yousef_1")
    }
    assert errors["soft_l1"] < 0.2 * errors["tabb_ahmad_yousef_1"]


@pytest.mark.parametrize("name", POSE_COSTS)
def test_what_views_do_not_determine_is_refused(name: str) -> None:
    X, Y, seen = cell(7, 6, True)
    A = np.repeat(np.eye(4)[None], 6, axis=0)
    A[:, :3, 3] = np.random.default_rng(0).uniform(-0.3, 0.3, (6, 3))
    with pytest.raises(DegenerateError, match=name):
        optimise(POSE_COSTS[name], PoseViews(A, X @ A @ Y, BOARD), (X, Y))
    with pytest.raises(InputError, match="2 views"):
        optimise(POSE_COSTS[name], PoseViews(seen.A[:2], seen.C[:2], BOARD), (X, Y))
