"""The samples of MoveIt Calibration."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from cells import Cell
from handeye.datasets import PosePairs, load
from handeye.errors import InputError
from handeye.export import moveit_samples
from handeye.types import Pose, Recording, View


def recording(count: int) -> Recording:
    cell = Cell(np.random.default_rng(5))
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(count)])
    return Recording("cell", cell.mounting, cell.camera, cell.target, tuple(views))


def test_samples_are_what_the_chain_says() -> None:
    cell = Cell(np.random.default_rng(5))
    made = recording(4)
    samples = yaml.safe_load(moveit_samples(made))
    assert len(samples) == 4
    for sample, view in zip(samples, made.views, strict=True):
        assert sample.keys() == {"effector_wrt_world", "object_wrt_sensor"}
        effector, board = (Pose(np.reshape(sample[key], (4, 4))) for key in sample)
        np.testing.assert_allclose(effector.matrix, view.T_base_flange.matrix, atol=1e-14)
        expected = cell.X @ cell.mounting.chain(effector) @ cell.Y
        np.testing.assert_allclose(board.matrix, expected.matrix, atol=1e-8)


def test_no_usable_view_is_an_error() -> None:
    whole = recording(1)
    view = whole.views[0]
    few = View(view.name, view.T_base_flange, view.point_ids[:3], view.pixels[:3])
    with pytest.raises(InputError, match="no view"):
        moveit_samples(whole.with_views([few]))


def test_samples_are_read_back(tmp_path: Path) -> None:
    made = recording(6)
    path = tmp_path / "samples.yaml"
    path.write_text(moveit_samples(made))
    found = load(path)
    assert isinstance(found, PosePairs)
    for pair, view in zip(found.pairs, made.views, strict=True):
        assert np.abs(pair.T_base_flange.matrix - view.T_base_flange.matrix).max() < 1e-9
