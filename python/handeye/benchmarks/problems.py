"""The problems that all methods are given: a planar board before a camera in a robot's hand.

Boards of points 30 mm apart, seen from 0.4 to 0.8 m under up to 40 degrees, all points in the image of
1280 x 1024 pixels; the robot exact; pixel noise of 0.2 px per axis; starts off by degrees and centimetres.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from handeye import _core
from handeye.types.arrays import FloatArray, IndexArray

SIZE_PX = (1280, 1024)
SIGMA_PX = 0.2
PITCH_M = 0.03
LARGEST_BOARD_M = 0.3
LENSES = {
    "pinhole": (1400.0, 1400.0, 640.0, 512.0),
    "brown_conrady_5": (1400.0, 1400.0, 640.0, 512.0, -0.1, 0.05, 0.001, -0.0005, 0.01),
}
BATCH = 20_000


@dataclass(frozen=True, eq=False)
class Cell:
    """Views of a board, and truth and start of the chain ``T_camera_target[k] = X @ motions[k] @ Y``.

    Parameters
    ----------
    points
        (P, 3) points of the board, metres.
    motions
        (K, 4, 4) A of the chain.
    pixels
        (K, P, 2) measured.
    """

    lens: str
    parameters: FloatArray
    points: FloatArray
    X: FloatArray
    Y: FloatArray
    motions: FloatArray
    pixels: FloatArray
    X_start: FloatArray
    Y_start: FloatArray

    @property
    def views(self) -> int:
        """Number of views."""
        return len(self.motions)

    def problem(self) -> _core.Problem:
        """Return the problem as the core takes it."""
        points, radii, pixels, offsets = self._measured
        return _core.Problem(self.lens, self.parameters, points, radii, pixels, offsets, self.motions)

    @cached_property
    def _measured(self) -> tuple[FloatArray, FloatArray, FloatArray, IndexArray]:
        P, K = len(self.points), self.views
        points = np.tile(self.points, (K, 1))
        return points, np.zeros(K * P), self.pixels.reshape(-1, 2), np.arange(0, K * P + 1, P)

    def model(self) -> _core.Model:
        """Return the assumptions: the robot exact, one pixel noise."""
        return _core.Model(self._sigmas_px)

    @cached_property
    def _sigmas_px(self) -> FloatArray:
        return np.full(self.views, SIGMA_PX)


def board(points: int) -> FloatArray:
    """(P, 3) points of a board of about as many rows as columns."""
    rows = max(row for row in range(1, int(np.sqrt(points)) + 1) if points % row == 0)
    columns = points // rows
    pitch = min(PITCH_M, LARGEST_BOARD_M / columns)
    grid = np.mgrid[0:rows, 0:columns].reshape(2, -1).T
    return np.column_stack([grid[:, 1] * pitch, grid[:, 0] * pitch, np.zeros(points)])


def make_cell(lens: str, views: int, points: int, seed: int) -> Cell:
    """Return a cell, the same for the same seed."""
    random = np.random.default_rng([seed, views, points])
    parameters = np.array(LENSES[lens])
    target = board(points)
    X = _core.se3_exp(random.uniform(-1, 1, (1, 6)) * [0.1, 0.1, 0.1, 1, 1, 1])[0]
    Y = _core.se3_exp(random.uniform(-1, 1, (1, 6)))[0]
    poses = _poses(random, lens, parameters, target, views)
    pixels = np.array(
        [_core.project_features(lens, parameters, T, target, np.zeros(points))[0] for T in poses]
    )
    pixels += SIGMA_PX * random.standard_normal(pixels.shape)
    off = _core.se3_exp(random.standard_normal((2, 6)) * ([0.02] * 3 + [0.05] * 3))
    return Cell(lens, parameters, target, X, Y, _motions(X, Y, poses), pixels, off[0] @ X, off[1] @ Y)


def candidates(cell: Cell, count: int, seed: int) -> FloatArray:
    """(N, 4, 4) motions of candidates that show all of the board at the true X and Y."""
    random = np.random.default_rng([seed, count, len(cell.points)])
    found = np.empty((count, 4, 4))
    for first in range(0, count, BATCH):
        number = min(BATCH, count - first)
        poses = _poses(random, cell.lens, cell.parameters, cell.points, number)
        found[first : first + number] = _motions(cell.X, cell.Y, poses)
    return found


def _motions(X: FloatArray, Y: FloatArray, poses: FloatArray) -> FloatArray:
    motions: FloatArray = np.linalg.inv(X) @ poses @ np.linalg.inv(Y)
    return motions


def _poses(
    random: np.random.Generator, lens: str, parameters: FloatArray, target: FloatArray, count: int
) -> FloatArray:
    """(N, 4, 4) `T_camera_target` that show all points."""
    kept: list[FloatArray] = []
    centre = target.mean(axis=0)
    outline = target[_outline(target)]
    while sum(len(poses) for poses in kept) < count:
        number = count + 16
        twists = np.zeros((number, 6))
        twists[:, 3:5] = random.uniform(-0.5, 0.5, (number, 2))
        twists[:, 5] = random.uniform(-1.5, 1.5, number)
        poses = _core.se3_exp(twists)
        poses[:, :3, 3] = -poses[:, :3, :3] @ centre
        poses[:, :2, 3] += random.uniform(-0.05, 0.05, (number, 2))
        poses[:, 2, 3] += random.uniform(0.4, 0.8, number)
        seen = poses[:, None, :3, :3] @ outline[None, :, :, None]
        uv, valid = _core.project(lens, parameters, (seen[..., 0] + poses[:, None, :3, 3]).reshape(-1, 3))
        inside = valid & (uv >= 0).all(axis=1) & (uv <= np.array(SIZE_PX) - 1.0).all(axis=1)
        kept.append(poses[inside.reshape(number, -1).all(axis=1)])
    return np.concatenate(kept)[:count]


def _outline(target: FloatArray) -> list[int]:
    """Indices of the corners of the board: where they are in the image, all of it is."""
    x, y = target[:, 0], target[:, 1]
    return [int(np.argmin(sign_x * x + sign_y * y)) for sign_x in (1, -1) for sign_y in (1, -1)]
