"""How strong the noise of a picture's pixels is, and the picture without most of it, for searching."""

import cv2
import numpy as np

from handeye.detection.base import Image

# Thresholds draw outlines around noise of more grey values than `STRONG`; smoothing leaves `LEFT` of it.
STRONG, LEFT = 4.0, 2.5


def pixel_noise(picture: Image) -> float:
    """Return the deviation of a pixel's noise in grey values, as most of what smoothing takes away tells."""
    off = cv2.absdiff(picture, cv2.GaussianBlur(picture, (3, 3), 0))[::2, ::2]
    counts = cv2.calcHist([np.ascontiguousarray(off)], [0], None, [256], [0, 256]).ravel()
    # The median of whole numbers, between them as they are spread; of a Gaussian it is 0.67 deviations, and
    # smoothing leaves 0.78 of the noise behind.
    shares = np.cumsum(counts, dtype=np.float64) / off.size
    at = int(np.searchsorted(shares, 0.5))
    before = shares[at - 1] if at else 0.0
    median = at - 0.5 + (0.5 - before) / (shares[at] - before)
    return max(0.0, float(median)) / (0.67 * 0.78)


def calmed(picture: Image) -> Image:
    """Return a picture smoothed so far that outlines in it are not those of noise; most are as they were."""
    noise = pixel_noise(picture)
    if noise <= STRONG:
        return picture
    # A Gaussian of deviation s leaves 1 / (2 s sqrt(pi)) of noise that is independent from pixel to pixel.
    sigma = noise / LEFT / (2 * np.sqrt(np.pi))
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), sigma), dtype=np.uint8)
