"""Edges that lie elsewhere than they were drawn, all by the same number of pixels.

A camera whose grey values are not proportional to the light moves the edges of what it sees a little out of
focus, ink that ran moves those of the print: dark parts come out larger or smaller all around. Where four
squares meet that changes nothing; a marker's corners go outwards or inwards, all of a picture by the same
distance, which shows against the spaces between the markers. Where the blur reaches from the bits of a
code to its marker's sides, light ones move those, which shows likewise.
"""

import numpy as np

from handeye.detection.bent_board import BentBoard
from handeye.detection.quality import scatter
from handeye.types.arrays import FloatArray

# Of fewer corners of markers it does not show; those of their bits tell.
FEWEST = 36
# A shift must be so many times its deviation; a larger one means a board that is not as described.
LEAST_IN_SIGMAS, LARGEST_PX = 3.0, 1.5
# How far edges usually lie elsewhere where nothing tells: cameras without gamma and with one together.
USUAL_PX = 0.17
# So many corners of bits tell, together with those of the markers.
FEWEST_OF_BITS = 8


def outwards(sides: FloatArray, shares: FloatArray) -> FloatArray:
    """Return where corners go (K, N, 2) as both their edges move outwards by shares (N, 2, K) of a pixel.

    Edges run along the unit directions `sides` (N, 2, 2), away from the corner.
    """
    first, second = sides[:, 0], sides[:, 1]
    sine = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    moves = -np.stack([second, first], axis=1) / np.maximum(sine, 1e-3)[:, np.newaxis, np.newaxis]
    return np.asarray(np.einsum("nsk,nsi->kni", shares, moves), dtype=np.float64)


def shift_of_few(
    plane: FloatArray, pixels: FloatArray, size_px: tuple[int, int], sides: FloatArray, signs: FloatArray
) -> tuple[float, float]:
    """Return by how many pixels edges lie too far outwards of what is dark, and the deviation of that.

    Parameters
    ----------
    plane, pixels
        (N, 2) corners of markers and of their bits on the board and in the image.
    size_px
        Width and height of the image.
    sides
        (N, 2, 2) unit directions in the image of the edges of the dark or light part, from its corner on.
    signs
        (N,) 1 where that part is dark, -1 where it is light.
    """
    board = BentBoard.of(plane, np.zeros(len(plane)), pixels, size_px)
    # Two edges that cross look differently where the smaller part is dark and where it is light.
    shares = np.stack([signs.clip(0), signs.clip(None, 0)], axis=1)[:, np.newaxis].repeat(2, axis=1)
    found = None if board is None else scatter(board.joined(outwards(sides, shares)), np.ones(len(plane)))
    if found is None or abs(found.shares[-2, 0]) > LARGEST_PX:
        return 0.0, USUAL_PX
    return float(found.shares[-2, 0]), float(np.sqrt(found.factor * found.covariance[-2, -2]))


def without_edge_shift(
    plane: FloatArray,
    pixels: FloatArray,
    size_px: tuple[int, int],
    sides: FloatArray,
    lights: FloatArray,
) -> FloatArray:
    """Return corners (N, 2) where they would be had the edges not moved.

    Parameters
    ----------
    plane, pixels
        (N, 2) corners on the board and in the image.
    size_px
        Width and height of the image.
    sides
        (N, 2, 2) unit directions in the image of the two sides of the marker that begin at each corner.
    lights
        (N, 2) how light the bits are beside each of these sides: where a picture is blurred so far that they
        show at the side, they move that, too.
    """
    if len(plane) < FEWEST:
        return pixels
    moves = outwards(sides, np.stack([np.ones_like(lights), lights - lights.mean()], axis=2))
    board = BentBoard.of(plane, np.zeros(len(plane)), pixels, size_px)
    if board is None:
        return pixels
    # What the shifts change and no view of a flat board does.
    off = board.left(board.off)
    changes = np.stack([board.left(move).ravel() for move in moves], axis=1)
    chosen = np.arange(len(moves))
    while len(chosen):
        part = changes[:, chosen]
        inverse = np.asarray(np.linalg.pinv(part.T @ part, hermitian=True), dtype=np.float64)
        shifts = inverse @ part.T @ off.ravel()
        left = off.ravel() - part @ shifts
        sigmas = np.sqrt(float(left @ left) / max(board.freedom - len(chosen), 1) * np.diag(inverse))
        good = (np.abs(shifts) > LEAST_IN_SIGMAS * sigmas) & (np.abs(shifts) <= LARGEST_PX)
        if good.all():
            return pixels - np.tensordot(shifts, moves[chosen], axes=1)
        chosen = np.delete(
            chosen, np.argmin(np.where(good, np.inf, np.abs(shifts) / np.maximum(sigmas, 1e-12)))
        )
    return pixels
