"""From views to X and Y with their uncertainty."""

from handeye.solving.auto import AutoEstimator, AutoOptions
from handeye.solving.calibrate import (
    calibrate,
    calibrate_examined,
    make_estimator,
    require_determined,
    solve,
    to_calibration,
)
from handeye.solving.estimate import Estimate, Estimator
from handeye.solving.measurements import Measurements, ViewPose, view_pose
from handeye.solving.paper import paper_estimate

__all__ = [
    "AutoEstimator",
    "AutoOptions",
    "Estimate",
    "Estimator",
    "Measurements",
    "ViewPose",
    "calibrate",
    "calibrate_examined",
    "make_estimator",
    "paper_estimate",
    "require_determined",
    "solve",
    "to_calibration",
    "view_pose",
]
