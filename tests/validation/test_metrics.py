"""The metrics against their formulas, worked out by hand where that is possible."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from handeye.errors import DegenerateError, InputError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Mounting, Pose, Recording
from handeye.types.calibration import ModelName
from handeye.validation import metrics

QUIET = CellOptions(views=(6, 6), pixel_sigma_px=(1e-6, 1e-6))


def cell(
    mounting: Mounting = Mounting.EYE_IN_HAND, number: int = 0
) -> tuple[Recording, Measurements, Estimate]:
    """A cell without noise to speak of, and its estimate."""
    recording = simulate(ErrorKind.PIXEL_ONLY, number, replace(QUIET, mounting=mounting))
    measurements = Measurements.of_recording(recording)
    return recording, measurements, make_estimator(ModelName.PAPER)(measurements)


def moved(estimate: Estimate, xi_x: list[float], xi_y: list[float] | None = None) -> Estimate:
    return replace(estimate, X=Pose.exp(xi_x) @ estimate.X, Y=Pose.exp(xi_y or [0.0] * 6) @ estimate.Y)


def test_deviation_is_norm_and_angle() -> None:
    found = metrics.deviation(Pose.exp([0.003, 0, 0.004, 0, 0, 0]) @ Pose.exp([0, 0, 0, 0, 0.01, 0]))
    assert found.translation_mm == pytest.approx(5)
    assert found.rotation_deg == pytest.approx(np.rad2deg(0.01))


def test_absolute_error_is_in_the_frame_of_the_flange() -> None:
    # inv(X) X_true: a camera that is really 1 mm further along the flange's x axis.
    X = Pose.exp([0.1, 0.2, 0.3, 1.0, -0.5, 0.3])
    X_true = X @ Pose.exp([-0.001, 0, 0, 0, 0, 0])
    found = metrics.absolute_error(X, X_true)
    assert (found.translation_mm, found.rotation_deg) == pytest.approx((1.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("mounting", Mounting)
def test_a_true_answer_has_no_error_on_held_out_views(mounting: Mounting) -> None:
    recording, measurements, estimate = cell(mounting)
    assert recording.truth is not None
    assert recording.truth.X is not None
    for found in (
        metrics.relative_error(estimate, measurements),
        metrics.relative_error_at_target(estimate, measurements),
        metrics.absolute_error(estimate.X, recording.truth.X),
    ):
        assert found.translation_mm < 1e-2
        assert found.rotation_deg < 1e-3
    assert metrics.held_out_rmse_px(estimate, measurements) < 1e-2


def test_rmse_follows_the_formula() -> None:
    _, measurements, estimate = cell()
    off = moved(estimate, [0.002, 0, 0, 0, 0.001, 0])
    held_out = measurements.select([1, 3, 4])
    total = 0.0
    for view in held_out.views:
        T = off.X @ held_out.mounting.chain(view.T_base_flange) @ off.Y
        pixels, _ = off.camera.project(T.act(held_out.target.points[view.point_ids]))
        total += np.mean(np.sum((view.pixels - pixels) ** 2, axis=1))
    assert metrics.held_out_rmse_px(off, held_out) == pytest.approx(np.sqrt(total / 2), rel=1e-9)
    with pytest.raises(InputError, match="at least 2"):
        metrics.held_out_rmse_px(off, measurements.select([0]))


def test_relative_errors_follow_the_formula_in_either_frame() -> None:
    _, measurements, estimate = cell()
    off = moved(estimate, [0.002, 0, 0, 0, 0.003, 0], [0, 0.001, 0, 0, 0, 0])
    at_base: list[Pose] = []
    at_target: list[Pose] = []
    for view, pose in zip(measurements.views, measurements.poses, strict=True):
        A = measurements.mounting.chain(view.T_base_flange)
        C = pose.T_camera_target
        at_base.append(off.Y @ C.inverse() @ off.X @ A)
        at_target.append(C.inverse() @ off.X @ A @ off.Y)
    for found, poses in (
        (metrics.relative_error(off, measurements), at_base),
        (metrics.relative_error_at_target(off, measurements), at_target),
    ):
        each = [metrics.deviation(pose) for pose in poses]
        assert found.translation_mm == pytest.approx(np.mean([d.translation_mm for d in each]))
        assert found.rotation_deg == pytest.approx(np.mean([d.rotation_deg for d in each]))
    with pytest.raises(InputError, match="no held-out views"):
        metrics.relative_error(off, measurements.select([]))


def test_nees_is_chi_square_under_a_true_covariance() -> None:
    random = np.random.default_rng(1)
    root = np.diag([1e-3, 2e-3, 3e-3, 1e-4, 2e-4, 3e-4]) @ random.normal(size=(6, 6))
    X = Pose.exp([0.1, 0, 0.3, 0.5, 0.2, -1])
    values = [
        metrics.nees(X, root @ root.T, Pose.exp(root @ random.standard_normal(6)) @ X) for _ in range(2000)
    ]
    assert np.mean(values) == pytest.approx(6, rel=0.05)
    assert np.mean([metrics.region_holds(value) for value in values]) == pytest.approx(0.95, abs=0.015)
    with pytest.raises(DegenerateError):
        metrics.nees(X, np.ones((6, 6)), X)


def test_the_region_is_wider_where_the_noise_is_less_known() -> None:
    for degrees in (5.0, 20.0):
        edge = 6 * stats.f.ppf(0.95, 6, degrees)
        assert metrics.region_holds(edge * 0.999, degrees)
        assert not metrics.region_holds(edge * 1.001, degrees)
    assert not metrics.region_holds(stats.chi2.ppf(0.95, 6) * 1.001)


def test_halves_of_one_truth_differ_by_their_errors() -> None:
    _, _, estimate = cell()
    other = moved(estimate, [0, 0, 0.001, 0, 0, 0])
    assert metrics.split_half_difference(estimate, estimate).translation_mm == pytest.approx(0, abs=1e-9)
    assert metrics.split_half_difference(estimate, other).translation_mm == pytest.approx(1)
    expected = metrics.nees(estimate.X, 2 * estimate.hand_eye_covariance, other.X)
    assert metrics.split_half_nees(estimate, other) == pytest.approx(expected)
