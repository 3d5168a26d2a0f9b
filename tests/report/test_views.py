"""What a report says of each view."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from cells import Cell
from handeye.estimation import Measurements, calibrate
from handeye.report.views import robot_error, view_lines, view_picture
from handeye.types import Mounting, Pose, Recording
from handeye.types.calibration import Calibration, ModelName, Noise, RobotSide


def solved(
    mounting: Mounting, model: ModelName, robot_sigma: np.ndarray | None = None, *, count: int = 12
) -> tuple[Cell, list[Pose], Calibration, Measurements]:
    cell = Cell(np.random.default_rng(8), mounting)
    true = [cell.robot_pose(cell.look()) for _ in range(count)]
    views = cell.views(true, sigma_px=0.05, robot_sigma=robot_sigma)
    recording = Recording("cell", mounting, cell.camera, cell.target, tuple(views))
    measurements = Measurements.of_recording(recording)
    return cell, true, calibrate(measurements, model), measurements


@pytest.mark.parametrize("mounting", Mounting)
def test_residuals_are_those_of_the_answer(mounting: Mounting) -> None:
    _, _, calibration, measurements = solved(mounting, ModelName.PAPER)
    lines = view_lines(calibration, measurements)
    for line, view in zip(lines, measurements.views, strict=True):
        picture = view_picture(calibration, measurements, view)
        assert line.rmse_px == pytest.approx(picture.rmse_px, rel=1e-6)
        assert picture.rmse_px == pytest.approx(0.05 * np.sqrt(2), rel=0.4)
        assert line.own_rmse_px is not None
        assert line.own_rmse_px < 0.1
        assert line.robot_off_mm is None  # taken as exact
        assert line.used
        assert line.points == 63


@pytest.mark.parametrize("mounting", Mounting)
def test_errors_of_the_robot_are_told_per_view(mounting: Mounting) -> None:
    sigma = np.array([1e-3] * 3 + [1e-3] * 3)
    _, true, calibration, measurements = solved(mounting, ModelName.AUTO, sigma, count=24)
    lines = view_lines(calibration, measurements)
    told = np.array([[line.robot_off_mm, line.robot_off_deg] for line in lines], dtype=float)
    planted = []
    for pose, view in zip(true, measurements.views, strict=True):
        off = pose.inverse() @ view.T_base_flange
        planted.append([1000 * np.linalg.norm(off.translation), np.rad2deg(off.rotation_angle_rad)])
    # Each view's error is found but for what X and Y have taken up of it.
    assert np.median(np.abs(told - planted) / planted) < 0.5
    for column in range(2):
        assert np.corrcoef(told[:, column], np.array(planted)[:, column])[0, 1] > 0.6


def test_distance_and_tilt_are_those_of_the_scene() -> None:
    cell, true, calibration, measurements = solved(Mounting.EYE_IN_HAND, ModelName.PAPER)
    for line, pose in zip(view_lines(calibration, measurements), true, strict=True):
        board = cell.X @ cell.mounting.chain(pose) @ cell.Y
        middle = board.act(cell.target.points).mean(axis=0)
        assert line.distance_mm == pytest.approx(1000 * np.linalg.norm(middle), rel=1e-3)
        cosine = middle @ board.rotation[:, 2] / np.linalg.norm(middle)
        assert line.tilt_deg == pytest.approx(np.rad2deg(np.arccos(cosine)), abs=0.1)
        assert line.tilt_deg is not None
        assert line.tilt_deg < 90


@pytest.mark.parametrize("mounting", Mounting)
@pytest.mark.parametrize("side", [RobotSide.FLANGE, RobotSide.BASE])
def test_share_of_the_robot_is_the_most_probable(mounting: Mounting, side: RobotSide) -> None:
    """Against a numerical optimum, with an image so weak that it matters where the robot's error acts."""
    _, _, exact, measurements = solved(mounting, ModelName.PAPER)
    level_m, level_rad, sigma_px = 2e-4, 1e-4, 2.0
    noise = Noise((sigma_px,) * 12, side, level_m, level_rad)
    calibration = replace(exact, noise=noise)
    view, measured = measurements.views[0], measurements.poses[0]
    off = Pose.exp([6e-4, -4e-4, 8e-4, 3e-4, 5e-4, -2e-4])
    measured = replace(measured, T_camera_target=off @ measured.T_camera_target)
    A = mounting.chain(view.T_base_flange)
    # At the flange of a camera in the hand, and at the base of one beside the robot, the error is on the left.
    left = (side is RobotSide.FLANGE) == (mounting is Mounting.EYE_IN_HAND)
    levels = np.repeat([level_m, level_rad], 3)
    root = np.linalg.cholesky(measured.information).T / sigma_px

    def moved(error: np.ndarray) -> Pose:
        return Pose.exp(error) @ A if left else A @ Pose.exp(error)

    def misfit(scaled: np.ndarray) -> np.ndarray:
        predicted = calibration.X @ moved(scaled * levels) @ calibration.Y
        return np.concatenate([scaled, root @ (measured.T_camera_target @ predicted.inverse()).log()])

    best = moved(least_squares(misfit, np.zeros(6), xtol=1e-14, ftol=1e-14).x * levels)
    true = best.inverse() if mounting is Mounting.EYE_IN_HAND else best
    expected = true.inverse() @ view.T_base_flange
    found = robot_error(calibration, view, measured, sigma_px)
    assert found is not None
    np.testing.assert_allclose(found.log(), expected.log(), rtol=0.02, atol=1e-6)
