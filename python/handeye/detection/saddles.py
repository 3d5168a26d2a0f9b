"""Places in a picture where two edges cross, as candidates for the corners of a chessboard.

Between four squares the grey values are a saddle: the determinant of their second derivatives is negative
there. On a ring around such a place they are dark and light twice, the same on opposite sides; where they
change tells the directions of the edges.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import Image
from handeye.detection.noise import pixel_noise
from handeye.types.arrays import FloatArray, IndexArray

# Rings around a candidate, in pixels: the smaller one for small squares, the larger one for blurred pictures.
RINGS_PX = (3.0, 4.5)
SAMPLES = 24
# Least difference of dark and light on a ring, in grey values and in deviations of a pixel's noise.
LEAST_CONTRAST, LEAST_IN_NOISE = 5.0, 3.0
# Least share of what is the same on opposite sides, of all that changes along the ring.
LEAST_EVEN = 0.75
# Edges that meet at a flatter angle cannot be told apart.
LEAST_ANGLE_RAD = 0.3
# Least strength of a candidate: that of little contrast and much blur.
LEAST_STRENGTH = 0.02
# Strongest candidates looked at, crossings kept, and side of the square in which there is only one.
MOST, MOST_KEPT, ALONE_PX = 3000, 1200, 5


@dataclass(frozen=True, eq=False)
class Saddles:
    """Crossings of two edges.

    Attributes
    ----------
    places
        (N, 2) pixels.
    angles
        (N, 2) of the edges in radians from u towards v; from the first to the second, which lies less than pi
        further, it is dark.
    contrasts
        (N,) differences of light and dark in grey values.
    """

    places: FloatArray
    angles: FloatArray
    contrasts: FloatArray

    def __len__(self) -> int:
        return len(self.places)


def find_saddles(picture: Image) -> Saddles:
    """Return the crossings of a picture, those of most contrast first."""
    places = _maxima(_strengths(picture))
    smooth = np.asarray(cv2.GaussianBlur(picture, (3, 3), 0), dtype=np.uint8)
    found = [_on_ring(smooth, places, radius) for radius in RINGS_PX]
    angles, contrasts = found[0]
    for other, contrast in found[1:]:
        # What the larger ring tells is more exact, where it fits between other edges.
        fits = np.isfinite(contrast)
        angles = np.where(fits[:, np.newaxis], other, angles)
        contrasts = np.where(fits, contrast, contrasts)
    least = max(LEAST_CONTRAST, LEAST_IN_NOISE * pixel_noise(picture))
    good = np.flatnonzero(contrasts >= least)
    good = good[np.argsort(-contrasts[good], kind="stable")[:MOST_KEPT]]
    return Saddles(places[good], angles[good], contrasts[good])


def sampled(picture: Image, places: FloatArray) -> FloatArray:
    """Return the grey values (N, M) at places (N, M, 2), between pixels; outside, those of the edge."""
    if len(places) == 0:
        return np.zeros(places.shape[:2])
    maps = places.astype(np.float32)
    values = cv2.remap(picture, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(values, dtype=np.float64).reshape(places.shape[:2])


def _strengths(picture: Image) -> NDArray[np.float32]:
    """Return the negative determinant (H, W) of the second derivatives."""
    xx = np.asarray(cv2.Sobel(picture, cv2.CV_32F, 2, 0, ksize=5, scale=1 / 64), dtype=np.float32)
    yy = np.asarray(cv2.Sobel(picture, cv2.CV_32F, 0, 2, ksize=5, scale=1 / 64), dtype=np.float32)
    xy = np.asarray(cv2.Sobel(picture, cv2.CV_32F, 1, 1, ksize=5, scale=1 / 64), dtype=np.float32)
    cv2.multiply(xx, yy, dst=xx)
    cv2.multiply(xy, xy, dst=xy)
    return np.asarray(cv2.subtract(xy, xx, dst=xy), dtype=np.float32)


def _maxima(strengths: NDArray[np.float32]) -> FloatArray:
    """Return the strongest places (N, 2), each the strongest of its surroundings, to parts of a pixel."""
    highest = cv2.dilate(strengths, np.ones((ALONE_PX, ALONE_PX), dtype=np.uint8))
    border = ALONE_PX // 2 + 1
    inner = (slice(border, -border), slice(border, -border))
    inside = strengths[inner]
    rows, columns = np.nonzero((inside == highest[inner]) & (inside > LEAST_STRENGTH))
    rows, columns = rows + border, columns + border
    values = strengths[rows, columns]
    # Equal strengths are taken in the order of the pixels, so that the answer is always the same.
    order = np.argsort(-values, kind="stable")[:MOST]
    order = order[~_repeated(rows[order], columns[order], values[order])]
    rows, columns, values = rows[order], columns[order], values[order]
    places = np.column_stack([columns, rows]).astype(np.float64)
    for axis, (v, u) in enumerate(((0, 1), (1, 0))):
        before, after = strengths[rows - v, columns - u], strengths[rows + v, columns + u]
        bend = before - 2 * values + after
        places[:, axis] += np.where(bend < 0, (before - after) / (2 * np.minimum(bend, -1e-9)), 0).clip(
            -0.5, 0.5
        )
    return places


def _repeated(rows: IndexArray, columns: IndexArray, values: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Tell which maxima (N,), sorted by value, are of the same plateau as one before."""
    repeated = np.zeros(len(values), dtype=bool)
    for lag in range(1, len(values)):
        same = values[lag:] == values[:-lag]
        if not same.any():
            break
        u, v = np.abs(columns[lag:] - columns[:-lag]), np.abs(rows[lag:] - rows[:-lag])
        repeated[lag:] |= same & (np.maximum(u, v) < ALONE_PX)
    return repeated


def _on_ring(picture: Image, places: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Return angles (N, 2) and contrasts (N,) as in `Saddles`; contrast is NaN where there is no crossing."""
    turn = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    ring = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    values = sampled(picture, places[:, np.newaxis] + ring)
    half = SAMPLES // 2
    even = (values[:, :half] + values[:, half:]) / 2
    odd = (values[:, :half] - values[:, half:]) / 2
    level = (even.max(axis=1) + even.min(axis=1)) / 2
    contrast = even.max(axis=1) - even.min(axis=1)
    e = even - level[:, np.newaxis]
    energy = ((even - even.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    share = energy / np.maximum(energy + (odd**2).sum(axis=1), 1e-9)
    after = np.roll(e, -1, axis=1)
    falls, rises = (e >= 0) & (after < 0), (e < 0) & (after >= 0)
    good = (falls.sum(axis=1) == 1) & (rises.sum(axis=1) == 1) & (share >= LEAST_EVEN)
    index = np.arange(len(places))

    def crossing(where: np.ndarray) -> FloatArray:
        at = np.argmax(where, axis=1)
        here, there = e[index, at], after[index, at]
        step = here / np.where(here == there, 1, here - there)
        return (at + step.clip(0, 1)) * 2 * np.pi / SAMPLES

    first = crossing(falls)
    between = (crossing(rises) - first) % np.pi
    good &= (between >= LEAST_ANGLE_RAD) & (between <= np.pi - LEAST_ANGLE_RAD)
    return np.column_stack([first, first + between]), np.where(good, contrast, np.nan)
