"""Folders as users have them, with known truth: recordings, and pictures of a chessboard with robot poses."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from cells import Cell
from handeye.datasets import write_recording
from handeye.types import Camera, Chessboard, Mounting, Pose, Recording, Truth

PICTURE_BOARD = Chessboard(5, 7, 0.03)
PICTURE_CAMERA = Camera("pinhole", [620, 620, 319.5, 239.5], 640, 480)


def made_cell(seed: int = 3, mounting: Mounting = Mounting.EYE_IN_HAND) -> Cell:
    """A cell with a generic truth."""
    return Cell(np.random.default_rng(seed), mounting)


def made_recording(
    count: int = 8, *, seed: int = 3, mounting: Mounting = Mounting.EYE_IN_HAND, sigma_px: float = 0.1
) -> Recording:
    """A recording of a made-up cell, corners with noise, robot exact."""
    cell = made_cell(seed, mounting)
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(count)], sigma_px=sigma_px)
    truth = Truth(cell.X, cell.Y)
    return Recording("made", mounting, cell.camera, cell.target, tuple(views), truth, "made up by the tests")


def parallel_recording(count: int = 6) -> Recording:
    """A recording whose rotations all share one axis of the robot's base."""
    cell = made_cell()
    seen = cell.look(0.1, 0.1)
    # The camera turns about the normal of the board that it looks at, which stands still in the base.
    turns = [Pose.exp([0, 0, 0, 0, 0, angle]) for angle in np.linspace(-0.8, 0.8, count)]
    middle = Pose.exp([*-np.mean(cell.target.points, axis=0), 0, 0, 0])
    poses = [cell.robot_pose(seen @ middle.inverse() @ turn @ middle) for turn in turns]
    views = cell.views(poses, sigma_px=0.05)
    return Recording("parallel", cell.mounting, cell.camera, cell.target, tuple(views))


def written(recording: Recording, folder: Path) -> Path:
    """The folder of a recording, written."""
    write_recording(recording, folder)
    return folder


def picture(T_camera_target: Pose, supersampling: int = 3) -> NDArray[np.uint8]:
    """A picture of `PICTURE_BOARD` through `PICTURE_CAMERA`: grey table, white margin, black squares."""
    rows, columns, pitch = PICTURE_BOARD.rows, PICTURE_BOARD.columns, PICTURE_BOARD.pitch_m
    texels = 40  # per square
    squares = np.indices((rows + 1, columns + 1)).sum(axis=0) % 2
    texture = np.kron(np.where(squares == 0, 20, 235), np.ones((texels, texels))).astype(np.uint8)
    texture = cv2.copyMakeBorder(texture, texels, texels, texels, texels, cv2.BORDER_CONSTANT, value=235)
    # Texel centres to metres: the first inner corner is the edge between texels 2 texels - 1 and 2 texels.
    to_metres = np.array(
        [[pitch / texels, 0, -pitch * (2 - 0.5 / texels)], [0, pitch / texels, -pitch * (2 - 0.5 / texels)], [0, 0, 1]]
    )  # fmt: skip
    pose = T_camera_target.matrix
    to_pixels = PICTURE_CAMERA.matrix @ np.column_stack([pose[:3, 0], pose[:3, 1], pose[:3, 3]])
    s = supersampling
    finer = np.array([[s, 0, (s - 1) / 2], [0, s, (s - 1) / 2], [0, 0, 1]])
    width, height = PICTURE_CAMERA.size_px
    large = cv2.warpPerspective(
        texture,
        finer @ to_pixels @ to_metres,
        (width * s, height * s),
        flags=cv2.INTER_AREA,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(120,),
    )
    small = cv2.resize(large, (width, height), interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(1).normal(0, 1.5, small.shape)
    return np.clip(np.rint(small + noise), 0, 255).astype(np.uint8)


def photographed(folder: Path, count: int = 8, seed: int = 4) -> tuple[Path, Pose]:
    """A folder in the layout of rwhe-calib with `count` pictures, and its true `T_camera_flange`."""
    random = np.random.default_rng(seed)
    X = Pose.exp([0.03, -0.08, 0.05, 0.3, -0.2, 1.4])
    Y = Pose.exp([0.6, 0.1, 0.05, 0.2, -0.1, 0.6])
    middle = np.mean(PICTURE_BOARD.points, axis=0)
    folder.mkdir(parents=True)
    lines: list[str] = []
    for k in range(count):
        turn = Pose.exp([0, 0, 0, *(random.uniform(-1, 1, 3) * [0.55, 0.55, 1.0])]).rotation
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        matrix[:3, 3] = [*random.uniform(-0.02, 0.02, 2), random.uniform(0.42, 0.55)] - turn @ middle
        seen = Pose(matrix)
        flange = (X.inverse() @ seen @ Y.inverse()).inverse()
        assert cv2.imwrite(str(folder / f"im_{k + 1:02d}.png"), picture(seen))
        lines.append(" ".join(f"{value:.12f}" for value in flange.matrix.ravel()))
    (folder / "RobotPosesVec.txt").write_text("\n".join(lines) + "\n")
    (folder / "squaresize.txt").write_text("30mm\n")
    return folder, X
