"""From views to X and Y with their uncertainty."""

from handeye.estimation.auto import AutoEstimator, AutoOptions
from handeye.estimation.calibrate import (
    calibrate,
    calibrate_examined,
    make_estimator,
    require_determined,
    solve,
    to_calibration,
)
from handeye.estimation.estimate import Estimate, Estimator
from handeye.estimation.measurements import Measurements, ViewPose, view_pose
from handeye.estimation.paper import paper_estimate
from handeye.estimation.rig import Relative, RigCalibration, RigEstimate, estimate_rig, solve_rig
from handeye.estimation.rig_measurements import RigMeasurements

__all__ = [
    "AutoEstimator",
    "AutoOptions",
    "Estimate",
    "Estimator",
    "Measurements",
    "Relative",
    "RigCalibration",
    "RigEstimate",
    "RigMeasurements",
    "ViewPose",
    "calibrate",
    "calibrate_examined",
    "estimate_rig",
    "make_estimator",
    "paper_estimate",
    "require_determined",
    "solve",
    "solve_rig",
    "to_calibration",
    "view_pose",
]
