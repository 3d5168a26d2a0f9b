"""The one thing that is wrong is the one that is named."""

import re

import numpy as np
import pytest

from cells import Cell
from handeye.estimation import AutoEstimator, Measurements
from handeye.types import Camera, Chessboard, Mounting, Pose, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Finding

VIEWS = 14


def measured(cell: Cell, *, base_sigma: float = 0.0, flange_sigma: float = 0.0) -> Measurements:
    views: list[View] = []
    for i in range(VIEWS):
        pose = cell.robot_pose(cell.look())
        base = Pose.exp(cell.random.normal(size=6) * base_sigma)
        flange = Pose.exp(cell.random.normal(size=6) * flange_sigma)
        views.append(cell.view(f"view_{i:02d}", pose, sigma_px=0.1, reported=base @ pose @ flange))
    deviations = np.array([0.5, 0.5, 0.5, 0.5, 1e-3, 1e-3, 1e-5, 1e-5, 1e-3])
    camera = Camera(cell.camera.lens, cell.camera.parameters, 1280, 1024, np.diag(deviations**2))
    return Measurements.of(cell.mounting, camera, cell.target, views)


def attribution(measurements: Measurements) -> Finding:
    finding = AutoEstimator()(measurements).attribution
    assert finding is not None
    return finding


def verdict(measurements: Measurements) -> str:
    return attribution(measurements).code


@pytest.mark.parametrize("mounting", list(Mounting))
class TestBlame:
    def test_nothing(self, mounting: Mounting) -> None:
        assert verdict(measured(Cell(np.random.default_rng(1), mounting))) == "blame_nothing"

    def test_the_robot_and_its_side(self, mounting: Mounting) -> None:
        cell = Cell(np.random.default_rng(2), mounting)
        assert verdict(measured(cell, base_sigma=1.5e-3)) == "blame_robot_base"
        assert verdict(measured(cell, flange_sigma=1.5e-3)) == "blame_robot_flange"

    def test_the_board(self, mounting: Mounting) -> None:
        cell = Cell(np.random.default_rng(3), mounting)
        measurements = measured(cell)
        wrong = Measurements.of(mounting, measurements.camera, Chessboard(7, 9, 0.0302), measurements.views)
        finding = attribution(wrong)
        assert finding.code == "blame_board_scale"
        assert re.search(r"0\.6[4-8] % smaller than stated", finding.sentence)

    def test_the_camera(self, mounting: Mounting) -> None:
        cell = Cell(np.random.default_rng(4), mounting)
        measurements = measured(cell)
        parameters = np.array(measurements.camera.parameters)
        parameters[:4] += [6.0, 6.0, -4.0, 3.0]
        camera = replace_parameters(measurements.camera, parameters)
        wrong = Measurements.of(mounting, camera, cell.target, measurements.views)
        finding = attribution(wrong)
        assert finding.code == "blame_camera"
        assert "fx -6" in finding.sentence or "fx -5" in finding.sentence

    @pytest.mark.parametrize("lag_s", [0.02, -0.03])
    def test_the_clocks(self, mounting: Mounting, lag_s: float) -> None:
        """The arm passes three places without stopping, and the images are taken later than the poses."""
        cell = Cell(np.random.default_rng(5), mounting)
        stations = [cell.robot_pose(cell.look()) for _ in range(4)]

        def passing(time_s: float) -> Pose:
            leg, share = int(time_s), time_s % 1
            start, end = stations[leg], stations[leg + 1]
            return start @ Pose.exp((start.inverse() @ end).log() * (3 * share**2 - 2 * share**3))

        views: list[View] = []
        for time_s in np.linspace(0.05, 2.9, 40).tolist():
            seen = cell.view(f"view_{time_s:.2f}", passing(time_s + lag_s), sigma_px=0.1)
            views.append(View(seen.name, passing(time_s), seen.point_ids, seen.pixels, timestamp_s=time_s))
        measurements = Measurements.of(mounting, cell.camera, cell.target, views)
        finding = attribution(measurements)
        assert finding.code == "blame_time_lag"
        assert ("later" if lag_s > 0 else "earlier") in finding.sentence
        found = re.search(r"([0-9.]+) ms", finding.sentence)
        assert found is not None
        assert float(found[1]) == pytest.approx(abs(lag_s) * 1e3, rel=0.1)


def replace_parameters(camera: Camera, parameters: FloatArray) -> Camera:
    return Camera(camera.lens, parameters, camera.width_px, camera.height_px, camera.covariance)
