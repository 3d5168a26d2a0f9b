"""Peers of the solver: each turns a cell into a function that solves it once, from the cell's start.

They stop as their makers ship them, or where a step lowers the cost by less than one part in a million; the
answer of each is compared afterwards.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from handeye.benchmarks.peers import chain, programs, with_gtsam, with_jax
from handeye.benchmarks.peers.availability import MissingPeerError, optional
from handeye.benchmarks.problems import Cell
from handeye.benchmarks.stopping import MOST_STEPS
from handeye.types.arrays import FloatArray

Solve = Callable[[], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class SolvePeer:
    """A peer of the solver.

    Parameters
    ----------
    what
        What it does, for the reader of the table.
    prepare
        Makes the function that solves a cell; raises `MissingPeerError` where it cannot.
    closed_form
        Whether it gives an approximate answer, so that costs are not comparable.
    """

    what: str
    prepare: Callable[[Cell], Solve]
    closed_form: bool = False


def _scipy(cell: Cell) -> Solve:
    optimize = optional("scipy", "scipy.optimize")
    start = chain.stacked(cell.X_start, cell.Y_start)

    def solve() -> tuple[FloatArray, FloatArray]:
        found = optimize.least_squares(
            partial(chain.residuals, cell),
            start,
            jac=partial(chain.jacobian, cell),
            method="lm",
        )
        np.linalg.inv(found.jac.T @ found.jac)
        return chain.unstacked(found.x)

    return solve


def _opencv(cell: Cell) -> Solve:
    cv2 = optional("cv2")
    if not hasattr(cv2, "calibrateRobotWorldHandEye"):
        raise MissingPeerError(f"OpenCV {cv2.__version__} has no calibrateRobotWorldHandEye in Python")
    cv2.setNumThreads(1)
    fx, fy, cx, cy = cell.parameters[:4]
    K, none = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), np.zeros(5)
    turns = [motion[:3, :3].copy() for motion in cell.motions]
    shifts = [motion[:3, 3].copy() for motion in cell.motions]

    def solve() -> tuple[FloatArray, FloatArray]:
        R_camera: list[FloatArray] = []
        t_camera: list[FloatArray] = []
        for pixels in cell.pixels:
            _, rotation, translation = cv2.solvePnP(cell.points, pixels, K, none)
            R_camera.append(cv2.Rodrigues(rotation)[0])
            t_camera.append(translation)
        R_base, t_base, R_gripper, t_gripper = cv2.calibrateRobotWorldHandEye(
            R_camera, t_camera, turns, shifts, method=cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH
        )
        # Of OpenCV's two answers one leads from the base to the world, one from the gripper to the camera.
        return _rigid(R_gripper, t_gripper), np.asarray(np.linalg.inv(_rigid(R_base, t_base)), dtype=float)

    return solve


def _rigid(R: FloatArray, t: FloatArray) -> FloatArray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t.ravel()
    return T


def _pyceres(cell: Cell) -> Solve:
    ceres = optional("pyceres")
    start = chain.stacked(cell.X_start, cell.Y_start)

    base: Any = ceres.CostFunction

    class OneView(base):
        """Residuals of one view, with derivatives from NumPy."""

        def __init__(self, view: Cell) -> None:
            base.__init__(self)
            self.view = view
            self.set_num_residuals(view.pixels.size)
            self.set_parameter_block_sizes([12])

        def Evaluate(self, parameters: object, residuals: object, jacobians: Any) -> bool:  # noqa: ANN401
            values = np.array(parameters)[0]
            np.asarray(residuals)[:] = chain.residuals(self.view, values)
            if jacobians is not None:
                np.asarray(jacobians[0])[:] = chain.jacobian(self.view, values).ravel()
            return True

    views = [
        Cell(
            cell.lens, cell.parameters, cell.points, cell.X, cell.Y,
            cell.motions[k : k + 1], cell.pixels[k : k + 1], cell.X_start, cell.Y_start,
        )
        for k in range(cell.views)
    ]  # fmt: skip

    def solve() -> tuple[FloatArray, FloatArray]:
        problem = ceres.Problem()
        values = start.copy()
        for view in views:
            problem.add_residual_block(OneView(view), ceres.TrivialLoss(), [values])
        options = ceres.SolverOptions()
        options.linear_solver_type = ceres.LinearSolverType.DENSE_NORMAL_CHOLESKY
        options.num_threads = 1
        options.logging_type = ceres.LoggingType.SILENT
        options.max_num_iterations = MOST_STEPS
        ceres.solve(options, problem, ceres.SolverSummary())
        return chain.unstacked(values)

    return solve


def _ceres(mode: int) -> Callable[[Cell], Solve]:
    def prepare(cell: Cell) -> Solve:
        run = programs.ceres_solve()
        start = chain.stacked(cell.X_start, cell.Y_start)

        def solve() -> tuple[FloatArray, FloatArray]:
            return chain.unstacked(run(cell, start, mode))

        return solve

    return prepare


PEERS = {
    "ceres_analytic": SolvePeer(
        "Ceres in C++, a block per view, derivatives by hand, DENSE_NORMAL_CHOLESKY; no covariance",
        _ceres(0),
    ),
    "ceres_per_point": SolvePeer(
        "Ceres in C++ as robot_cal_tools poses it: automatic derivatives per point, covariance by DENSE_SVD",
        _ceres(1),
    ),
    "ceres_per_point_solve": SolvePeer("the same without the covariance", _ceres(2)),
    "pyceres": SolvePeer("Ceres from Python, derivatives from NumPy per view", _pyceres),
    "scipy": SolvePeer("SciPy least_squares, method lm, derivatives from NumPy", _scipy),
    "jax": SolvePeer("Levenberg-Marquardt in JAX, compiled, forward derivatives", with_jax.solver),
    "gtsam": SolvePeer(
        "GTSAM from Python, a factor per view with derivatives from NumPy, and marginal covariance",
        with_gtsam.solver,
    ),
    "opencv_shah": SolvePeer(
        "OpenCV solvePnP per view and calibrateRobotWorldHandEye, Shah", _opencv, closed_form=True
    ),
}
