"""The solver's problem as a factor graph in GTSAM: a factor per view, derivatives from NumPy."""

from collections.abc import Callable
from typing import Any

import numpy as np

from handeye.benchmarks.peers.availability import optional
from handeye.benchmarks.peers.chain import skew
from handeye.benchmarks.problems import SIGMA_PX, Cell
from handeye.benchmarks.stopping import COST_TOLERANCE, MOST_STEPS
from handeye.types.arrays import FloatArray

_X, _Y = 0, 1


def solver(cell: Cell) -> Callable[[], tuple[FloatArray, FloatArray]]:
    """Return what solves a cell with its covariance.

    Raises
    ------
    MissingPeerError
        GTSAM is not there.
    """
    gtsam = optional("gtsam")
    noise = gtsam.noiseModel.Isotropic.Sigma(2 * len(cell.points), SIGMA_PX)
    views = [_error(cell, view) for view in range(cell.views)]

    def solve() -> tuple[FloatArray, FloatArray]:
        graph = gtsam.NonlinearFactorGraph()
        for error in views:
            graph.add(gtsam.CustomFactor(noise, [_X, _Y], error))
        start = gtsam.Values()
        start.insert(_X, gtsam.Pose3(cell.X_start))
        start.insert(_Y, gtsam.Pose3(cell.Y_start))
        options = gtsam.LevenbergMarquardtParams()
        options.setRelativeErrorTol(COST_TOLERANCE)
        options.setMaxIterations(MOST_STEPS)
        found = gtsam.LevenbergMarquardtOptimizer(graph, start, options).optimize()
        gtsam.Marginals(graph, found).jointMarginalCovariance([_X, _Y]).fullMatrix()
        return found.atPose3(_X).matrix(), found.atPose3(_Y).matrix()

    return solve


def _error(cell: Cell, view: int) -> Callable[[Any, Any, Any], FloatArray]:
    """Return the residuals (2 P,) of a view; GTSAM turns poses on the right, rotation first."""
    motion, measured = cell.motions[view], cell.pixels[view]
    fx, fy, cx, cy = cell.parameters[:4]

    def error(_: object, values: Any, jacobians: Any) -> FloatArray:  # noqa: ANN401 - GTSAM is not typed
        X, Y = values.atPose3(_X).matrix(), values.atPose3(_Y).matrix()
        q = (cell.points @ Y[:3, :3].T + Y[:3, 3]) @ motion[:3, :3].T + motion[:3, 3]
        p = q @ X[:3, :3].T + X[:3, 3]
        z = p[:, 2]
        if jacobians is not None:
            G = np.zeros((len(p), 2, 3))
            G[:, 0, 0], G[:, 1, 1] = fx / z, fy / z
            G[:, 0, 2], G[:, 1, 2] = -fx * p[:, 0] / z**2, -fy * p[:, 1] / z**2
            by_X = G @ X[:3, :3]
            by_Y = by_X @ motion[:3, :3] @ Y[:3, :3]
            jacobians[0] = np.concatenate([-by_X @ skew(q), by_X], axis=2).reshape(-1, 6)
            jacobians[1] = np.concatenate([-by_Y @ skew(cell.points), by_Y], axis=2).reshape(-1, 6)
        uv = np.column_stack([fx * p[:, 0] / z + cx, fy * p[:, 1] / z + cy])
        residual: FloatArray = (uv - measured).ravel()
        return residual

    return error
