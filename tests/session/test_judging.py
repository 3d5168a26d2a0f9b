"""Where the next view should show the target, as far as the views so far tell."""

from dataclasses import replace

import numpy as np
import pytest

from cells import Cell
from handeye.estimation import Measurements, make_estimator
from handeye.session.judging import LEAST_MARGIN_PX, all_agree, foreseen
from handeye.types import Pose
from handeye.types.calibration import ModelName


def test_the_target_is_foreseen_within_the_margin() -> None:
    cell = Cell(np.random.default_rng(4))
    poses = [cell.robot_pose(cell.look()) for _ in range(9)]
    views = cell.views(poses[:8], sigma_px=0.1, robot_sigma=np.array([2e-4] * 3 + [2e-4] * 3))
    measurements = Measurements.of(cell.mounting, cell.camera, cell.target).with_views(views)
    estimate = make_estimator(ModelName.AUTO, None)(measurements)
    assert foreseen(cell.camera, cell.target, None, poses[8]) is None
    predicted = foreseen(cell.camera, cell.target, estimate, poses[8])
    assert predicted is not None
    off = np.linalg.norm(predicted.pixels - cell.view("next", poses[8]).pixels, axis=1)
    assert off.max() < predicted.margin_px
    assert LEAST_MARGIN_PX <= predicted.margin_px < 100


@pytest.mark.parametrize("seed", [0, 1, 3])
@pytest.mark.parametrize("off", [[0.004, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0.02], [0.02, 0.01, 0, 0, 0.05, 0]])
def test_a_view_that_is_elsewhere_stands_out(seed: int, off: list[float]) -> None:
    cell = Cell(np.random.default_rng(seed))
    poses = [cell.robot_pose(cell.look()) for _ in range(8)]
    views = cell.views(poses, sigma_px=0.1, robot_sigma=np.array([2e-4] * 3 + [2e-4] * 3))
    estimator = make_estimator(ModelName.AUTO, None)
    good = Measurements.of(cell.mounting, cell.camera, cell.target, views)
    assert all_agree(good, estimator(good))
    views[4] = replace(views[4], T_base_flange=views[4].T_base_flange @ Pose.exp(off))
    bad = Measurements.of(cell.mounting, cell.camera, cell.target, views)
    assert not all_agree(bad, estimator(bad))
