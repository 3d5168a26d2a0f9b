"""Edges that lie elsewhere than they were drawn, all by the same number of pixels.

A camera whose grey values are not proportional to the light moves the edges of what it sees a little out of
focus, ink that ran moves those of the print: dark parts come out larger or smaller all around. Where four
squares meet that changes nothing; a marker's corners go outwards or inwards, all of a picture by the same
distance, which shows against the spaces between the markers. Where the blur reaches from the bits of a
code to its marker's sides, light ones move those, which shows likewise.
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


def without_edge_shift(
    plane: FloatArray, pixels: FloatArray, sides: FloatArray, lights: FloatArray
) -> FloatArray:
    """Return corners (N, 2) where they would be had the edges not moved.

    Parameters
    ----------
    plane, pixels
        (N, 2) corners on the board and in the image.
    sides
        (N, 2, 2) unit directions in the image of the two sides of the marker that begin at each corner.
    lights
        (N, 2) how light the bits are beside each of these sides: where a picture is blurred so far that they
        show at the side, they move that, too.
    """
    if len(plane) < FEWEST:
        return pixels
    first, second = sides[:, 0], sides[:, 1]
    sine = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    shares = np.stack([np.ones_like(lights), lights - lights.mean()], axis=2)
    # Where corners go as the one and the other edge move outwards by one pixel times their shares.
    moves = -np.stack([second, first], axis=1) / np.maximum(sine, 1e-3)[:, np.newaxis, np.newaxis]
    outwards = np.asarray(np.einsum("nsk,nsi->kni", shares, moves), dtype=np.float64)
    here = off_plane(plane, pixels, np.concatenate(outwards, axis=1))
    if here is None:
        return pixels
    # What the shifts change and no view of a flat board does.
    off, freedom, left_of_moves = here
    changes = left_of_moves.reshape(len(plane), -1, 2).transpose(0, 2, 1).reshape(off.size, -1)
    chosen = np.arange(len(outwards))
    while len(chosen):
        part = changes[:, chosen]
        inverse = np.asarray(np.linalg.pinv(part.T @ part, hermitian=True), dtype=np.float64)
        shifts = inverse @ part.T @ off.ravel()
        left = off.ravel() - part @ shifts
        sigmas = np.sqrt(float(left @ left) / max(freedom - len(chosen), 1) * np.diag(inverse))
        good = (np.abs(shifts) > LEAST_IN_SIGMAS * sigmas) & (np.abs(shifts) <= LARGEST_PX)
        if good.all():
            return pixels - np.tensordot(shifts, outwards[chosen], axes=1)
        chosen = np.delete(
            chosen, np.argmin(np.where(good, np.inf, np.abs(shifts) / np.maximum(sigmas, 1e-12)))
        )
    return pixels
