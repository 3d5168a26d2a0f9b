"""Corners of a board: being written."""

from handeye.detection.base import Detection, Image, NotFound, Reason
from handeye.types import AprilGrid


def find(image: Image, target: AprilGrid) -> Detection | NotFound:
    """Find nothing yet."""
    return NotFound(Reason.NO_PATTERN, f"no detector yet for {target.family} ({image.shape})")
