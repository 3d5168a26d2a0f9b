"""Why there may be nothing to see: exposure, contrast and focus of an image."""

import cv2
import numpy as np

from handeye.detection.base import Image, NotFound, Reason

DARK_LEVEL = 30
BRIGHT_LEVEL = 254
BRIGHT_SHARE = 0.5
LOW_RANGE = 12
# Steepest step between neighbours, as a share of the image's range, below which no edge is sharp.
BLURRED_STEP = 0.08


def diagnose(image: Image, fallback: NotFound) -> NotFound:
    """Return what the picture itself says against finding anything in it, else the fallback."""
    shares = np.cumsum(cv2.calcHist([image], [0], None, [256], [0, 256]), dtype=np.float64) / image.size
    low, high = np.searchsorted(shares, [0.01, 0.99]).tolist()
    bright = 1 - float(shares[BRIGHT_LEVEL - 1])
    if high <= DARK_LEVEL:
        return NotFound(Reason.UNDEREXPOSED, f"99 % of the pixels are at {high} of 255 or darker")
    if bright >= BRIGHT_SHARE:
        return NotFound(
            Reason.OVEREXPOSED, f"{bright:.0%} of the pixels are white beyond what can be measured"
        )
    if high - low <= LOW_RANGE:
        return NotFound(Reason.LOW_CONTRAST, f"grey values reach only from {low} to {high}")
    step = _steepest_step(image) / (high - low)
    if step < BLURRED_STEP:
        return NotFound(Reason.BLURRED, f"the steepest edge changes by {step:.0%} of the contrast per pixel")
    return fallback


def _steepest_step(image: Image) -> float:
    """Return the slope (grey values per pixel) that one pixel in a thousand exceeds, noise averaged."""
    smooth = np.asarray(cv2.GaussianBlur(image, (0, 0), 1.0), dtype=np.int16)
    # Over two pixels, at every second one.
    across = smooth[1:-1:2, 2::2] - smooth[1:-1:2, :-2:2]
    down = smooth[2::2, 1:-1:2] - smooth[:-2:2, 1:-1:2]
    squares = across.astype(np.int32) ** 2 + down.astype(np.int32) ** 2
    least = round(0.999 * (squares.size - 1))
    return float(np.sqrt(np.partition(squares.ravel(), least)[least])) / 2
