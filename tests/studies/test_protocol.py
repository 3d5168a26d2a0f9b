"""Starts are shared, seeded, determine the answer, and keep off what is held out."""

import numpy as np
import pytest

from handeye.errors import DegenerateError, InputError
from handeye.studies.protocol import (
    Protocol,
    contiguous_halves,
    draw_trials,
    random_halves,
    second_turn_rad,
)
from handeye.types import Camera, Chessboard, Mounting, Pose, Recording, View

TARGET = Chessboard(2, 2, 0.1)


def recording(rotations: list[list[float]], name: str = "made up") -> Recording:
    """Views with these rotation vectors of the flange."""
    pixels = [[1.0, 1.0], [2.0, 1.0], [1.0, 2.0], [2.0, 2.0]]
    views = tuple(
        View(f"view_{k}", Pose.exp([0.1 * k, 0, 0, *rotation]), range(4), pixels)
        for k, rotation in enumerate(rotations)
    )
    camera = Camera("pinhole", [100, 100, 50, 50], 100, 100)
    return Recording(name, Mounting.EYE_IN_HAND, camera, TARGET, views)


def mixed(count: int = 12) -> Recording:
    """Most views with one orientation, four with others, as in public sets."""
    turned = [[0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.3], [0.2, 0.2, 0]]
    return recording([[0.0, 0.0, 0.0]] * (count - 4) + turned)


def test_trials_are_the_same_for_the_same_seed_and_differ_otherwise() -> None:
    first = draw_trials(mixed(), Protocol(trials=20, seed=3))
    assert first == draw_trials(mixed(), Protocol(trials=20, seed=3))
    assert first[:5] == draw_trials(mixed(), Protocol(trials=5, seed=3))
    assert first != draw_trials(mixed(), Protocol(trials=20, seed=4))
    assert len({trial.start for trial in first}) > 5
    assert len({trial.seed for trial in first}) == 20


@pytest.mark.parametrize("share", [0.0, 1 / 3])
def test_start_pool_and_held_out_are_all_views_once(share: float) -> None:
    data = mixed(15)
    for trial in draw_trials(data, Protocol(trials=10, held_out_share=share)):
        assert len(trial.start) == 3
        assert len(trial.held_out) == int(15 * share)
        assert sorted([*trial.start, *trial.pool, *trial.held_out]) == list(range(15))


def test_every_start_turns_about_two_axes() -> None:
    data = mixed()
    poses = np.array([view.T_base_flange.matrix for view in data.views])
    for trial in draw_trials(data, Protocol(trials=30, held_out_share=1 / 3)):
        assert second_turn_rad(poses[list(trial.start)]) > np.deg2rad(5)


def test_turns_about_one_axis_count_as_none() -> None:
    one_axis = np.array([Pose.exp([0, 0, 0, 0, 0, angle]).matrix for angle in (0.0, 0.4, -0.7)])
    assert second_turn_rad(one_axis) < 1e-9
    two_axes = np.array([Pose.exp([0, 0, 0, *v]).matrix for v in ([0, 0, 0], [0.3, 0, 0], [0, 0.3, 0])])
    assert second_turn_rad(two_axes) > 0.2


def test_sets_without_a_start_are_refused() -> None:
    turning = [[0.0, 0.0, 0.1 * k] for k in range(10)]
    with pytest.raises(DegenerateError, match="no 3 views turn about two axes"):
        draw_trials(recording(turning), Protocol(trials=1))
    with pytest.raises(InputError, match="too few"):
        draw_trials(mixed(7), Protocol(trials=1))


@pytest.mark.parametrize(
    "values", [{"trials": 0}, {"start_views": 2}, {"added_views": -1}, {"seed": -1}, {"held_out_share": 1.0}]
)
def test_impossible_protocols_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(InputError):
        Protocol(**values)  # pyright: ignore[reportArgumentType]


def test_halves_are_disjoint_and_complete() -> None:
    data = mixed(13)
    halves = [random_halves(data, 0, number) for number in range(10)]
    for first, second in [*halves, contiguous_halves(data)]:
        assert sorted([*first, *second]) == list(range(13))
        assert abs(len(first) - len(second)) <= 1
    assert len(set(halves)) == 10
    assert halves[0] == random_halves(data, 0, 0)
    assert contiguous_halves(data)[0] == (0, 1, 2, 3, 4, 5)
