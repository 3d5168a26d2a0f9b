"""Where a board whose picture is known lies in an image, from where it is expected.

The image around the expected place is taken as if seen squarely, as coarse as the board's details allow. In
it the printed picture is looked for, first by its correlation over all shifts that the prediction allows,
then by least squares over a homography (inverse compositional: Baker and Matthews, "Lucas-Kanade 20 years
on", IJCV 2004). Both are of grey values from which the light around was taken away.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import Image
from handeye.detection.part import mapped
from handeye.pattern import pattern_of
from handeye.types import AprilGrid, Charuco, Chessboard, CircleGrid, Target
from handeye.types.arrays import FloatArray

Grey = NDArray[np.float32]

# Pixels of the squared picture for a square's side, a circle's radius and a marker's bit.
SQUARE_PX, RADIUS_PX, BIT_PX = 8.0, 3.0, 1.3
LARGEST_PICTURE_PX = 40_000
# Light margin around what is printed, and what is looked at around that, in pitches.
MARGIN, SURROUNDINGS = 0.35, 1.6
# The light around a place is that of so many pitches.
LIGHT = 1.2
# Printed pictures are drawn from so many samples along a pixel's side, then blurred as images are.
SAMPLES, BLUR_PX = 8, 0.7
# Added to the contrast, of ink and paper and in grey values, where there is next to none.
FLOOR, GREY_FLOOR = 0.05, 4.0
MAX_ITERATIONS, STEP_TOLERANCE_PX = 15, 0.04
# Correlation with the picture below which there is no use in going on.
LEAST_CORRELATION = 0.2
# A point is there where image and picture agree so well around it.
LEAST_LIKENESS = 0.6
# Grey of what is outside the image.
OUTSIDE = 128
# An image of which less is looked at than this shows nothing.
SMALLEST_PX = 24
# Places along each side at which a map is asked.
NODES = 9
# Points from which a lens is told from a homography.
FEWEST_FOR_LENS = 20
_WARP = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP


@dataclass(frozen=True, eq=False)
class Printed:
    """The picture of a board, and what aligning with it needs.

    Attributes
    ----------
    picture
        (H, W) 0 for ink, 1 for paper.
    low_m, scale
        Place in the plane of the target of the outer corner of its first pixel; pixels per metre.
    pitch_m
        Distance of neighbouring points or squares.
    """

    picture: Grey
    low_m: FloatArray
    scale: float
    pitch_m: float

    @property
    def light_px(self) -> int:
        """Side of the surroundings that the light is taken from."""
        return round(LIGHT * self.pitch_m * self.scale) | 1

    @cached_property
    def flat(self) -> Grey:
        """(H, W) the picture without its light."""
        return flattened(self.picture, self.light_px, FLOOR)

    @cached_property
    def centring(self) -> FloatArray:
        """(3, 3) from pixels to coordinates about the middle, of size one."""
        height, width = self.picture.shape
        half = max(height, width) / 2
        return np.array(
            [[1 / half, 0, (1 - width) / 2 / half], [0, 1 / half, (1 - height) / 2 / half], [0, 0, 1]]
        )

    @cached_property
    def steepest(self) -> Grey:
        """(8, H W) derivatives of the flat picture by the entries of a homography of centred coordinates."""
        height, width = self.picture.shape
        half = max(height, width) / 2
        y, x = (np.indices((height, width)) - (np.array([height, width]) - 1)[:, None, None] / 2) / half
        across, down = (
            half * cv2.Sobel(self.flat, cv2.CV_32F, *axis, scale=1 / 8) for axis in ((1, 0), (0, 1))
        )
        outwards = across * x + down * y
        rows = [across * x, across * y, across, down * x, down * y, down, -outwards * x, -outwards * y]
        return np.array(rows, dtype=np.float32).reshape(8, -1)

    @cached_property
    def inverse(self) -> FloatArray:
        """(8, 8) inverse of the normal equations over all pixels."""
        return np.asarray(
            np.linalg.pinv((self.steepest @ self.steepest.T).astype(np.float64)), dtype=np.float64
        )

    def pixels(self, plane: FloatArray) -> FloatArray:
        """Return where places (..., 2) of the plane, metres, are in the picture."""
        return (plane - self.low_m) * self.scale - 0.5


@lru_cache(maxsize=16)
def printed(target: Target) -> Printed:
    """Return the picture of a target.

    Raises
    ------
    InputError
        A family of targets that nobody has drawn.
    """
    pattern = pattern_of(target)
    pitch, scale = _measures(target)
    extent = pattern.high - pattern.low + 2 * MARGIN * pitch
    scale = min(scale, float(np.sqrt(LARGEST_PICTURE_PX / np.prod(extent))))
    # Squares and margin of whole pixels, so that samples have lines where they are; where the lines between
    # pixels are others for each tag, that averages out.
    if isinstance(target, Chessboard | Charuco):
        scale = max(np.rint(pitch * scale), 1.0) / pitch
    margin = np.ceil(MARGIN * pitch * scale) / scale
    low, high = pattern.low - margin, pattern.high + margin
    width, height = np.ceil((high - low) * scale).astype(int).tolist()
    y, x = np.indices((height * SAMPLES, width * SAMPLES), dtype=np.float64).reshape(2, -1)
    dark = pattern.is_dark((np.column_stack([x, y]) + 0.5) / (SAMPLES * scale) + low)
    shares = 1 - dark.reshape(height, SAMPLES, width, SAMPLES).mean(axis=(1, 3), dtype=np.float32)
    blurred = np.asarray(cv2.GaussianBlur(shares, (0, 0), BLUR_PX), dtype=np.float32)
    return Printed(blurred, low, scale, pitch)


def _measures(target: Target) -> tuple[float, float]:
    """Return the pitch in metres, and the pixels per metre that the details need."""
    if isinstance(target, Chessboard):
        return target.pitch_m, SQUARE_PX / target.pitch_m
    if isinstance(target, CircleGrid):
        return target.pitch_m, RADIUS_PX / target.radius_m
    if isinstance(target, Charuco):
        return target.square_m, BIT_PX / pattern_of(target).finest_m
    if isinstance(target, AprilGrid):
        pitch = target.tag_m * (1 + target.spacing_ratio)
        return pitch, BIT_PX / min(pattern_of(target).finest_m, target.tag_m / 8)
    size = float(np.ptp(target.points[:, :2], axis=0).max())
    return size, np.sqrt(LARGEST_PICTURE_PX) / size


def flattened(picture: Grey, side_px: int, floor: float) -> Grey:
    """Return a picture without the mean and the contrast of the surroundings of each pixel."""
    size = (side_px, side_px)
    mean = cv2.blur(picture, size)
    square = cv2.sqrBoxFilter(picture, cv2.CV_32F, size)
    contrast = np.sqrt(np.maximum(square - mean * mean, 0) + np.float32(floor * floor))
    return np.asarray((picture - mean) / contrast, dtype=np.float32)


@dataclass(frozen=True, eq=False)
class Lens:
    """A map from the plane of a target to pixels: a homography, and what a lens adds to it.

    Attributes
    ----------
    homography
        (3, 3).
    low_m, high_m
        (2,) corners of the places from which the rest is known.
    coefficients
        (10, 2) of the powers of places in this box, up to the third.
    """

    homography: FloatArray
    low_m: FloatArray
    high_m: FloatArray
    coefficients: FloatArray

    @classmethod
    def fitted(cls, plane: FloatArray, pixels: FloatArray) -> "Lens | None":
        """Return the map that fits places (N, 2) and pixels (N, 2) best; None where there is none."""
        size = float(np.ptp(plane, axis=0).max())
        H, _ = cv2.findHomography(plane / size, pixels, 0)
        # OpenCV gives None where no homography fits, whatever its types say.
        if H is None or not np.isfinite(H).all():  # pyright: ignore[reportUnnecessaryComparison]
            return None
        homography = np.asarray(H, dtype=np.float64) @ np.diag([1 / size, 1 / size, 1.0])
        low, high = plane.min(axis=0), plane.max(axis=0)
        rest = cls(homography, low, high, np.zeros((10, 2)))
        if len(plane) < FEWEST_FOR_LENS or (high <= low).any():
            return rest
        powers = rest._powers(plane)
        normal = powers.T @ powers + 1e-6 * len(plane) * np.eye(10)
        off = powers.T @ (pixels - mapped(homography, plane))
        return cls(homography, low, high, np.asarray(np.linalg.solve(normal, off), dtype=np.float64))

    def pixels(self, plane: FloatArray) -> FloatArray:
        """Return where places (N, 2) of the plane are in the image."""
        return mapped(self.homography, plane) + self._powers(plane) @ self.coefficients

    def steps(self, plane: FloatArray, half_m: float) -> FloatArray:
        """Return the pixels (N, 2, 2) per metre along each axis at places (N, 2), from both sides of them."""
        ends = (plane[:, np.newaxis] + sign * half_m * np.eye(2) for sign in (1, -1))
        there = (self.pixels(end.reshape(-1, 2)).reshape(-1, 2, 2) for end in ends)
        return np.subtract(*there) / (2 * half_m)

    def _powers(self, plane: FloatArray) -> FloatArray:
        inside = (2 * plane - self.low_m - self.high_m) / (self.high_m - self.low_m)
        # Far outside it is not known: there it stays as it is.
        x, y = (inside / (1 + (inside / 2) ** 4) ** 0.25).T
        return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3])


@dataclass(frozen=True, eq=False)
class Aligned:
    """A board found in an image.

    Attributes
    ----------
    printed
        Its picture.
    lens
        The map that was expected.
    shift
        (3, 3) homography from the picture's pixels to where the map has to be asked instead, in those pixels.
    squared
        (H, W) the image as the picture shows it, grey values.
    around
        The same with the surroundings, light where the picture is light.
    origin_px
        Pixel of the surroundings at which the picture would begin without the shift.
    """

    printed: Printed
    lens: Lens
    shift: FloatArray
    squared: Grey
    around: Image
    origin_px: int

    def places(self, plane: FloatArray) -> FloatArray:
        """Return where places (..., 2) of the plane of the target are in the image, in pixels."""
        board = self.printed
        asked = mapped(self.shift, board.pixels(plane).reshape(-1, 2))
        return self.lens.pixels((asked + 0.5) / board.scale + board.low_m).reshape(plane.shape)

    def steps(self, plane: FloatArray) -> FloatArray:
        """Return the pixels (N, 2, 2) per metre along each of the plane's axes at places (N, 2)."""
        half = 0.1 * self.printed.pitch_m
        ends = (self.places(plane[:, np.newaxis] + sign * half * np.eye(2)) for sign in (1, -1))
        return np.subtract(*ends) / (2 * half)

    def seen(self, plane: FloatArray) -> Grey:
        """Return the grey values (...) at places (..., 2) of the plane, light where paper should be."""
        asked = mapped(self.shift, self.printed.pixels(plane).reshape(-1, 2)) + self.origin_px
        return _sampled(self.around, asked).reshape(plane.shape[:-1])

    def drawn(self, plane: FloatArray) -> Grey:
        """Return what the picture has at places (..., 2) of the plane, 0 for ink and 1 for paper."""
        asked = self.printed.pixels(plane).reshape(-1, 2)
        return _sampled(self.printed.picture, asked).reshape(plane.shape[:-1])

    @cached_property
    def _likeness(self) -> Grey:
        board = self.printed
        # A window of one pitch.
        size = (round(board.pitch_m * board.scale) | 1,) * 2
        flat = flattened(self.squared, board.light_px, GREY_FLOOR)
        common = cv2.blur(flat * board.flat, size)
        own = cv2.sqrBoxFilter(flat, cv2.CV_32F, size) * cv2.sqrBoxFilter(board.flat, cv2.CV_32F, size)
        return np.asarray(common / np.sqrt(np.maximum(own, 1e-6)), dtype=np.float32)

    def likeness(self, plane: FloatArray) -> Grey:
        """Return how well image and picture agree, -1 to 1, one pitch around places (N, 2) of the plane."""
        height, width = self.printed.picture.shape
        column, row = np.rint(self.printed.pixels(plane)).astype(int).T
        return self._likeness[row.clip(0, height - 1), column.clip(0, width - 1)]


def aligned(
    image: Image, target: Target, plane: FloatArray, pixels: FloatArray, margin_px: float
) -> Aligned | None:
    """Return where a target lies whose places (N, 2) are expected at pixels (N, 2), give or take a margin.

    None where it is not there. What is found is not yet proved to be that target: a grid may be a line off,
    a marker may be another one, and what is hidden is not known.
    """
    lens = Lens.fitted(plane, pixels)
    if lens is None:
        return None
    board = printed(target)
    height, width = board.picture.shape
    corners = board.low_m + np.array([[0, 0], [width, 0], [width, height], [0, height]]) / board.scale
    scales = _scales(lens.homography, corners)
    if scales is None:
        return None
    reach = int(np.ceil(min(margin_px * board.scale / scales[0], 4.0 * max(height, width))))
    aside = reach + int(np.ceil(SURROUNDINGS * board.pitch_m * board.scale))
    around, inside = _squared(image, board, lens, aside, board.scale / scales[1])
    if around is None:
        return None
    search = around[aside - reach : aside + reach + height, aside - reach : aside + reach + width]
    picture = np.rint(255 * board.picture).astype(np.uint8)
    least, most, least_at, most_at = cv2.minMaxLoc(cv2.matchTemplate(search, picture, cv2.TM_CCOEFF_NORMED))
    if isinstance(target, CircleGrid) and -least > most:
        # Light circles on a dark board.
        around, most, most_at = 255 - around, -least, least_at
    if not most >= LEAST_CORRELATION:
        return None
    start = np.eye(3)
    start[:2, 2] = np.array(most_at) - reach
    shift, squared = _least_squares(board, around, inside, aside, start)
    if not np.isfinite(shift).all() or np.linalg.det(shift[:2, :2]) <= 0:
        return None
    return Aligned(board, lens, shift, squared, around, aside)


def _scales(homography: FloatArray, corners: FloatArray) -> tuple[float, float] | None:
    """Return the least and the largest pixels per metre; None for a board from behind or edge on."""
    depth = corners @ homography[2, :2] + homography[2, 2]
    if not (depth > 0.1 * depth.max()).all():
        return None
    image = mapped(homography, corners)
    J = (homography[:2, :2] - image[:, :, np.newaxis] * homography[2, :2]) / depth[:, None, None]
    if not np.isfinite(J).all() or not (J[:, 0, 0] * J[:, 1, 1] > J[:, 0, 1] * J[:, 1, 0]).all():
        return None
    values = np.linalg.svd(J, compute_uv=False)
    return (float(values.min()), float(values.max())) if values.min() > 0 else None


def _squared(
    image: Image, board: Printed, lens: Lens, aside: int, reduction: float
) -> tuple[Image | None, Grey | None]:
    """Return the image as the picture would show it, and which of it is in the image, None for all."""
    height, width = np.array(board.picture.shape) + 2 * aside
    # The map is smooth: asked at a few places, it is interpolated between.
    (x, across), (y, down) = _interpolation(width), _interpolation(height)
    nodes = (np.stack(np.meshgrid(x, y), axis=-1) - aside + 0.5) / board.scale + board.low_m
    found = lens.pixels(nodes.reshape(-1, 2)).reshape(nodes.shape)
    u, v = (down @ found[..., i].astype(np.float32) @ across.T for i in range(2))
    last = np.array(image.shape[::-1]) - 1.0
    least, most = np.array([u.min(), v.min()]), np.array([u.max(), v.max()])
    low = np.clip(np.floor(least) - 2, 0, last).astype(int)
    high = np.clip(np.ceil(most) + 3, 0, last + 1).astype(int)
    if (high - low < SMALLEST_PX).any():
        return None, None
    # Averages over whole squares of pixels are quick.
    factor = max(1, int(1 / reduction))
    size = (high - low) // factor
    cut = image[low[1] : low[1] + factor * size[1], low[0] : low[0] + factor * size[0]]
    small = cv2.resize(cut, size.tolist(), interpolation=cv2.INTER_AREA) if factor > 1 else cut
    start = (0.5 - low) / factor - 0.5
    seen = cv2.remap(
        small,
        u / np.float32(factor) + np.float32(start[0]),
        v / np.float32(factor) + np.float32(start[1]),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=OUTSIDE,
    )
    inside = None
    if not ((least >= 0) & (most <= last)).all():
        inside = ((u >= 0) & (v >= 0) & (u <= last[0]) & (v <= last[1])).astype(np.float32)
    return np.asarray(seen, dtype=np.uint8), inside


@lru_cache(maxsize=64)
def _interpolation(count: int) -> tuple[FloatArray, Grey]:
    """Return places among so many pixels, and the matrix from values there to those at all pixels."""
    to_unit = 2 / max(count - 1, 1)
    places = (1 - np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)) / to_unit
    at_nodes = np.polynomial.chebyshev.chebvander(places * to_unit - 1, NODES - 1)
    everywhere = np.polynomial.chebyshev.chebvander(np.arange(count) * to_unit - 1, NODES - 1)
    return places, np.asarray(everywhere @ np.linalg.inv(at_nodes), dtype=np.float32)


def _least_squares(
    board: Printed, around: Image, inside: Grey | None, aside: int, start: FloatArray
) -> tuple[FloatArray, Grey]:
    """Return the homography from the picture to the surroundings without their margin, and what is there."""
    height, width = board.picture.shape
    to_around = np.array([[1.0, 0, aside], [0, 1, aside], [0, 0, 1]])
    centring = board.centring
    back = np.linalg.inv(centring)
    steepest, inverse = board.steepest, board.inverse
    if inside is not None:
        weights = cv2.warpPerspective(inside, to_around @ start, (width, height), flags=_WARP)
        steepest = steepest * weights.reshape(1, -1)
        inverse = np.linalg.pinv(steepest @ board.steepest.T)
    shift = start
    for _ in range(MAX_ITERATIONS):
        squared = _warped(around, to_around @ shift, (width, height))
        residual = flattened(squared, board.light_px, GREY_FLOOR) - board.flat
        step = inverse @ (steepest @ residual.ravel())
        moved = np.eye(3) + np.append(step, 0.0).reshape(3, 3)
        try:
            shift = shift @ back @ np.linalg.inv(moved) @ centring
        except np.linalg.LinAlgError:
            return np.full((3, 3), np.nan), squared
        if not np.abs(step).max() * max(height, width) / 2 >= STEP_TOLERANCE_PX:
            break
    return shift, _warped(around, to_around @ shift, (width, height))


def _warped(image: Image, to_image: FloatArray, size: tuple[int, int]) -> Grey:
    warped = cv2.warpPerspective(
        image, to_image, size, flags=_WARP, borderMode=cv2.BORDER_CONSTANT, borderValue=OUTSIDE
    )
    return np.asarray(warped, dtype=np.float32)


def _sampled(picture: Image | Grey, places: FloatArray) -> Grey:
    x, y = places.astype(np.float32).T[:, :, np.newaxis]
    found = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found, dtype=np.float32).reshape(-1)
