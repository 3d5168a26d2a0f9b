"""Made-up answers of a calibration."""

import numpy as np

from handeye.export import Result
from handeye.types import Camera, Mounting, Pose

COVARIANCE = np.diag([1e-7, 2e-7, 3e-7, 4e-8, 5e-8, 6e-8])
CAMERA = Camera("brown_conrady_5", [1400, 1395, 640, 512, -0.1, 0.05, 1e-3, -5e-4, 0.01], 1280, 1024)
GENERIC = Pose.exp([0.02, -0.11, 0.07, 0.4, -1.1, 1.9])
TARGET = Pose.exp([0.9, -0.2, 0.4, -2.0, 0.3, 0.6])


def answer(
    pose: Pose = GENERIC,
    mounting: Mounting = Mounting.EYE_IN_HAND,
    *,
    recording: str = "cell 7",
    warnings: tuple[str, ...] = (),
) -> Result:
    """Return an answer with this pose of the camera."""
    return Result(mounting, pose, TARGET, COVARIANCE, CAMERA, recording, 12, warnings)
