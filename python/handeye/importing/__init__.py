"""From any folder that can be read to a recording that can be solved: points detected, camera calibrated."""

from handeye.importing.bag_choice import BagOptions
from handeye.importing.bags import Timing
from handeye.importing.lag import Lag
from handeye.importing.opening import CameraOrigin, Opened, SourceOptions, open_any, open_folder
from handeye.importing.poses_alone import PosesSolved, solve_poses
from handeye.importing.poses_checked import Posed, check_poses, plan_pose_check
from handeye.importing.rigs import OpenedRig, is_rig, one_camera, open_rig

__all__ = [
    "BagOptions",
    "CameraOrigin",
    "Lag",
    "Opened",
    "OpenedRig",
    "Posed",
    "PosesSolved",
    "SourceOptions",
    "Timing",
    "check_poses",
    "is_rig",
    "one_camera",
    "open_any",
    "open_folder",
    "open_rig",
    "plan_pose_check",
    "solve_poses",
]
