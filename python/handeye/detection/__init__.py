"""From images to the points of a target: one file per family of targets, and what belongs to images alone."""

from handeye.detection.base import Detection, Image, NotFound, Reason, relabeled
from handeye.detection.batch import Batch, DetectionCache, detect_all
from handeye.detection.description import shown_board, without_lengths
from handeye.detection.detect import detect
from handeye.detection.drawing import drawn_over
from handeye.detection.intrinsics import CameraCalibration, calibrate_camera
from handeye.detection.predicted import Prediction

__all__ = [
    "Batch",
    "CameraCalibration",
    "Detection",
    "DetectionCache",
    "Image",
    "NotFound",
    "Prediction",
    "Reason",
    "calibrate_camera",
    "detect",
    "detect_all",
    "drawn_over",
    "relabeled",
    "shown_board",
    "without_lengths",
]
