"""The paper's model: truth on exact data, SciPy's optimum on noisy data, honest endings."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from cells import Cell
from handeye import _core
from handeye.errors import HandeyeError, InputError
from handeye.estimation import Measurements, paper_estimate
from handeye.types import CircleGrid, Mounting, Pose, View
from handeye.types.arrays import FloatArray


def measured(cell: Cell, count: int, sigma_px: float) -> Measurements:
    poses = [cell.robot_pose(cell.look()) for _ in range(count)]
    return Measurements.of(cell.mounting, cell.camera, cell.target, cell.views(poses, sigma_px=sigma_px))


def off(random: np.random.Generator, pose: Pose, degrees: float, metres: float) -> Pose:
    axis, shift = random.normal(size=3), random.normal(size=3)
    turn = axis / np.linalg.norm(axis) * np.deg2rad(degrees)
    matrix = np.array(pose.matrix)
    matrix[:3, :3] = Pose.exp([0, 0, 0, *turn]).rotation @ matrix[:3, :3]
    matrix[:3, 3] += shift / np.linalg.norm(shift) * metres
    return Pose(matrix)


@pytest.mark.parametrize("mounting", list(Mounting))
def test_exact_data_give_the_truth(mounting: Mounting) -> None:
    for seed in range(10):
        cell = Cell(np.random.default_rng([1, seed]), mounting)
        estimate = paper_estimate(measured(cell, 5, 0.0))
        assert np.abs(estimate.X.matrix - cell.X.matrix).max() < 1e-8
        assert np.abs(estimate.Y.matrix - cell.Y.matrix).max() < 1e-8


def test_the_optimum_is_scipys() -> None:
    for seed in range(5):
        cell = Cell(np.random.default_rng([2, seed]))
        measurements = measured(cell, 6, 0.3)
        model = _core.Model(np.full(6, 1.0))
        ours = measurements.problem.solve(
            off(cell.random, cell.X, 2, 0.01).matrix, off(cell.random, cell.Y, 2, 0.01).matrix, model
        )
        assert ours.is_converged

        def residual(
            xi: FloatArray, measurements: Measurements = measurements, cell: Cell = cell
        ) -> FloatArray:
            poses = Pose.exp(xi[:6]).matrix @ cell.X.matrix @ measurements.motions
            poses = poses @ Pose.exp(xi[6:]).matrix @ cell.Y.matrix
            rows: list[FloatArray] = []
            for pose, view in zip(poses, measurements.views, strict=True):
                pixels, _ = _core.project_features(
                    cell.camera.lens, cell.camera.parameters, pose, cell.target.points, cell.target.radii_m
                )
                rows.append((pixels - view.pixels).ravel())
            return np.concatenate(rows)

        theirs = least_squares(residual, np.zeros(12), method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14)
        assert ours.cost == pytest.approx(2 * theirs.cost, rel=1e-8)
        assert ours.cost <= 2 * theirs.cost * (1 + 1e-10)


def test_truth_from_far_starts() -> None:
    """Starts off by 20 degrees and 100 mm arrive, or say that the target is out of sight there."""
    arrived = 0
    for seed in range(20):
        cell = Cell(np.random.default_rng([3, seed]))
        measurements = measured(cell, 6, 0.0)
        X, Y = off(cell.random, cell.X, 20, 0.1), off(cell.random, cell.Y, 20, 0.1)
        try:
            solution = measurements.problem.solve(X.matrix, Y.matrix, _core.Model(np.full(6, 0.2)))
        except HandeyeError as error:
            assert "out of the camera's sight" in error.message
            continue
        assert solution.is_converged
        assert np.abs(solution.x - cell.X.matrix).max() < 1e-8
        arrived += 1
    assert arrived >= 12


def test_circles_are_solved_by_their_centroids() -> None:
    cell = Cell(np.random.default_rng(4), target=CircleGrid(5, 7, 0.04, 0.03))
    estimate = paper_estimate(measured(cell, 5, 0.0))
    assert np.abs(estimate.X.matrix - cell.X.matrix).max() < 1e-8


def test_too_few_views_are_refused() -> None:
    cell = Cell(np.random.default_rng(5))
    with pytest.raises(InputError, match="2 usable views, at least 3"):
        paper_estimate(measured(cell, 2, 0.1))


def test_a_view_without_enough_points_is_left_out_and_named() -> None:
    cell = Cell(np.random.default_rng(6))
    good = measured(cell, 4, 0.1)
    few = good.views[0]
    more = good.with_views([View("few", few.T_base_flange, few.point_ids[:3], few.pixels[:3])])
    assert len(more) == 4
    assert "at least 4" in more.rejected["few"]


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["pixels", "poses", "both"]))
def test_garbage_never_gives_a_plausible_answer(seed: int, what: str) -> None:
    """Random pixels or poses end in an error or in a residual that shows that nothing fits."""
    cell = Cell(np.random.default_rng(seed))
    views: list[View] = []
    for view in measured(cell, 4, 0.1).views:
        pixels = cell.random.uniform(0, 1000, view.pixels.shape) if what != "poses" else view.pixels
        pose = view.T_base_flange if what == "pixels" else Cell(cell.random).X
        views.append(View(view.name, pose, view.point_ids, pixels))
    try:
        measurements = Measurements.of(cell.mounting, cell.camera, cell.target, views)
        estimate = paper_estimate(measurements)
    except HandeyeError:
        return
    error = measurements.problem.squared_error(estimate.X.matrix, estimate.Y.matrix)
    assert np.sqrt(error / np.sum(measurements.point_counts)) > 5
