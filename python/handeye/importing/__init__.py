"""From any folder that can be read to a recording that can be solved: points detected, camera calibrated."""

from handeye.importing.opening import CameraOrigin, Opened, SourceOptions, open_folder

__all__ = ["CameraOrigin", "Opened", "SourceOptions", "open_folder"]
