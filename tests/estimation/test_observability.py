"""What the views leave open is refused or reduced, with the right direction named."""

import numpy as np
import pytest

from cells import Cell
from handeye.errors import DegenerateError
from handeye.estimation import Measurements, calibrate, calibrate_examined
from handeye.estimation.faults import Examination
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Calibration, ModelName

CASES = 50  # per kind, mounting and model: 200 of each kind
PIXEL = 0.1
ROBOT = np.array([2e-4] * 3 + [2e-4] * 3)


def unit(vector: FloatArray) -> FloatArray:
    return vector / np.linalg.norm(vector)


def parallel(cell: Cell, views: int) -> tuple[list[Pose], FloatArray]:
    """Return poses that all turn about one axis of the flange, and that axis."""
    axis = unit(cell.random.normal(size=3))
    first = cell.robot_pose(cell.look(0.3))
    angles = np.linspace(-0.35, 0.35, views)
    return [cell.turned(first, axis * angle) for angle in angles], axis


def measured(cell: Cell, poses: list[Pose], *, exact: bool) -> Measurements:
    views = cell.views(poses, sigma_px=PIXEL, robot_sigma=None if exact else ROBOT)
    return Measurements.of(cell.mounting, cell.camera, cell.target, views)


def estimated(measurements: Measurements, model: ModelName, *, reduced: bool = False) -> Calibration:
    """Calibrate without looking for mistakes, which is tested elsewhere and takes most of the time."""
    return calibrate_examined(Examination(measurements), model, reduced=reduced)


@pytest.mark.parametrize("model", list(ModelName))
@pytest.mark.parametrize("mounting", list(Mounting))
class TestDegenerate:
    def test_parallel_axes_are_named(self, model: ModelName, mounting: Mounting) -> None:
        for seed in range(CASES):
            cell = Cell(np.random.default_rng([1, seed]), mounting)
            poses, axis = parallel(cell, 5 + seed % 6)
            measurements = measured(cell, poses, exact=model is ModelName.PAPER)
            with pytest.raises(DegenerateError, match="position of the camera along") as caught:
                estimated(measurements, model)
            assert caught.value.hint is not None
            assert "about an axis across it" in caught.value.hint
            reduced = estimated(measurements, model, reduced=True)
            assert len(reduced.unobservable) == 1, seed
            direction = np.array(reduced.unobservable[0].direction)
            own = reduced.X.rotation.T @ direction[:3]
            known = axis if mounting is Mounting.EYE_IN_HAND else poses[0].rotation @ axis
            assert abs(unit(own) @ known) > np.cos(np.deg2rad(3)), seed

    def test_pure_translation_is_named(self, model: ModelName, mounting: Mounting) -> None:
        for seed in range(CASES):
            cell = Cell(np.random.default_rng([2, seed]), mounting)
            first = cell.robot_pose(cell.look(0.5))
            poses = [cell.turned(first, np.zeros(3)) for _ in range(4 + seed % 6)]
            measurements = measured(cell, poses, exact=model is ModelName.PAPER)
            with pytest.raises(DegenerateError, match="not determined in any direction") as caught:
                estimated(measurements, model)
            assert "translation only" in str(caught.value.hint)

    def test_views_all_alike_are_named(self, model: ModelName, mounting: Mounting) -> None:
        for seed in range(CASES):
            cell = Cell(np.random.default_rng([3, seed]), mounting)
            pose = cell.robot_pose(cell.look(0.5))
            measurements = measured(cell, [pose] * (3 + seed % 6), exact=model is ModelName.PAPER)
            with pytest.raises(DegenerateError, match="not determined at all") as caught:
                estimated(measurements, model)
            assert "all alike" in str(caught.value.hint)

    def test_four_axes_calibrate_the_rest(self, model: ModelName, mounting: Mounting) -> None:
        """The flange stays upright: only the height is open, and everything else comes out right."""
        for seed in range(CASES):
            cell = Cell(np.random.default_rng([4, seed]), mounting)
            upright = Pose.exp([0, 0, 0, *(cell.random.uniform(-0.2, 0.2, 2)), cell.random.uniform(-3, 3)])
            cell.X = upright @ Pose.exp([*cell.random.uniform(-0.1, 0.1, 3), 0, 0, 0])
            cell.Y = Pose.exp([0.4, 0.1, 0.8, 0, 0, 0]) @ Pose.exp([0, 0, 0, 0.1, -0.2, 1])
            first = cell.robot_pose(cell.aimed(cell.X.rotation @ cell.Y.rotation))
            turns = np.linspace(-1.5, 1.5, 8)
            poses = [cell.turned(first, np.array([0, 0, angle])) for angle in turns]
            measurements = measured(cell, poses, exact=model is ModelName.PAPER)
            reduced = estimated(measurements, model, reduced=True)
            assert len(reduced.unobservable) == 1, seed
            frame = "flange" if mounting is Mounting.EYE_IN_HAND else "base"
            assert f"along the z axis of the {frame}" in reduced.unobservable[0].sentence, seed
            error = (reduced.X @ cell.X.inverse()).log()
            height = reduced.X.rotation @ np.array([0, 0, 1])
            keep = np.eye(6)
            keep[:3, :3] -= np.outer(height, height)
            known = np.linalg.svd(keep)[2][:5]
            covariance = known @ reduced.covariance @ known.T
            assert np.sqrt(np.trace(covariance)) < 0.05, seed
            distance = (known @ error) @ np.linalg.solve(covariance, known @ error)
            # Noise levels from eight views are themselves uncertain: the tail is that of F, not chi-square.
            assert distance < 150, seed
            assert reduced.sigma_translation_m > 0.1  # The height is open, and the covariance says so.


def test_legitimate_small_sets_are_not_refused() -> None:
    for seed in range(100):
        cell = Cell(np.random.default_rng([5, seed]))
        poses = [cell.robot_pose(cell.look(0.4, 0.8)) for _ in range(4)]
        calibration = calibrate(measured(cell, poses, exact=False))
        assert not calibration.unobservable
