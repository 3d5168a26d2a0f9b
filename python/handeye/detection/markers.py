"""Square markers of a dictionary: finding them, and whether they lie as the board has them."""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import Image, NotFound, Reason
from handeye.detection.beyond import correlation
from handeye.detection.noise import calmed
from handeye.detection.registration import Aligned, drawn
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.target import Coded
from handeye.types.target.dictionaries import marker_bits

# Smallest perimeter of a marker, as a share of the longer side of the image.
SMALLEST_PERIMETER_SHARE = 0.015
# How far a marker may lie from where its neighbour expects it, as a share of their distance.
TOLERANCE = 0.3
CONSISTENT_SHARE = 0.75
# Neighbours of a marker are so much further than the nearest.
AROUND = 1.5
NEIGHBOURS = 12
# Corners are weighed so many times; those closer than this to where they should be all count the same.
WEIGHINGS = 5
FINEST_PX = 0.05
# A marker has its number where its bits agree so well with those printed; those of other numbers differ in a
# quarter of the bits or more.
LEAST_AGREEMENT = 0.75
LEAST_CONTRAST = 5.0
# Of the markers that should be in the image so many must be readable.
LEAST_SHARE = 0.5

NO_IDS: IndexArray = np.zeros(0, dtype=np.int64)


def parameters(border_bits: int) -> cv2.aruco.DetectorParameters:
    """Return OpenCV's parameters for markers whose corners are measured here, not there."""
    chosen = cv2.aruco.DetectorParameters()
    chosen.markerBorderBits = border_bits
    chosen.minMarkerPerimeterRate = SMALLEST_PERIMETER_SHARE
    chosen.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    return chosen


@cache
def dictionary(name: str) -> cv2.aruco.Dictionary:
    """Return one of OpenCV's predefined dictionaries."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


@dataclass(frozen=True, eq=False)
class Seen:
    """Markers of one dictionary in an image.

    Attributes
    ----------
    ids
        (M,) their numbers, no number twice.
    corners
        (M, 4, 2) their corners in OpenCV's order.
    repeated
        Numbers that are in the image more than once.
    """

    ids: IndexArray
    corners: FloatArray
    repeated: IndexArray

    @classmethod
    def of(cls, ids: object, corners: object) -> "Seen":
        """Return what OpenCV gives as arrays."""
        numbers = np.zeros(0, dtype=np.int64) if ids is None else np.asarray(ids, dtype=np.int64).ravel()
        places = np.asarray(corners, dtype=np.float64).reshape(-1, 4, 2)[: len(numbers)]
        values, counts = np.unique(numbers, return_counts=True)
        once = np.isin(numbers, values[counts == 1])
        return cls(numbers[once], places[once], values[counts > 1])

    def twice(self, target: Coded) -> "NotFound | None":
        """Return word of a board that is in the picture twice, as markers of it are; None if none is."""
        again = int(np.isin(self.repeated, target.marker_ids).sum())
        if not again:
            return None
        return NotFound(
            Reason.REPEATED, f"the board is in the picture twice: {again} of its markers are seen twice"
        )

    def of_board(self, target: Coded) -> "tuple[IndexArray, FloatArray] | NotFound":
        """Return which markers (K,) of a board are there, and their corners (K, 4, 2) in the image.

        Other markers in the picture are no matter: they are of another board.
        """
        of_board = target.marker_ids
        once = np.setdiff1d(self.ids, self.repeated)
        if np.isin(self.repeated, of_board).sum() > np.isin(once, of_board).sum() and (
            twice := self.twice(target)
        ):
            return twice
        order = np.argsort(of_board)
        at = np.searchsorted(of_board, self.ids, sorter=order).clip(0, len(order) - 1)
        which = order[at]
        known = of_board[which] == self.ids
        return which[known], self.corners[known]


def find_markers(image: Image, name: str, border_bits: int) -> Seen:
    """Return the markers of a dictionary."""
    detector = cv2.aruco.ArucoDetector(dictionary(name), parameters(border_bits))
    corners, ids, _ = detector.detectMarkers(calmed(image))
    return Seen.of(ids, corners)


@dataclass(frozen=True, eq=False)
class Bits:
    """The bits of the markers of a board.

    Attributes
    ----------
    places
        (M, B, B, 2) where they are in the plane of the board.
    drawn
        (M, B, B) what is printed there.
    """

    places: FloatArray
    drawn: FloatArray

    @classmethod
    def of(cls, target: Coded) -> "Bits":
        """Return the bits of the markers of a board."""
        bits, outlines = marker_bits(target.dictionary), target.outlines
        steps = (target.border_bits + np.arange(bits) + 0.5) / (bits + 2 * target.border_bits)
        first = outlines[:, np.newaxis, np.newaxis, 0]
        across, down = (outlines[:, np.newaxis, np.newaxis, k] - first for k in (1, 3))
        places = first + across * steps[:, np.newaxis] + down * steps[:, np.newaxis, np.newaxis]
        return cls(places, drawn(target, places))

    def readable(self, board: Aligned) -> NDArray[np.bool_]:
        """Tell which markers (M,) show their numbers where they should be."""
        seen = board.seen(self.places)
        agreement = correlation(seen, self.drawn)
        return (agreement >= LEAST_AGREEMENT) & (seen.std(axis=(1, 2)) >= LEAST_CONTRAST)


def disagreement(plane: FloatArray, pixels: FloatArray) -> NotFound | None:
    """Return why markers cannot be those of the board, None if they agree with it.

    Each pair of neighbours says by their own corners how far apart they must be; so neither perspective nor
    lens matters.

    Parameters
    ----------
    plane, pixels
        (M, 4, 2) corners of the markers on the board and in the image.
    """
    if len(plane) < 2:
        return None
    centres, seen = plane.mean(axis=1), pixels.mean(axis=1)
    away = np.linalg.norm(centres[:, np.newaxis] - centres, axis=2)
    np.fill_diagonal(away, np.inf)
    nearest = away.min(axis=1, keepdims=True)
    # All around, so that rows of another length show: there only neighbours in a row agree.
    i, j = np.nonzero(away <= AROUND * nearest)
    # The affine map of each marker's own corners, least squares; between two the mean of both.
    inverse = np.asarray(np.linalg.pinv(plane - centres[:, np.newaxis]), dtype=np.float64)
    A = inverse @ (pixels - seen[:, np.newaxis])
    step = ((centres[j] - centres[i])[:, np.newaxis] @ (A[i] + A[j]) / 2)[:, 0]
    miss = np.linalg.norm(seen[i] + step - seen[j], axis=1)
    good = miss < TOLERANCE * np.linalg.norm(seen[j] - seen[i], axis=1)
    agree = np.bincount(i, good, len(plane)) >= CONSISTENT_SHARE * np.bincount(i, minlength=len(plane))
    if agree.sum() >= CONSISTENT_SHARE * len(plane):
        return None
    return NotFound(
        Reason.INCONSISTENT,
        f"only {agree.sum()} of {len(plane)} markers lie as they would on the board described",
    )


def from_neighbours(plane: FloatArray, pixels: FloatArray) -> FloatArray:
    """Return where (N, 2) the corners around it put each corner, by a homography that some of them may fail.

    The sum of distances is minimised rather than that of their squares, by weighing (Weiszfeld 1937), so that
    a few corners far off count little.

    Parameters
    ----------
    plane, pixels
        (N, 2) corners on the board and in the image; fewer than eight are returned as they are.
    """
    if len(plane) < 8:
        return pixels.copy()
    away = np.linalg.norm(plane[:, np.newaxis] - plane, axis=2)
    np.fill_diagonal(away, np.inf)
    around = np.argpartition(away, min(NEIGHBOURS, len(plane) - 1), axis=1)[:, :NEIGHBOURS]
    # Coordinates about each corner, of size one; then the corner itself is at the origin of the plane.
    x, _ = _about(plane[around], plane)
    u, extent = _about(pixels[around], pixels)
    x1 = np.concatenate([x, np.ones((*x.shape[:2], 1))], axis=2)
    rows = np.zeros((len(x), 2, x.shape[1], 8))
    rows[:, 0, :, :3] = rows[:, 1, :, 3:6] = x1
    rows[:, 0, :, 6:] = -u[..., :1] * x
    rows[:, 1, :, 6:] = -u[..., 1:] * x
    rows = rows.reshape(len(x), -1, 8)
    wanted = u.transpose(0, 2, 1).reshape(len(x), -1, 1)
    weights = np.ones((len(x), x.shape[1]))
    homography: FloatArray = np.zeros((len(x), 8, 1))
    floor = FINEST_PX / extent[:, 0]
    for _ in range(WEIGHINGS):
        weighted = (rows * np.tile(weights, 2)[..., np.newaxis]).transpose(0, 2, 1)
        normal = weighted @ rows + 1e-12 * np.eye(8)
        homography = np.asarray(np.linalg.solve(normal, weighted @ wanted), dtype=np.float64)
        miss = np.hypot(*np.split((rows @ homography - wanted)[..., 0], 2, axis=1))
        weights = 1 / np.maximum(miss, floor)
        weights /= weights.max(axis=1, keepdims=True)
    # Where the origin of the plane comes to lie.
    return pixels + homography[:, [2, 5], 0] * extent[:, 0]


def _about(places: FloatArray, middles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places (N, M, 2) relative to the middles (N, 2), of size one, and what one was (N, 1, 1)."""
    offset = places - middles[:, np.newaxis]
    size = np.maximum(np.abs(offset).max(axis=(1, 2), keepdims=True), 1e-12)
    return offset / size, size
