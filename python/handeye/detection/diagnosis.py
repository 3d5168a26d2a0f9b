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
    low, high = (float(v) for v in np.percentile(image[::2, ::2], [1, 99]))
    bright = float((image >= BRIGHT_LEVEL).mean())
    if high <= DARK_LEVEL:
        return NotFound(Reason.UNDEREXPOSED, f"99 % of the pixels are at {high:.0f} of 255 or darker")
    if bright >= BRIGHT_SHARE:
        return NotFound(
            Reason.OVEREXPOSED, f"{bright:.0%} of the pixels are white beyond what can be measured"
        )
    if high - low <= LOW_RANGE:
        return NotFound(Reason.LOW_CONTRAST, f"grey values reach only from {low:.0f} to {high:.0f}")
    step = _steepest_step(image) / (high - low)
    if step < BLURRED_STEP:
        return NotFound(Reason.BLURRED, f"the steepest edge changes by {step:.0%} of the contrast per pixel")
    return fallback


def _steepest_step(image: Image) -> float:
    """Return the slope (grey values per pixel) that one pixel in a thousand exceeds, noise averaged."""
    smooth = cv2.GaussianBlur(image, (0, 0), 1.0).astype(np.float32)
    slope = np.hypot(cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)) / 8
    return float(np.percentile(slope[::2, ::2], 99.9))
