"""Small data sets in every layout, written by the tests."""

from pathlib import Path

import cv2
import numpy as np

from handeye.types import Camera, Chessboard, Mounting, Pose, Recording, Truth, View

SIZE = (64, 48)


def png(path: Path, size: tuple[int, int] = SIZE) -> Path:
    """Write an image of some noise."""
    path.parent.mkdir(parents=True, exist_ok=True)
    width, height = size
    picture = np.random.default_rng(len(path.name)).integers(0, 255, (height, width), dtype=np.uint8)
    assert cv2.imwrite(str(path), picture)
    return path


def some_pose(k: int) -> Pose:
    """Some generic pose."""
    return Pose.exp([0.1 * k, -0.2, 0.5, 0.1 * k, 0.2, -0.3 * k])


def some_recording(count: int = 3, *, images: bool = False) -> Recording:
    """A recording of a 3 x 4 chessboard in an image of 64 x 48 pixels."""
    rng = np.random.default_rng(7)
    views = [
        View(
            f"im_{k}",
            some_pose(k),
            np.arange(12)[k:],
            rng.uniform(1, 47, (12 - k, 2)),
            image=f"pictures/{k}.png" if images else None,
            joints_rad=(0.1 * k, -1.0),
        )
        for k in range(count)
    ]
    camera = Camera("brown_conrady_5", [60, 60, 31.5, 23.5, 0.01, 0, 0, 0, 0], *SIZE)
    board, truth = Chessboard(3, 4, 0.02), Truth(X=some_pose(5))
    return Recording("set", Mounting.EYE_IN_HAND, camera, board, tuple(views), truth, "made here")


def pose_line(pose: Pose) -> str:
    """16 numbers by rows."""
    return "\t".join(f"{value:.9f}" for value in pose.matrix.ravel())


def write_rwhe(folder: Path, count: int = 3) -> Path:
    """The layout of Ali et al., with images 8, 9, 10: the order of counting is not that of the alphabet."""
    folder.mkdir(parents=True)
    for k in range(count):
        png(folder / f"im_{k + 8}.png")
    lines = [pose_line(some_pose(k)) for k in range(count)]
    (folder / "RobotPosesVec.txt").write_text("\n".join(lines))
    (folder / "square size.txt").write_text("200mm or 20cm")
    truth = "base2grid  =\n\n 1 0 0 0\n\n hand2eye=\n\n\n 1.0 0.0 0 0\n0 -1.0 0 0\n0 0 -1 0.05\n 0 0 0 1\n"
    (folder / "GroundTruth.txt").write_text(truth)
    return folder


RCT_FILES = {
    "cal_data.yaml": (
        "- pose: poses/0.yaml\n  image: images/0.png\n- pose: poses/1.yaml\n  image: images/1.png\n"
    ),
    "poses/0.yaml": "x: 0.7\ny: 1e-3\nz: 0.85\nqx: 0.0\nqy: 1\nqz: 0.0\nqw: 0.0\n",
    "poses/1.yaml": "x: 0.6\ny: 0.1\nz: 0.8\nqx: 0.0\nqy: 0.6\nqz: 0.0\nqw: -0.8\n",
    "camera_intr.yaml": "intrinsics:\n  fx: 60.0 # pixels\n  fy: 61.0\n  cx: 32.0\n  cy: 24.0\n",
    "target.yaml": (
        "target_finder:\n  type: rct_ros_tools::ModifiedCircleGridTargetFinderPlugin\n  rows: 5\n  cols: 7\n"
        "  spacing: 0.0254 # m\n  circle_detector_params:\n    minThreshold: 20\n"
    ),
    "pose_guesses.yaml": "wrist_to_camera_guess:\n  x: 0.0\n",
}


def write_rct(folder: Path) -> Path:
    """The layout of robot_cal_tools."""
    for name, text in RCT_FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    for k in range(2):
        png(folder / "images" / f"{k}.png")
    return folder


def everything_below(folder: Path) -> dict[str, bytes]:
    """All files below a folder with their content, hidden ones too."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def names_in(folder: Path) -> list[str]:
    """Everything in a folder, hidden or not."""
    return sorted(path.name for path in folder.iterdir())
