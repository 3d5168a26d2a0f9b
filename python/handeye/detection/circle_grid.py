"""Circles of a board: being written."""

from handeye.detection.base import Detection, Image, NotFound, Reason
from handeye.types import CircleGrid


def find(image: Image, target: CircleGrid) -> Detection | NotFound:
    """Find nothing yet."""
    return NotFound(Reason.NO_PATTERN, f"no detector yet for {target.family} ({image.shape})")
