"""The paper's model: the robot's poses and the camera are exact (Yang, Rebello and Waslander 2023)."""

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DegenerateError, HandeyeError, SolveError
from handeye.estimation.estimate import Estimate
from handeye.estimation.initialize import Start, check_views, closed_form_start, pose_start
from handeye.estimation.measurements import Measurements
from handeye.estimation.observability import undetermined
from handeye.types.calibration import ModelName, Noise
from handeye.types.pose import Pose

# A prior for views that do not determine the answer yet: a camera within metres of the flange, any rotation.
WEAK_SIGMA_X = np.array([1.0, 1.0, 1.0, 3.0, 3.0, 3.0])
WEAK_SIGMA_Y = np.array([10.0, 10.0, 10.0, 3.0, 3.0, 3.0])
SMALLEST_SIGMA_PX = 1e-4


def pixel_sigma(measurements: Measurements) -> float:
    """Return the pixel noise per axis: median over views of what each view's own pose leaves."""
    points = measurements.point_counts
    squared = (
        np.array([pose.rmse_px**2 for pose in measurements.poses]) * points / np.maximum(2 * points - 6, 1)
    )
    return max(float(np.sqrt(np.median(squared))), SMALLEST_SIGMA_PX)


def paper_estimate(measurements: Measurements, previous: Estimate | None = None) -> Estimate:
    """Minimise the reprojection error over X and Y from the best of several starts.

    Views that do not determine the answer are completed by a weak prior, and `determined` is False.

    Parameters
    ----------
    measurements
        At least three views.
    previous
        An earlier estimate to start from.

    Raises
    ------
    InputError
        Fewer than three views.
    SolveError
        The iteration diverged from every start.

    Examples
    --------
    >>> paper_estimate(measurements).X.matrix.shape
    (4, 4)
    """
    check_views(measurements)
    sigma = pixel_sigma(measurements)
    sigmas = np.full(len(measurements), sigma)
    starts: list[Start] = [pose_start(measurements, previous)]
    try:
        starts.insert(0, closed_form_start(measurements))
        solution, start = _best(measurements, _core.Model(sigmas), starts)
    except DegenerateError:
        solution, start = None, ""
    if solution is None or solution.ending == "degenerate":
        anchor = starts[-1]
        prior = (np.eye(4), anchor.Y.matrix, WEAK_SIGMA_X, WEAK_SIGMA_Y)
        solution, start = _best(measurements, _core.Model(sigmas, chain_prior=prior), [anchor])
    if solution is None:
        raise SolveError(
            "the reprojection error could not be minimised from any start",
            code=Code.DIVERGED,
            hint="check that the poses belong to the images, and their units",
        )
    X, Y = Pose(solution.x), Pose(solution.y)
    noise = Noise(
        (sigma,) * len(measurements), how="one pixel noise for all views, robot and camera taken as exact"
    )
    return Estimate(
        mounting=measurements.mounting,
        target=measurements.target,
        X=X,
        Y=Y,
        camera=measurements.camera,
        covariance=solution.covariance,
        information=solution.information,
        noise=noise,
        model=ModelName.PAPER,
        start=start,
        ending=solution.ending,
        iterations=solution.iterations,
        candidate_sigma_px=sigma,
        unobservable=undetermined(measurements, X, Y, noise),
    )


def _best(
    measurements: Measurements, model: _core.Model, starts: list[Start]
) -> tuple[_core.Solution | None, str]:
    """Solve from every start; the converged solution with the lowest cost."""
    best: _core.Solution | None = None
    method = ""
    for start in starts:
        try:
            solution = measurements.problem.solve(start.X.matrix, start.Y.matrix, model)
        except HandeyeError:
            continue  # The target is out of sight at this start; another may see it.
        usable = solution.is_converged or solution.ending == "degenerate"
        if usable and (best is None or solution.cost < best.cost * (1 - 1e-9)):
            best, method = solution, start.method
    return best, method
