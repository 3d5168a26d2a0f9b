"""Values that everything else is made of: immutable, and valid if they exist."""

from handeye.types.camera import LENSES, Camera
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose
from handeye.types.recording import Recording, Truth
from handeye.types.rig import (
    Body,
    CameraView,
    MountedCamera,
    MountedTarget,
    RigRecording,
    RigTruth,
    Station,
)
from handeye.types.target import AprilGrid, ArucoGrid, ArucoMarker, Charuco, Chessboard, CircleGrid, Target
from handeye.types.view import View

__all__ = [
    "LENSES",
    "AprilGrid",
    "ArucoGrid",
    "ArucoMarker",
    "Body",
    "Camera",
    "CameraView",
    "Charuco",
    "Chessboard",
    "CircleGrid",
    "MountedCamera",
    "MountedTarget",
    "Mounting",
    "Pose",
    "Recording",
    "RigRecording",
    "RigTruth",
    "Station",
    "Target",
    "Truth",
    "View",
]
