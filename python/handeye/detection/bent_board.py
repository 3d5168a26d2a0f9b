"""How far points are off those of a flat board, and what of that its pose and the lens may make."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.polynomial import chebyshev

from handeye.types.arrays import FloatArray

# So many points tell polynomials of this degree in the image, as lenses of any kind are made of. Fewer tell
# what ordinary lenses do about the image's centre, one term more for each point above four.
POINTS_OF_POLYNOMIALS, DEGREE = 36, 5
OF_HOMOGRAPHY = 8
# Places of an outline by which a term's mean over it is told, exactly: a term is of the fifth degree at most.
AROUND = 8


@dataclass(frozen=True, eq=False)
class BentBoard:
    """Points of a flat board in an image, and what views of it through a smooth lens differ by.

    Attributes
    ----------
    off
        (N, 2) pixels from where a homography of the board has the points.
    columns
        (R, K) shares of what may be added: R is N if each coordinate has its own, 2 N if they have one.
    """

    off: FloatArray
    columns: FloatArray

    @classmethod
    def of(
        cls, plane: FloatArray, radii: FloatArray, pixels: FloatArray, size_px: tuple[int, int]
    ) -> "BentBoard | None":
        """Return the points (N, 2) of an image of a width and height; None where no homography joins them.

        Circles have radii (N,), other points none; places (N, 2) and radii are in metres.
        """
        lens, columns = np.zeros(pixels.shape), np.zeros((0, 0))
        for is_last in (False, True):
            # OpenCV gives None where it finds none, whatever its types say.
            found, _ = cv2.findHomography(plane, pixels - lens, 0)
            if found is None:  # pyright: ignore[reportUnnecessaryComparison]
                return None
            homography = np.asarray(found, dtype=np.float64)
            flat, outlines = _outlines(homography, plane, radii)
            if len(plane) >= POINTS_OF_POLYNOMIALS:
                # What another homography would change is in the polynomials, too.
                return cls(pixels - flat, _polynomials(pixels))
            parts = _of_homography(homography, plane, flat), _of_lens(flat, outlines, size_px)
            columns = np.concatenate(parts, axis=2)[:, :, : len(plane) + 4].reshape(2 * len(plane), -1)
            if not is_last:
                # A lens bends what is seen without it, and a homography is of that.
                shares = np.linalg.lstsq(columns, (pixels - flat).ravel(), rcond=None)[0]
                lens = (columns[:, OF_HOMOGRAPHY:] @ shares[OF_HOMOGRAPHY:]).reshape(pixels.shape)
        return cls(pixels - flat, columns)

    @property
    def freedom(self) -> int:
        """How many of the coordinates the views leave free."""
        return self.off.size - self.columns.shape[1] * (self.off.size // len(self.columns))

    def joined(self, moves: FloatArray) -> "BentBoard":
        """Return the points as if views could also make moves (M, N, 2) of all of them."""
        columns = self.columns
        if len(columns) < self.off.size:
            columns = np.kron(columns, np.eye(2))
        joined = np.concatenate([columns, moves.reshape(len(moves), -1).T], axis=1, dtype=np.float64)
        return BentBoard(self.off, joined)

    def rows(self, moves: FloatArray) -> FloatArray:
        """Return moves (N, 2) of the points as rows (R, ...) of the columns."""
        return moves.reshape(len(self.columns), -1)

    def points(self, rows: FloatArray) -> FloatArray:
        """Return rows (R, ...) as one for each coordinate (N, 2) of the points."""
        return rows.reshape(len(self.off), -1) * np.ones(2)

    def left(self, moves: FloatArray) -> FloatArray:
        """Return what of moves (N, 2) of the points no view makes."""
        rows = self.rows(moves)
        return self.points(rows - self.columns @ np.linalg.lstsq(self.columns, rows, rcond=None)[0])


def _within(values: FloatArray, size: FloatArray | float) -> FloatArray:
    """Return values (N, 2) from -1 to 1 in a box around them."""
    return (2 * values - values.min(axis=0) - values.max(axis=0)) / size


def _outlines(
    homography: FloatArray, plane: FloatArray, radii: FloatArray
) -> tuple[FloatArray, FloatArray | None]:
    """Return the centres (N, 2) of the ellipses that circles (N, 2) of radii (N,) are seen as, and half axes.

    Those are two conjugate ones (N, 2, 2) of each; None where there are no circles.
    """
    middle = np.column_stack([plane, np.ones(len(plane))]) @ homography.T
    axes = homography[:, :2]
    # Dual conics.
    dual = middle[:, :, np.newaxis] * middle[:, np.newaxis] - (radii**2)[:, np.newaxis, np.newaxis] * (
        axes @ axes.T
    )
    centres = dual[:, :2, 2] / dual[:, 2:, 2]
    if not radii.any():
        return centres, None
    shapes = centres[:, :, np.newaxis] * centres[:, np.newaxis] - dual[:, :2, :2] / dual[:, 2:, 2:]
    return centres, np.asarray(np.linalg.cholesky(shapes), dtype=np.float64).swapaxes(1, 2)


def _polynomials(pixels: FloatArray) -> FloatArray:
    """Return the powers (N, K) of places (N, 2) in the image, up to the degree."""
    x, y = _within(pixels, np.maximum(np.ptp(pixels, axis=0), 1e-12)).T
    powers = np.asarray(chebyshev.chebvander2d(x, y, [DEGREE, DEGREE]), dtype=np.float64)
    return powers[:, np.add.outer(np.arange(DEGREE + 1), np.arange(DEGREE + 1)).ravel() <= DEGREE]


def _of_homography(homography: FloatArray, plane: FloatArray, flat: FloatArray) -> FloatArray:
    """Return what the entries of a homography change (N, 2, 8) of points that it has in the image (N, 2)."""
    depth = np.column_stack([plane, np.ones(len(plane))]) @ homography[2]
    place = _within(plane, float(np.ptp(plane, axis=0).max()) or 1.0)
    ones = np.column_stack([place, np.ones(len(plane))]) * (depth.mean() / depth)[:, np.newaxis]
    seen = _within(flat, np.maximum(np.ptp(flat, axis=0).max(), 1e-12))
    columns = np.zeros((len(plane), 2, OF_HOMOGRAPHY))
    columns[:, 0, :3] = columns[:, 1, 3:6] = ones
    columns[:, :, 6:] = -seen[:, :, np.newaxis] * ones[:, np.newaxis, :2]
    return columns


def _of_lens(flat: FloatArray, outlines: FloatArray | None, size_px: tuple[int, int]) -> FloatArray:
    """Return what the terms of an ordinary lens change (N, 2, 7) of points (N, 2), the most usual first.

    Of a circle they move the centroid of its area: by the mean over its outline (half axes (N, 2, 2)) of the
    way from the centre, times how far a term moves it outwards.
    """
    if outlines is None:
        return _moved(flat, size_px)
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    out = np.column_stack([np.cos(turn), np.sin(turn)])
    moves = _moved((flat[:, np.newaxis] + out @ outlines).reshape(-1, 2), size_px)
    # In coordinates in which the ellipse is the unit circle.
    seen = np.linalg.solve(outlines.swapaxes(1, 2)[:, np.newaxis], moves.reshape(len(flat), AROUND, 2, -1))
    outwards = np.einsum("ai,naik->nak", out, seen)
    round_ = 2 * np.einsum("ai,nak->nik", out, outwards) / AROUND
    return np.asarray(outlines.swapaxes(1, 2) @ round_, dtype=np.float64)


def _moved(places: FloatArray, size_px: tuple[int, int]) -> FloatArray:
    """Return where the terms of an ordinary lens move (N, 2, 7) places (N, 2)."""
    away = (2 * places - np.array(size_px) + 1) / max(size_px)
    squares, axes = (away**2).sum(axis=1, keepdims=True), np.eye(2)
    # Two radial terms, and what they change as the centre moves; of the first these are the tangential ones.
    first = [2 * away[:, [k]] * away + squares * axes[k] for k in (0, 1)]
    second = [4 * squares * away[:, [k]] * away + squares**2 * axes[k] for k in (0, 1)]
    # Pixels that are not quite square.
    aspect = away[:, [1]] ** 2 * away
    return np.stack([squares * away, squares**2 * away, *first, *second, aspect], axis=2)
