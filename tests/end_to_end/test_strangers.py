"""What five strangers bring, each answered by one command."""

import shlex
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from bags_written import Journey, write
from commands import Handeye
from datasets.test_pose_pairs import X as SAMPLES_X
from datasets.test_pose_pairs import easy_samples
from folders import PICTURE_BOARD, PICTURE_CAMERA, photographed
from handeye.datasets import Statement, read_pose_rows
from handeye.datasets.toml_text import toml_text
from handeye.export import read_transform
from handeye.notations import NOTATIONS, Unit
from handeye.types import Mounting, Pose
from poses_written import KUKA_HEAD, MM, UR_HEAD, table


@pytest.fixture(scope="module")
def set_up(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Pose, list[Pose]]:
    """Pictures with a file of the board, the true `T_camera_flange`, and the poses to be written."""
    folder, X = photographed(tmp_path_factory.mktemp("strangers") / "set")
    rows = read_pose_rows(folder / "RobotPosesVec.txt")
    poses = list(rows.poses(rows.readings(Statement(NOTATIONS["matrix"], Unit.M))[0]))
    (folder / "RobotPosesVec.txt").unlink()
    (folder / "squaresize.txt").unlink()
    (folder / "board.toml").write_text(toml_text({"target": PICTURE_BOARD.to_dict()}))
    return folder, X, poses


@pytest.fixture
def folder(set_up: tuple[Path, Pose, list[Pose]], tmp_path: Path) -> Path:
    return Path(shutil.copytree(set_up[0], tmp_path / "my_folder"))


def off_mm(answer: list[list[float]], true: Pose) -> float:
    return 1e3 * float(np.linalg.norm(np.array(answer)[:3, 3] - true.translation))


def pictures(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("*.png"))


def test_a_ur_folder_with_a_csv(
    folder: Path, set_up: tuple[Path, Pose, list[Pose]], handeye: Handeye
) -> None:
    (folder / "poses.csv").write_text(table("ur", MM, UR_HEAD, decimals=4)(pictures(folder), set_up[2]))
    answer = handeye.json("solve", folder, "--poses", "poses.csv", "--notation", "ur", "--unit", "mm")
    assert off_mm(answer["T_flange_camera"], set_up[1].inverse()) < 1.0


def test_a_kuka_folder_of_which_nothing_is_said(
    folder: Path, set_up: tuple[Path, Pose, list[Pose]], handeye: Handeye
) -> None:
    """The first command says which one to run; that one answers."""
    (folder / "poses.csv").write_text(table("kuka", MM, KUKA_HEAD, decimals=3)(pictures(folder), set_up[2]))
    error = handeye.fails("solve", folder)
    (command,) = [line for line in error["hint"].splitlines() if line.startswith("run: ")]
    program, *arguments = shlex.split(command.removeprefix("run: "))
    assert program == "handeye"
    assert "kuka" in arguments
    answer = handeye.json(*[argument for argument in arguments if argument != "--json"])
    assert off_mm(answer["T_flange_camera"], set_up[1].inverse()) < 1.0


def test_samples_of_easy_handeye2(tmp_path: Path, handeye: Handeye) -> None:
    (tmp_path / "demo.samples").write_text(easy_samples(Mounting.EYE_IN_HAND))
    answer = handeye.json("solve", tmp_path / "demo.samples", "--mounting", "eye_in_hand")
    assert off_mm(answer["T_flange_camera"], SAMPLES_X.inverse()) < 0.1
    exported = handeye.json(
        "export", tmp_path / "demo.samples", "--mounting", "eye_in_hand", "--format", "easy_handeye2"
    )
    (tmp_path / "demo.calib").write_text(exported["text"])
    back = read_transform(tmp_path / "demo.calib").T_parent_child
    assert np.abs(back.matrix - np.array(answer["T_flange_camera"])).max() < 1e-9


def test_a_bag_beside_its_board(tmp_path: Path, handeye: Handeye) -> None:
    pytest.importorskip("rosbags", reason="rosbags, which writes the bags, is not installed")
    journey = Journey(seed=7, stations=5, picture_hz=6)
    bag = write(tmp_path / "cell", "rosbag1", journey)
    (tmp_path / "board.toml").write_text(toml_text({"target": journey.target.to_dict()}))
    answer = handeye.json("solve", bag)
    assert off_mm(answer["T_flange_camera"], journey.truth) < 1.0
    assert abs(answer["timing"]["lag_ms"] - 30) < 3
    # The folder will do where there is one bag in it.
    assert handeye.json("solve", tmp_path)["T_flange_camera"] == answer["T_flange_camera"]


def test_an_opencv_folder(folder: Path, set_up: tuple[Path, Pose, list[Pose]], handeye: Handeye) -> None:
    """Camera and poses by `cv::FileStorage`, as programs of one's own write them."""
    storage = cv2.FileStorage(str(folder / "camera.yml"), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", PICTURE_CAMERA.width_px)
    storage.write("image_height", PICTURE_CAMERA.height_px)
    storage.write("camera_matrix", PICTURE_CAMERA.matrix)
    storage.write("distortion_coefficients", np.zeros((1, 5)))
    storage.release()
    storage = cv2.FileStorage(str(folder / "poses.xml"), cv2.FILE_STORAGE_WRITE)
    for k, pose in enumerate(set_up[2], start=1):
        storage.write(f"T_base_gripper_{k}", pose.matrix)
    storage.release()
    answer = handeye.json("solve", folder, "--notation", "matrix", "--unit", "m")
    assert answer["camera_origin"] == "files"
    assert off_mm(answer["T_flange_camera"], set_up[1].inverse()) < 1.0
