"""From pictures and robot poses to a recording and an answer.

The pictures are drawn here, so that the example runs anywhere. Your folder would be in one of the layouts
that `handeye import` knows; this one is that of rwhe-calib: images, RobotPosesVec.txt with 16 numbers a line
(T_base_flange by rows, metres), and squaresize.txt.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from handeye.datasets import write_recording
from handeye.estimation import solve
from handeye.importing import SourceOptions, open_folder
from handeye.types import Pose

FINER = 4  # pictures are drawn larger and averaged, as a sensor does
K = np.array([[620.0, 0, 319.5], [0, 620.0, 239.5], [0, 0, 1]])
HALF = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])  # pixel centres are at whole numbers
K_FINER = np.linalg.inv(HALF) @ np.diag([FINER, FINER, 1]) @ HALF @ K
SQUARE_M, TEXELS = 0.03, 40
board = np.kron(np.indices((6, 8)).sum(axis=0) % 2 * 215 + 20, np.ones((TEXELS, TEXELS))).astype(np.uint8)
board = cv2.copyMakeBorder(board, TEXELS, TEXELS, TEXELS, TEXELS, cv2.BORDER_CONSTANT, value=(235,))
scale, shift = SQUARE_M / TEXELS, -SQUARE_M * (2 - 0.5 / TEXELS)
TEXEL_TO_TARGET = np.array([[scale, 0, shift], [0, scale, shift], [0, 0, 1]])

T_camera_flange = Pose.exp([0.03, -0.08, 0.05, 0.3, -0.2, 1.4])
T_base_target = Pose.exp([0.6, 0.1, 0.05, 0.2, -0.1, 0.6])

with TemporaryDirectory() as scratch:
    folder = Path(scratch) / "pictures"
    folder.mkdir()
    random = np.random.default_rng(4)
    lines: list[str] = []
    for k in range(8):
        turn = Pose.exp([0, 0, 0, *(random.uniform(-1, 1, 3) * [0.55, 0.55, 1.0])])
        middle = Pose.exp([-0.09, -0.06, 0, 0, 0, 0])  # the board turns about its middle
        T_camera_target = Pose.exp([0, 0, random.uniform(0.42, 0.55), 0, 0, 0]) @ turn @ middle
        T_base_flange = (T_camera_flange.inverse() @ T_camera_target @ T_base_target.inverse()).inverse()
        plane = T_camera_target.matrix[:3, [0, 1, 3]]
        large = cv2.warpPerspective(
            board, K_FINER @ plane @ TEXEL_TO_TARGET, (640 * FINER, 480 * FINER), borderValue=(120,)
        )
        cv2.imwrite(
            str(folder / f"view_{k}.png"), cv2.resize(large, (640, 480), interpolation=cv2.INTER_AREA)
        )
        lines.append(" ".join(f"{value:.9f}" for value in T_base_flange.matrix.ravel()))
    (folder / "RobotPosesVec.txt").write_text("\n".join(lines))
    (folder / "squaresize.txt").write_text("30mm")

    # The files do not say how many corners the board has: rows and columns of inner corners.
    opened = open_folder(folder, SourceOptions(pattern=(5, 7)))
    print(f"found the board in {len(opened.recording)} images; camera {opened.camera_origin}")
    write_recording(opened.recording, Path(scratch) / "recording")

    calibration = solve(opened.recording)
    error = calibration.X.inverse() @ T_camera_flange
    print(f"stated accuracy {calibration.sigma_translation_m * 1e3:.2f} mm")
    print(f"true error      {np.linalg.norm(error.translation) * 1e3:.2f} mm")
