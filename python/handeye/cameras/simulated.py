"""A camera that renders the target, or projects its points, from where the simulated arm truly stands."""

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from handeye import _core
from handeye.cameras.protocol import Frame, Grey, Points
from handeye.cameras.render import Appearance, BoardRenderer
from handeye.codes import Code
from handeye.errors import InputError
from handeye.types import Camera, Pose, Target


@dataclass(frozen=True)
class Optics:
    """How a simulated picture comes about.

    Parameters
    ----------
    appearance
        Greys, light, blur, noise.
    exposure
        Factor on the grey values before they are clipped at white.
    occluded_share
        Share of the pictures in which something dark lies over a part of the target.
    points_only
        Sigma in px of points that are projected instead of found in a picture; None to render. Points lie
        inside the image as a whole or not at all: a view without the whole target shows nothing.

    Raises
    ------
    InputError
        A value out of its range.
    """

    appearance: Appearance = field(default_factory=lambda: Appearance(blur_px=0.6, noise=2.0))
    exposure: float = 1.0
    occluded_share: float = 0.0
    points_only: float | None = None

    def __post_init__(self) -> None:
        if not self.exposure > 0 or not 0 <= self.occluded_share <= 1:
            raise InputError("optics: exposure above zero and a share from 0 to 1", code=Code.OUT_OF_RANGE)


class SimulatedCamera:
    """Sees the target through a camera model; chance depends on the seed and the label of the picture alone.

    Parameters
    ----------
    camera
        The true camera.
    target
        What it looks at.
    standing_at
        Gives the true `T_camera_target`.
    optics
        How the picture comes about.
    seed
        Of the noise.
    """

    def __init__(
        self,
        camera: Camera,
        target: Target,
        standing_at: Callable[[], Pose],
        optics: Optics | None = None,
        seed: int = 0,
    ) -> None:
        self._camera = camera
        self._target = target
        self._standing_at = standing_at
        self._optics = optics or Optics()
        self._seed = seed
        self._renderer: BoardRenderer | None = None

    def grab(self, label: str) -> Frame:
        """Return the picture, or the points, from where the arm stands."""
        random = np.random.default_rng([self._seed, 3, zlib.crc32(label.encode())])
        pose = self._standing_at()
        if self._optics.points_only is not None:
            return self._points(pose, self._optics.points_only, random)
        return Frame(self._picture(pose, random))

    def _points(self, pose: Pose, sigma_px: float, random: np.random.Generator) -> Frame:
        camera = self._camera
        points = self._target.points
        pixels, seen = _core.project_features(
            camera.lens, camera.parameters, pose.matrix, points, self._target.radii_m
        )
        noisy = pixels + sigma_px * random.standard_normal(pixels.shape)
        from_behind = float(pose.rotation[:, 2] @ pose.translation) < 0
        with np.errstate(invalid="ignore"):
            inside = seen & ((noisy > 0) & (noisy < np.array(camera.size_px) - 1)).all(axis=1)
        ids = np.arange(len(points) if inside.all() and not from_behind else 0, dtype=np.int64)
        return Frame(None, Points(ids, noisy[ids]))

    def _picture(self, pose: Pose, random: np.random.Generator) -> Grey:
        if self._renderer is None:
            self._renderer = BoardRenderer(self._camera, self._target, _exposed(self._optics))
        picture = self._renderer.image(pose, random)
        if random.uniform() < self._optics.occluded_share:
            return occluded(picture, random)
        return picture


def occluded(picture: Grey, random: np.random.Generator) -> Grey:
    """Return a picture with a dark bar, such as a cable, across it."""
    height, width = picture.shape
    ends = random.uniform([0.25, 0.25], [0.75, 0.75], (2, 2)) * [width, height]
    (u0, v0), (u1, v1) = np.rint(ends).astype(int).tolist()
    covered = picture.copy()
    cv2.line(covered, (u0, v0), (u1, v1), 40, max(2, width // 25))
    return covered


def _exposed(optics: Optics) -> Appearance:
    look, factor = optics.appearance, optics.exposure
    if factor == 1.0:
        return look
    background = look.background
    if isinstance(background, np.ndarray):
        background = np.clip(np.rint(background * factor), 0, 255).astype(np.uint8)
    else:
        background = background * factor
    return replace(look, dark=look.dark * factor, light=look.light * factor, background=background)
