"""What limits the accuracy: the shares follow what was done to the data."""

import numpy as np
import pytest

from cells import Cell
from handeye.estimation import AutoEstimator, Measurements
from handeye.estimation.auto import AutoOptions
from handeye.planning.limits import limits
from handeye.types import Mounting, Recording, View


def measured(mounting: Mounting, sigma_px: float, robot: float, count: int = 12) -> Measurements:
    cell = Cell(np.random.default_rng(5), mounting)
    noise = np.array([robot] * 3 + [robot] * 3)
    views = cell.views(
        [cell.robot_pose(cell.look()) for _ in range(count)], sigma_px=sigma_px, robot_sigma=noise
    )
    return of_views(cell, views)


def of_views(cell: Cell, views: list[View]) -> Measurements:
    return Measurements.of_recording(Recording("cell", cell.mounting, cell.camera, cell.target, tuple(views)))


@pytest.mark.parametrize("mounting", list(Mounting))
def test_noise_of_the_robot_limits_where_there_is_much(mounting: Mounting) -> None:
    views = measured(mounting, 0.02, 2e-3)
    found = limits(AutoEstimator()(views), views)
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["robot"] + found["robot_smooth"] > 0.8
    assert found["pixels"] < 0.1


@pytest.mark.parametrize("mounting", list(Mounting))
def test_pictures_limit_more_where_the_robot_is_exact(mounting: Mounting) -> None:
    # That the robot is exact is not known, so a part of what is left open is still put down to it.
    options = AutoOptions(camera_fixed=True)
    found = [
        limits(AutoEstimator(options)(views), views)
        for views in (measured(mounting, 0.5, robot, 40) for robot in (0.0, 1e-3))
    ]
    assert found[0]["pixels"] > 0.3
    assert found[0]["pixels"] > 5 * found[1]["pixels"]
    assert [shares["camera"] for shares in found] == [0.0, 0.0]
    assert all(share >= 0.0 for shares in found for share in shares.values())


def test_a_camera_that_is_not_known_has_a_share() -> None:
    views = measured(Mounting.EYE_IN_HAND, 0.5, 0.0)
    free = limits(AutoEstimator()(views), views)
    assert free["camera"] > 0.05


def test_nothing_is_said_while_something_is_open() -> None:
    cell = Cell(np.random.default_rng(3))
    first = cell.robot_pose(cell.look())
    about_one_axis = [cell.turned(first, np.array([0.0, 0.0, angle])) for angle in (0.0, 0.2, 0.4, 0.6)]
    views = of_views(
        cell, [cell.view(f"view_{i}", pose, sigma_px=0.05) for i, pose in enumerate(about_one_axis)]
    )
    assert limits(AutoEstimator()(views), views) == {}
