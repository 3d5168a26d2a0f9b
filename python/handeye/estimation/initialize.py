"""Where to start: every closed form is tried, and the one whose reprojection fits best is kept."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DegenerateError, HandeyeError, InputError
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose

MIN_VIEWS = 3
# Deviation of the poses beyond their pixel noise while a start is looked for: a millimetre, 0.05 degrees.
START_SLACK = np.array([1e-3] * 3 + [np.deg2rad(0.05)] * 3)


@dataclass(frozen=True)
class Start:
    """X and Y to start from, and where they came from."""

    X: Pose
    Y: Pose
    method: str
    failures: dict[str, str] = field(default_factory=dict[str, str])


def check_views(measurements: Measurements) -> None:
    """Raise where there are too few views for any answer.

    Raises
    ------
    InputError
        Fewer than three views in which the target's pose could be found.
    """
    if len(measurements) < MIN_VIEWS:
        rejected = "".join(f"; {name}: {why}" for name, why in measurements.rejected.items())
        raise InputError(
            f"{len(measurements)} usable views, at least {MIN_VIEWS} are needed{rejected}",
            code=Code.TOO_FEW_VIEWS,
            hint="take more views of the target, with the camera turned about at least two axes between them",
        )


def closed_form_start(measurements: Measurements) -> Start:
    """Try every closed form and keep the one with the lowest reprojection error.

    Raises
    ------
    InputError
        Fewer than three views.
    DegenerateError
        The motions do not determine X and Y.
    SolveError
        Every method failed.
    """
    check_views(measurements)
    failures: dict[str, str] = {}
    best: tuple[float, Start] | None = None
    degenerate: DegenerateError | None = None
    for method, _, _ in _core.closed_form_methods():
        try:
            x, y = _core.closed_form(method, measurements.motions, measurements.camera_poses)
        except DegenerateError as error:
            failures[method], degenerate = error.message, error
            continue
        except HandeyeError as error:
            failures[method] = error.message
            continue
        cost = measurements.problem.squared_error(x, y)
        if not np.isfinite(cost):
            # Out of sight at this start; a pose-space distance still tells which start is nearest.
            cost = 1e12 * (1 + pose_distance(measurements, x, y))
        if best is None or cost < best[0]:
            best = (cost, Start(Pose(x), Pose(y), method, failures))
    if best is not None:
        return best[1]
    if degenerate is not None:
        raise degenerate
    reasons = "; ".join(f"{method}: {why}" for method, why in failures.items())
    raise DegenerateError(f"no closed form found a start: {reasons}", code=Code.NO_START)


def pose_distance(measurements: Measurements, x: FloatArray, y: FloatArray) -> float:
    """Sum over views of the squared twist between the chain and the pose measured in the image."""
    predicted = x @ measurements.motions @ y
    difference = predicted @ np.linalg.inv(measurements.camera_poses)
    return float(np.sum(np.square(_core.se3_log(difference))))


def pose_start(measurements: Measurements, previous: "SupportsChain | None" = None) -> Start:
    """Fit X and Y to the poses measured in the images, from many rotations and a previous answer.

    Works for any views, also such that do not determine the answer: a weak prior fills in.

    Raises
    ------
    InputError
        Fewer than three views.
    """
    check_views(measurements)
    counts = measurements.point_counts
    information = np.array([pose.information for pose in measurements.poses])
    variances = (
        np.array([pose.rmse_px**2 for pose in measurements.poses]) * counts / np.maximum(2 * counts - 6, 1)
    )
    covariances = np.linalg.inv(information) * np.maximum(np.median(variances), 1e-8) + np.diag(
        START_SLACK**2
    )
    x, y, _, origin = _core.start_from_poses(
        measurements.motions,
        measurements.camera_poses,
        covariances,
        start=None if previous is None else (previous.X.matrix, previous.Y.matrix),
    )
    return Start(Pose(x), Pose(y), f"poses ({origin})")


class SupportsChain(Protocol):
    """Anything with X and Y of the chain."""

    @property
    def X(self) -> Pose:
        """X of the chain."""
        ...

    @property
    def Y(self) -> Pose:
        """Y of the chain."""
        ...
