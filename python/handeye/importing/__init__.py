"""From any folder that can be read to a recording that can be solved: points detected, camera calibrated."""

from handeye.importing.opening import CameraOrigin, Opened, SourceOptions, open_any, open_folder
from handeye.importing.poses_alone import PosesSolved, solve_poses

__all__ = ["CameraOrigin", "Opened", "PosesSolved", "SourceOptions", "open_any", "open_folder", "solve_poses"]
