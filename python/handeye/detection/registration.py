"""Where a board whose picture is known lies in an image, from where it is expected.

The image around the expected place is taken as if seen squarely, as coarse as the board's details allow. In
it the printed picture is looked for, first by its correlation over all shifts that the prediction allows,
then by least squares over a homography (inverse compositional: Baker and Matthews, "Lucas-Kanade 20 years
on", IJCV 2004). Both are of grey values from which the light around was taken away. Here the picture is
drawn; it is looked for in `handeye._core`.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from handeye import _core
from handeye.detection.base import Image
from handeye.pattern import Pattern
from handeye.types import Target
from handeye.types.arrays import FloatArray
from handeye.types.target.artwork import Artwork, Markers, Squares

# Pixels of the squared picture for a square's side, a circle's radius and a marker's bit.
SQUARE_PX, RADIUS_PX, BIT_PX = 8.0, 3.0, 1.3
# Side of the squared picture of a board with markers.
LEAST_MARKER_PX = 60.0
LARGEST_PICTURE_PX = 40_000
# Light margin around what is printed, in pitches.
MARGIN = 0.35
# The light around a place is that of so many pitches.
LIGHT = 1.2
# Printed pictures are drawn from so many samples along a pixel's side, then blurred as images are.
SAMPLES, BLUR_PX = 8, 0.7
# A point is there where image and picture agree so well around it.
LEAST_LIKENESS = 0.6


@lru_cache(maxsize=16)
def printed(target: Target) -> _core.Printed:
    """Return the picture of a target."""
    pattern, artwork = Pattern(target), target.artwork()
    pitch = target.spacing_m
    extent = pattern.high - pattern.low + 2 * MARGIN * pitch
    scale = min(_detail(target, artwork, pattern), float(np.sqrt(LARGEST_PICTURE_PX / np.prod(extent))))
    # Squares and margin of whole pixels, so that samples have lines where they are; where the lines between
    # pixels are others for each tag, that averages out.
    if any(isinstance(layer, Squares) and layer.side_m == layer.pitch_m for layer in artwork.layers):
        scale = max(np.rint(pitch * scale), 1.0) / pitch
    margin = np.ceil(MARGIN * pitch * scale) / scale
    low, high = pattern.low - margin, pattern.high + margin
    width, height = np.ceil((high - low) * scale).astype(int).tolist()
    y, x = np.indices((height * SAMPLES, width * SAMPLES), dtype=np.float64).reshape(2, -1)
    dark = pattern.is_dark((np.column_stack([x, y]) + 0.5) / (SAMPLES * scale) + low)
    shares = 1 - dark.reshape(height, SAMPLES, width, SAMPLES).mean(axis=(1, 3), dtype=np.float32)
    blurred = np.asarray(cv2.GaussianBlur(shares, (0, 0), BLUR_PX), dtype=np.float32)
    light_px = round(LIGHT * pitch * scale) | 1
    return _core.Printed(blurred, (low[0], low[1]), scale, pitch, light_px)


def _detail(target: Target, artwork: Artwork, pattern: Pattern) -> float:
    """Return the pixels per metre that the details of a picture need."""
    if any(isinstance(layer, Markers) for layer in artwork.layers):
        # A single marker has few bits to be laid over an image by.
        return max(BIT_PX / pattern.finest_m, LEAST_MARKER_PX / float((pattern.high - pattern.low).max()))
    return RADIUS_PX / target.radius_m if target.radius_m > 0 else SQUARE_PX / target.spacing_m


@dataclass(frozen=True, eq=False)
class Aligned:
    """Where a board lies in an image."""

    found: _core.Alignment

    def places(self, plane: FloatArray) -> FloatArray:
        """Return where places (..., 2) of the plane of the target are in the image, in pixels."""
        return self.found.places(plane.reshape(-1, 2)).reshape(plane.shape)

    def steps(self, plane: FloatArray) -> FloatArray:
        """Return the pixels (N, 2, 2) per metre along each of the plane's axes at places (N, 2)."""
        return self.found.steps(plane)

    def seen(self, plane: FloatArray) -> FloatArray:
        """Return the grey values (...) at places (..., 2) of the plane, light where paper should be."""
        return self.found.seen(plane.reshape(-1, 2)).reshape(plane.shape[:-1])

    def likeness(self, plane: FloatArray) -> FloatArray:
        """Return how well image and picture agree, -1 to 1, one pitch around places (N, 2) of the plane."""
        return self.found.likeness(plane)


def drawn(target: Target, plane: FloatArray) -> FloatArray:
    """Return what a target's picture has at places (..., 2) of the plane, 0 for ink and 1 for paper."""
    return printed(target).drawn(plane.reshape(-1, 2)).reshape(plane.shape[:-1])


def aligned(
    image: Image, target: Target, plane: FloatArray, pixels: FloatArray, margin_px: float
) -> Aligned | None:
    """Return where a target lies whose places (N, 2) are expected at pixels (N, 2), within a margin.

    None where it is not there. What is found is not yet proved to be that target: a grid may be a line off,
    a marker may be another one, and what is hidden is not known.
    """
    # Circles may be light on a dark board.
    found = printed(target).align(image, plane, pixels, margin_px, target.radius_m > 0)
    return None if found is None else Aligned(found)
