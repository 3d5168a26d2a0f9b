"""Edges that lie elsewhere than they were drawn, all by the same number of pixels.

A camera whose grey values are not proportional to the light moves the edges of what it sees a little out of
focus, ink that ran moves those of the print: dark parts come out larger or smaller all around. Where four
squares meet that changes nothing; a marker's corners go outwards or inwards, all of a picture by the same
distance, which shows against the spaces between the markers.
"""

import numpy as np

from handeye.detection.quality import off_plane
from handeye.types.arrays import FloatArray

# Fewer corners do not tell a shift from a view.
FEWEST = 16
# A shift must be so many times its deviation; a larger one means a board that is not as described.
LEAST_IN_SIGMAS, LARGEST_PX = 3.0, 1.5
# How far edges usually lie elsewhere where too few corners tell: cameras without gamma and with one together.
USUAL_PX = 0.17


def unknown_shift_px(count: int) -> float:
    """Return the deviation of so many corners that stays because nothing tells where edges have moved to."""
    return USUAL_PX if count < FEWEST else 0.0


def without_edge_shift(plane: FloatArray, pixels: FloatArray, sides: FloatArray) -> FloatArray:
    """Return corners (N, 2) where they would be had the edges not moved.

    Parameters
    ----------
    plane, pixels
        (N, 2) corners on the board and in the image.
    sides
        (N, 2, 2) unit directions in the image of the two sides of the marker that begin at each corner.
    """
    if len(plane) < FEWEST:
        return pixels
    first, second = sides[:, 0], sides[:, 1]
    sine = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    # Both edges moved outwards by one pixel.
    outwards = -(first + second) / np.maximum(sine, 1e-3)[:, np.newaxis]
    here, there = off_plane(plane, pixels), off_plane(plane, pixels - outwards)
    if here is None or there is None:
        return pixels
    # What the shift changes and no view of a flat board does.
    off, freedom = here
    change = off - there[0]
    weight = max(float((change**2).sum()), 1e-12)
    shift = float((off * change).sum()) / weight
    left = off - shift * change
    sigma = float(np.sqrt((left**2).sum() / max(freedom - 1, 1) / weight))
    if not LEAST_IN_SIGMAS * sigma < abs(shift) <= LARGEST_PX:
        return pixels
    return pixels - shift * outwards
