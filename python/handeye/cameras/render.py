"""Pictures of a target through a lens, by rays.

A pixel's grey value is the mean over its square of what the lens sees there: rays of the true inverse of the
lens model go through its corners to the plane of the target, and pixels through which an edge passes are
sampled many times. Nothing is resampled, so edges are where geometry puts them, to a few thousandths of a
pixel.
"""

from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.codes import Code
from handeye.errors import InputError
from handeye.pattern import Mask, Pattern
from handeye.types import Camera, Pose, Target
from handeye.types.arrays import FloatArray

Image = NDArray[np.uint8]
# Pixels sampled at a time: bounds the memory.
_CHUNK = 20_000
# Points along each edge of the board that say where in the picture it is, and pixels around it.
_EDGE_POINTS, _AROUND_PX = 33, 4


@dataclass(frozen=True)
class Appearance:
    """How a picture looks.

    Parameters
    ----------
    dark, light, background
        Grey values of ink, board and everything else, 0 to 255; the background may be an image (H, W).
    margin_m
        Width of the light margin around the print; None for a tenth of the print.
    gradient
        Change of the light across the image, as a share of its mean, to the right and downwards.
    blur_px
        Standard deviation of a Gaussian blur.
    noise
        Standard deviation of the noise, in grey values.
    supersampling
        Samples along each side of a pixel that an edge passes through.

    Examples
    --------
    >>> Appearance(blur_px=0.7, noise=2.0).supersampling
    8
    """

    dark: float = 25.0
    light: float = 215.0
    background: float | Image = 110.0
    margin_m: float | None = None
    gradient: tuple[float, float] = (0.0, 0.0)
    blur_px: float = 0.0
    noise: float = 0.0
    supersampling: int = 8


@dataclass
class BoardRenderer:
    """Renders one target through one camera; the rays of the pixels are computed once.

    Parameters
    ----------
    camera
        Whose picture it is.
    target
        What is seen.
    appearance
        Grey values, blur, noise.

    Raises
    ------
    InputError
        A background that is not of the camera's size.

    Examples
    --------
    >>> pose = measurements.poses[0].T_camera_target
    >>> BoardRenderer(camera, board, Appearance(supersampling=1)).image(pose).shape == camera.size_px[::-1]
    True
    """

    camera: Camera
    target: Target
    appearance: Appearance = field(default_factory=Appearance)

    def __post_init__(self) -> None:
        """Trace the rays."""
        width, height = self.camera.size_px
        look = self.appearance
        if isinstance(look.background, np.ndarray) and look.background.shape != (height, width):
            raise InputError(
                f"background: shape {look.background.shape}, expected {(height, width)}",
                code=Code.WRONG_SHAPE,
            )
        self._pattern = Pattern(self.target)
        span = self._pattern.high - self._pattern.low
        margin = 0.1 * float(span.max()) if look.margin_m is None else look.margin_m
        self._low, self._high = self._pattern.low - margin, self._pattern.high + margin
        self._rays = _rays(self.camera)

    def image(self, T_camera_target: Pose, random: np.random.Generator | None = None) -> Image:
        """Return the picture (H, W) of the target in a pose.

        Parameters
        ----------
        T_camera_target
            The pose.
        random
            Source of the noise; needed if there is noise.

        Raises
        ------
        InputError
            Noise without a source.
        """
        look = self.appearance
        if look.noise > 0 and random is None:
            raise InputError("noise needs a random generator", code=Code.INVALID_FIELD)
        width, height = self.camera.size_px
        rows, columns = self._region(T_camera_target)
        board, ink = self._shares(T_camera_target, rows, columns)
        grey = np.empty((height, width))
        grey[:] = look.background
        grey[rows, columns] = grey[rows, columns] * (1 - board) + look.light * (board - ink) + look.dark * ink
        if look.gradient != (0.0, 0.0):
            grey = grey * _light(grey.shape, look.gradient)
        if look.blur_px > 0:
            grey = cv2.GaussianBlur(grey, (0, 0), look.blur_px, borderType=cv2.BORDER_REPLICATE)
        if random is not None and look.noise > 0:
            grey = grey + random.normal(scale=look.noise, size=grey.shape)
        return np.rint(np.clip(grey, 0, 255)).astype(np.uint8)

    def _region(self, T_camera_target: Pose) -> tuple[slice, slice]:
        """Return the rows and columns that the board may be in; all of them where part of it is behind."""
        width, height = self.camera.size_px
        s = np.linspace(0, 1, _EDGE_POINTS)
        zero, one = np.zeros_like(s), np.ones_like(s)
        round_about = np.concatenate(
            [np.column_stack(side) for side in ((s, zero), (s, one), (zero, s), (one, s))]
        )
        edge = np.zeros((len(round_about), 3))
        edge[:, :2] = self._low + round_about * (self._high - self._low)
        pixels, seen = self.camera.project(T_camera_target.act(edge))
        if not seen.all():
            return slice(0, height), slice(0, width)
        low = np.floor(pixels.min(axis=0)).astype(int) - _AROUND_PX
        high = np.ceil(pixels.max(axis=0)).astype(int) + 1 + _AROUND_PX
        (left, top), (right, bottom) = low.clip(0).tolist(), high.clip(0, [width, height]).tolist()
        return slice(min(top, bottom), bottom), slice(min(left, right), right)

    def _shares(self, T_camera_target: Pose, rows: slice, columns: slice) -> tuple[FloatArray, FloatArray]:
        """Return the shares (H, W) of the area of every pixel of a region that show the board, and ink."""
        corners = self._plane(
            T_camera_target, self._rays[rows.start : rows.stop + 1, columns.start : columns.stop + 1]
        )
        height, width = corners.shape[0] - 1, corners.shape[1] - 1
        on_board, dark = (part.reshape(corners.shape[:2]) for part in self._look(corners.reshape(-1, 2)))
        board, ink = _mean_of_corners(on_board), _mean_of_corners(dark)
        finite = np.isfinite(corners[..., 0])
        whole = _mean_of_corners(finite) == 1
        mixed = whole & ((board % 1 != 0) | (ink % 1 != 0) | self._is_coarse(corners, board))
        some = np.nonzero(mixed)
        for start in range(0, len(some[0]), _CHUNK):
            part = some[0][start : start + _CHUNK], some[1][start : start + _CHUNK]
            board[part], ink[part] = self._sample(corners, *part)
        board[~whole] = ink[~whole] = 0.0
        return board.reshape(height, width), ink.reshape(height, width)

    @staticmethod
    def _plane(T_camera_target: Pose, rays: FloatArray) -> FloatArray:
        """Return where (H, W, 2) rays (H, W, 3) meet the plane of the target; NaN where they do not."""
        T_target_camera = T_camera_target.inverse().matrix
        eye = T_target_camera[:3, 3]
        if eye[2] >= 0:  # behind the board
            return np.full((*rays.shape[:2], 2), np.nan)
        direction = rays @ T_target_camera[:3, :3].T
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = -eye[2] / direction[:, :, 2]
            plane = eye[:2] + distance[:, :, np.newaxis] * direction[:, :, :2]
        plane[~(distance > 0)] = np.nan
        return plane

    def _look(self, plane: FloatArray) -> tuple[Mask, Mask]:
        """Tell which places (N, 2) are on the board, and which are dark."""
        with np.errstate(invalid="ignore"):
            x, y = plane.T
            (left, top), (right, bottom) = self._low, self._high
            on_board = (x >= left) & (x <= right) & (y >= top) & (y <= bottom)
        dark = np.zeros(len(plane), dtype=bool)
        dark[on_board] = self._pattern.is_dark(plane[on_board])
        return on_board, dark

    def _is_coarse(self, corners: FloatArray, board: FloatArray) -> Mask:
        """Tell which pixels of the board might swallow a detail between their corners."""
        with np.errstate(invalid="ignore"):
            diagonals = np.abs([corners[1:, 1:] - corners[:-1, :-1], corners[1:, :-1] - corners[:-1, 1:]])
            longest = np.maximum(diagonals[..., 0], diagonals[..., 1]).max(axis=0)
            return (board > 0) & (longest > 0.4 * self._pattern.finest_m)

    def _sample(
        self, corners: FloatArray, rows: NDArray[np.int64], columns: NDArray[np.int64]
    ) -> tuple[FloatArray, FloatArray]:
        """Return the shares (N,) of board and ink in some pixels."""
        n = self.appearance.supersampling
        across = (np.arange(n) + 0.5) / n
        s, t = (axis.ravel()[:, np.newaxis] for axis in np.meshgrid(across, across))
        # Within one pixel lens and perspective are linear to far below a thousandth of a pixel.
        plane = (
            corners[rows, columns][:, np.newaxis] * ((1 - s) * (1 - t))
            + corners[rows, columns + 1][:, np.newaxis] * (s * (1 - t))
            + corners[rows + 1, columns][:, np.newaxis] * ((1 - s) * t)
            + corners[rows + 1, columns + 1][:, np.newaxis] * (s * t)
        )
        on_board, dark = self._look(plane.reshape(-1, 2))
        return on_board.reshape(-1, n * n).mean(axis=1), dark.reshape(-1, n * n).mean(axis=1)


def render(
    camera: Camera,
    target: Target,
    T_camera_target: Pose,
    appearance: Appearance | None = None,
    *,
    random: np.random.Generator | None = None,
) -> Image:
    """Return one picture (H, W) of a target; for several, keep a `BoardRenderer`.

    Parameters
    ----------
    camera
        Whose picture it is.
    target
        What is seen.
    T_camera_target
        Where the target is in the camera frame, metres.
    appearance
        Grey values, blur, noise.
    random
        Chance of the noise; needed where there is some.

    Raises
    ------
    InputError
        As `BoardRenderer` and its `image`.

    Examples
    --------
    >>> pose = measurements.poses[0].T_camera_target
    >>> render(camera, board, pose, Appearance(supersampling=1)).dtype
    dtype('uint8')
    """
    return BoardRenderer(camera, target, appearance or Appearance()).image(T_camera_target, random)


def clutter(width_px: int, height_px: int, random: np.random.Generator, *, shapes: int = 150) -> Image:
    """Return a background (H, W) full of boxes and ellipses of all sizes and greys.

    Parameters
    ----------
    width_px, height_px
        Size of the image.
    random
        Chance.
    shapes
        Number of boxes and ellipses.

    Examples
    --------
    >>> clutter(64, 48, np.random.default_rng(0)).shape
    (48, 64)
    """
    image = np.full((height_px, width_px), 110, dtype=np.uint8)
    for _ in range(shapes):
        centre = random.uniform(0, [width_px, height_px])
        size = random.uniform(0.005, 0.12, 2) * max(width_px, height_px)
        angle, grey = float(random.uniform(0, 180)), float(random.uniform(10, 240))
        box = ((float(centre[0]), float(centre[1])), (float(size[0]), float(size[1])), angle)
        if random.uniform() < 0.5:
            cv2.ellipse(image, box, grey, -1, cv2.LINE_AA)
        else:
            corners = np.rint(cv2.boxPoints(box)).astype(np.int32)
            cv2.fillConvexPoly(image, corners, grey, cv2.LINE_AA)
    return image


@lru_cache(maxsize=2)
def _rays(camera: Camera) -> FloatArray:
    """Return the rays (H + 1, W + 1, 3) through the corners of all pixels, to be looked at only."""
    width, height = camera.size_px
    u, v = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
    rays, _ = camera.unproject(np.column_stack([u.ravel(), v.ravel()]))
    return rays.reshape(height + 1, width + 1, 3)


def _mean_of_corners(values: Mask) -> FloatArray:
    """Return the mean (H, W) over the four corners (H + 1, W + 1) of each pixel."""
    grey = values.astype(np.float64)
    return (grey[:-1, :-1] + grey[:-1, 1:] + grey[1:, :-1] + grey[1:, 1:]) / 4


def _light(shape: tuple[int, ...], gradient: tuple[float, float]) -> FloatArray:
    """Return the light (H, W) that changes across the image, with mean one."""
    height, width = shape[:2]
    right = np.linspace(-0.5, 0.5, width) * gradient[0]
    down = np.linspace(-0.5, 0.5, height) * gradient[1]
    return 1 + right + down[:, np.newaxis]


__all__ = ["Appearance", "BoardRenderer", "Image", "Pattern", "clutter", "render"]
