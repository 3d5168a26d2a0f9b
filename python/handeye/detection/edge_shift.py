"""Edges that lie elsewhere than they were drawn, all by the same number of pixels.

A camera whose grey values are not proportional to the light moves the edges of what it sees a little out of
focus, ink that ran moves those of the print: dark parts come out larger or smaller all around. Where four
squares meet that changes nothing; a marker's corners go outwards or inwards, all of a picture by the same
distance, which shows against the spaces between the markers. Where the blur reaches from the bits of a
code to its marker's sides, light ones move those, which shows likewise.
"""

from dataclasses import dataclass

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


@dataclass(frozen=True, eq=False)
class Sharpened:
    """Corners of a few markers where they would be had the edges not moved.

    Attributes
    ----------
    pixels
        (N, 2) places.
    sigmas_px
        (N,) deviations of what the corners do not share, still to be compared with how they lie.
    shared_px
        (N,) deviations that are to be added, as nothing tells how far the edges have moved.
    open_px
        (N,) deviations by what is not known of that, told or not.
    """

    pixels: FloatArray
    sigmas_px: FloatArray
    shared_px: FloatArray
    open_px: FloatArray


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of markers or of their bits.

    Attributes
    ----------
    plane, pixels
        (N, 2) places on the board and in the image.
    sides
        (N, 2, 2) unit directions in the image of the edges of the dark or light part, from its corner on.
    signs
        (N,) 1 where that part is dark, -1 where it is light.
    sigmas_px
        (N,) deviations of the places.
    """

    plane: FloatArray
    pixels: FloatArray
    sides: FloatArray
    signs: FloatArray
    sigmas_px: FloatArray


def outwards(sides: FloatArray, shares: FloatArray) -> FloatArray:
    """Return where corners go (K, N, 2) as both their edges move outwards by shares (N, 2, K) of a pixel.

    Edges run along the unit directions `sides` (N, 2, 2), away from the corner.
    """
    first, second = sides[:, 0], sides[:, 1]
    sine = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    moves = -np.stack([second, first], axis=1) / np.maximum(sine, 1e-3)[:, np.newaxis, np.newaxis]
    return np.asarray(np.einsum("nsk,nsi->kni", shares, moves), dtype=np.float64)


def sharpened(own: Corners, bits: Corners | None, size_px: tuple[int, int]) -> Sharpened:
    """Return the corners of a few markers as if edges had not moved, which the corners of their bits tell.

    How far a corner goes with its edges depends on the window that it was fitted in, as it is rounder than
    the picture fitted. Those of bits are smaller; the markers' corners are among them once more, measured so.

    Parameters
    ----------
    own, bits
        Corners of the markers (N), and those of bits; None where those do not tell.
    size_px
        Width and height of the image.
    """
    moves = outwards(own.sides, np.ones((len(own.plane), 2, 1)))[0]
    away = np.sqrt((moves**2).mean(axis=1))
    told = None if bits is None else _shift(own, bits, size_px)
    if told is None:
        return Sharpened(own.pixels, own.sigmas_px, USUAL_PX * away, USUAL_PX * away)
    shift, solving, factor = told
    variance = float(solving @ solving)
    # The shift follows the corners themselves in part, so that less is left of their own errors.
    changes = moves / own.sigmas_px[:, np.newaxis]
    left = 1 - 2 * changes * solving[: 2 * len(moves)].reshape(-1, 2) + changes**2 * variance
    # What the corners of bits show is wrong with the markers' as well: edges along the rows of pixels, say.
    sigmas = own.sigmas_px * np.sqrt(max(factor, 1.0) * left.mean(axis=1))
    return Sharpened(
        own.pixels - shift * moves, sigmas, np.zeros(len(moves)), np.sqrt(factor * variance) * away
    )


def _shift(own: Corners, bits: Corners, size_px: tuple[int, int]) -> tuple[float, FloatArray, float] | None:
    """Return by how many pixels edges lie too far outwards of what is dark, as corners of markers show.

    Also how the coordinates (R,) of all corners over their deviations tell that, and the mean square of
    what is left over what was expected.
    """
    plane, pixels, sides, signs, sigmas = (
        np.concatenate([getattr(own, name), getattr(bits, name)]) for name in Corners.__dataclass_fields__
    )
    board = BentBoard.of(plane, np.zeros(len(plane)), pixels, size_px)
    # Two edges that cross look differently where the smaller part is dark and where it is light.
    is_own = np.arange(len(plane)) < len(own.plane)
    kinds = np.stack([is_own, ~is_own & (signs > 0), ~is_own & (signs < 0)], axis=1) * signs[:, np.newaxis]
    shares = kinds[:, np.newaxis].repeat(2, axis=1).astype(np.float64)
    found = None if board is None else scatter(board.joined(outwards(sides, shares)), sigmas)
    if found is None or abs(found.shares[-3, 0]) > LARGEST_PX:
        return None
    return float(found.shares[-3, 0]), found.solving[-3], found.factor


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
