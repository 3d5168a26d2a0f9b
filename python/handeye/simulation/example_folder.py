"""A folder to try the commands on: rendered pictures, and the robot's poses as its pendant shows them.

Simulated: the pictures are rendered, the poses have the noise of an arm in good order.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from handeye.cameras.render import Appearance, BoardRenderer
from handeye.datasets.toml_text import toml_text
from handeye.datasets.writing import new_folder, write_file
from handeye.notations import NOTATIONS, Unit
from handeye.types import Camera, Charuco, Pose

BOARD = Charuco(7, 10, 0.025, 0.018, "DICT_5X5_100")
CAMERA = Camera("brown_conrady_5", [825, 825, 481.3, 358.2, -0.08, 0.03, 0, 0, 0], 960, 720)
NOTATION, UNIT = NOTATIONS["ur"], Unit.MM
POSES_FILE, TARGET_FILE = "poses.csv", "board.toml"
VIEWS = 10
# Noise of the poses that the robot reports, per axis.
SIGMA_M, SIGMA_RAD = 1e-4, np.deg2rad(0.01)


@dataclass(frozen=True)
class Example:
    """What was written, and the truth behind it."""

    folder: Path
    pictures: tuple[str, ...]
    T_flange_camera: Pose


def write_example(
    folder: Path, seed: int = 0, *, progress: Callable[[int, int], None] | None = None
) -> Example:
    """Write pictures of a ChArUco board, `poses.csv` in millimetres with rotation vectors, and `board.toml`.

    Raises
    ------
    OutputError
        The folder exists and is not empty, or the system refuses to write.
    """
    random = np.random.default_rng(seed)
    mount = Pose.exp([0.040, -0.060, 0.090, 0, 0, 0]) @ Pose.exp([0, 0, 0, 0.05, -0.03, 1.55])
    T_base_target = Pose.exp([0.55, -0.12, 0.03, 0, 0, 0]) @ Pose.exp([0, 0, 0, 3.10, 0.02, 0.3])
    renderer = BoardRenderer(CAMERA, BOARD, Appearance(blur_px=0.6, noise=2.0))
    middle = Pose.exp([*-BOARD.points.mean(axis=0), 0, 0, 0])
    rows, pictures = ["image,X,Y,Z,RX,RY,RZ"], list[str]()
    with new_folder(folder) as partial:
        for k in range(VIEWS):
            turn = Pose.exp([0, 0, 0, *random.uniform(-0.5, 0.5, 2), random.uniform(-1.2, 1.2)])
            place = [*random.uniform(-0.04, 0.04, 2), random.uniform(0.40, 0.55), 0, 0, 0]
            T_camera_target = Pose.exp(place) @ turn @ middle
            T_base_flange = T_base_target @ T_camera_target.inverse() @ mount.inverse()
            noise = random.normal(size=6) * [*[SIGMA_M] * 3, *[SIGMA_RAD] * 3]
            name = f"img_{k + 1}.png"
            encoded = cv2.imencode(".png", renderer.image(T_camera_target, random))[1]
            write_file(partial / name, encoded.tobytes())
            numbers = NOTATION.numbers(T_base_flange @ Pose.exp(noise), UNIT)
            lengths, angles = (f"{v:.2f}" for v in numbers[:3]), (f"{v:.4f}" for v in numbers[3:])
            rows.append(",".join([name, *lengths, *angles]))
            pictures.append(name)
            if progress is not None:
                progress(k + 1, VIEWS)
        write_file(partial / POSES_FILE, ("\n".join(rows) + "\n").encode())
        write_file(partial / TARGET_FILE, toml_text({"target": BOARD.to_dict()}).encode())
    return Example(folder, tuple(pictures), mount)
