"""Folders of pictures and pose lists: read, matched, and where nothing is said, told by the pictures."""

import json
import shutil
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
import pytest

from commands import Handeye
from folders import PICTURE_BOARD, PICTURE_CAMERA, photographed
from handeye.datasets import Statement, read_pose_rows
from handeye.datasets.joint_states import read_joint_rows
from handeye.datasets.toml_text import toml_text
from handeye.errors import InputError, UnstatedError
from handeye.estimation import solve
from handeye.importing import SourceOptions, open_folder
from handeye.notations import NOTATIONS, Unit
from handeye.types import Chessboard, Pose
from poses_written import WAYS, table


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Pose, list[Pose]]:
    """Pictures with a target file; the poses are to be written by the tests."""
    folder, X = photographed(tmp_path_factory.mktemp("pictures") / "set")
    listed = folder / "RobotPosesVec.txt"
    rows = read_pose_rows(listed)
    poses = list(rows.poses(rows.readings(Statement(NOTATIONS["matrix"], Unit.M))[0]))
    listed.unlink()
    (folder / "squaresize.txt").unlink()
    (folder / "board.toml").write_text(toml_text({"target": PICTURE_BOARD.to_dict()}))
    return folder, X, poses


@pytest.fixture
def folder(pictures: tuple[Path, Pose, list[Pose]], tmp_path: Path) -> Path:
    return Path(shutil.copytree(pictures[0], tmp_path / "set"))


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("*.png"))


def test_stated_poses_are_solved(folder: Path, pictures: tuple[Path, Pose, list[Pose]]) -> None:
    _, X, poses = pictures
    (folder / "poses.csv").write_text(WAYS[3].text(names(folder), poses))
    options = SourceOptions(camera=PICTURE_CAMERA, stated=Statement(NOTATIONS["kuka"]))
    opened = open_folder(folder, options)
    assert opened.layout == "pose-list"
    error = solve(opened.recording).X.inverse() @ X
    assert 1e3 * float((error.translation**2).sum() ** 0.5) < 1.0


def test_accuracies_in_the_file_are_said_not_to_be_used(
    folder: Path, pictures: tuple[Path, Pose, list[Pose]]
) -> None:
    rows = WAYS[3].text(names(folder), pictures[2]).splitlines()
    (folder / "poses.csv").write_text("\n".join([f"{rows[0]},sigma_mm", *(f"{row},0.1" for row in rows[1:])]))
    options = SourceOptions(camera=PICTURE_CAMERA, stated=Statement(NOTATIONS["kuka"]))
    opened = open_folder(folder, options)
    (said,) = [warning for warning in opened.warnings if warning.code == "accuracies_unused"]
    assert said.message.startswith("poses.csv: how accurate each pose is (sigma) is not used")


def test_unstated_poses_are_told_by_the_pictures(
    folder: Path, pictures: tuple[Path, Pose, list[Pose]], handeye: Handeye
) -> None:
    (folder / "poses.csv").write_text(WAYS[0].text(names(folder), pictures[2]))
    with pytest.raises(UnstatedError) as caught:
        open_folder(folder, SourceOptions(camera=PICTURE_CAMERA))
    assert "ur in mm" in caught.value.message
    assert "The next best" in caught.value.message
    assert caught.value.options == ("--poses", "poses.csv", "--notation", "ur", "--unit", "mm")


@pytest.mark.parametrize(
    ("written", "said", "unit", "code"),
    [
        ("kuka", "fanuc", Unit.MM, "wrong_rotation"),
        ("doosan", "euler_zyx_moving_deg", Unit.MM, "wrong_rotation"),
        ("fanuc", "euler_xyz_fixed_rad", Unit.MM, "wrong_unit"),
        ("rotation_vector_deg", "rotation_vector", Unit.MM, "wrong_unit"),
        ("matrix", "matrix", Unit.M, "wrong_unit"),
    ],
)
def test_poses_stated_wrongly_are_told_by_the_pictures(
    folder: Path, pictures: tuple[Path, Pose, list[Pose]], written: str, said: str, unit: Unit, code: str
) -> None:
    (folder / "poses.csv").write_text(table(written, Unit.MM)(names(folder), pictures[2]))
    with pytest.raises(UnstatedError) as caught:
        open_folder(folder, SourceOptions(camera=PICTURE_CAMERA, stated=Statement(NOTATIONS[said], unit)))
    assert caught.value.code == code
    _, _, _, name, _, found = caught.value.options
    assert NOTATIONS[name].form == NOTATIONS[written].form
    assert found == "mm"
    assert "is stated to be" in caught.value.message


def test_too_few_pictures_tell_nothing(folder: Path, pictures: tuple[Path, Pose, list[Pose]]) -> None:
    for name in names(folder)[2:]:
        (folder / name).unlink()
    (folder / "poses.csv").write_text(WAYS[0].text(names(folder), pictures[2][:2]))
    with pytest.raises(UnstatedError, match="fewer than 3 pictures") as caught:
        open_folder(folder, SourceOptions(camera=PICTURE_CAMERA))
    assert caught.value.options == ()


def test_rows_find_their_pictures_by_name(folder: Path, pictures: tuple[Path, Pose, list[Pose]]) -> None:
    listed = names(folder)
    text = table("matrix", Unit.M)(listed[::-1], pictures[2][::-1])
    stated = SourceOptions(camera=PICTURE_CAMERA, stated=Statement(NOTATIONS["matrix"], Unit.M))
    for change in (str, lambda t: t.replace(".png", ""), lambda t: t.replace("im_", "pictures/im_")):
        (folder / "poses.csv").write_text(change(text))
        views = open_folder(folder, stated).recording.views
        by_name = {f"{view.name}.png": view.T_base_flange for view in views}
        assert len(by_name) == len(listed)
        for name, pose in zip(listed, pictures[2], strict=True):
            assert abs(by_name[name].matrix - pose.matrix).max() < 1e-5


def test_what_lacks_its_other_half_is_left_out_and_said(
    folder: Path, pictures: tuple[Path, Pose, list[Pose]]
) -> None:
    listed = names(folder)
    (folder / "poses.csv").write_text(table("matrix", Unit.M)(["other.png", *listed[1:]], pictures[2]))
    opened = open_folder(
        folder, SourceOptions(camera=PICTURE_CAMERA, stated=Statement(NOTATIONS["matrix"], Unit.M))
    )
    assert len(opened.recording.views) == len(listed) - 1
    assert {"pictures_without_a_pose", "poses_without_a_picture"} <= {w.code for w in opened.warnings}


def test_one_file_a_picture_and_pictures_below(folder: Path, pictures: tuple[Path, Pose, list[Pose]]) -> None:
    (folder / "images").mkdir()
    for k, (name, pose) in enumerate(zip(names(folder), pictures[2], strict=True), start=1):
        (folder / name).rename(folder / "images" / name)
        data = ", ".join(f"{value:.6f}" for value in (1000 * pose.matrix[:3, 3:]).ravel())
        matrix = pose.matrix.copy()
        matrix[:3, 3] *= 1000
        data = ", ".join(f"{value:.6f}" for value in matrix.ravel())
        (folder / f"robot_pose_{k}.yaml").write_text(
            f"%YAML:1.0\n---\nPoseState: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n   data: [ {data} ]\n"
        )
    opened = open_folder(
        folder, SourceOptions(camera=PICTURE_CAMERA, stated=Statement(NOTATIONS["matrix"], Unit.MM))
    )
    for view, pose in zip(opened.recording.views, pictures[2], strict=True):
        assert abs(view.T_base_flange.matrix - pose.matrix).max() < 1e-5
        assert view.image is not None
        assert view.image.startswith("images/")


@pytest.mark.parametrize("first", [0, 7])
def test_poses_may_be_counted_from_another_number(
    first: int, folder: Path, pictures: tuple[Path, Pose, list[Pose]]
) -> None:
    for k, name in enumerate(names(folder), start=1):
        (folder / name).rename(folder / f"img_{k}.png")
    written = cv2.FileStorage(str(folder / "robot.yml"), cv2.FILE_STORAGE_WRITE)
    for k, pose in enumerate(pictures[2], start=first):
        written.write(f"T_gripper2base_{k}", pose.matrix)
    written.release()
    stated = Statement(NOTATIONS["matrix"], Unit.M)
    opened = open_folder(folder, SourceOptions(camera=PICTURE_CAMERA, stated=stated))
    assert [warning.message for warning in opened.warnings if warning.code == "counted_otherwise"] == [
        f"poses are counted from {first}, pictures from 1: matched in order"
    ]
    by_name = {view.name: view.T_base_flange for view in opened.recording.views}
    for k, pose in enumerate(pictures[2], start=1):
        assert abs(by_name[f"img_{k}"].matrix - pose.matrix).max() < 1e-9
    # A gap in the count: numbers mean what they say.
    (folder / "img_2.png").rename(folder / "img_99.png")
    opened = open_folder(folder, SourceOptions(camera=PICTURE_CAMERA, stated=stated))
    assert "counted_otherwise" not in {warning.code for warning in opened.warnings}


def test_the_command_for_one_file_a_picture_runs(
    folder: Path, pictures: tuple[Path, Pose, list[Pose]], handeye: Handeye
) -> None:
    for k, pose in enumerate(pictures[2], start=1):
        (folder / f"robot_pose_{k}.csv").write_text(",".join(map(repr, pose.matrix.ravel().tolist())))
    with pytest.raises(UnstatedError) as caught:
        open_folder(folder, SourceOptions(camera=PICTURE_CAMERA))
    options = caught.value.options
    assert options[:2] == ("--poses", str(folder))
    (folder / "camera.json").write_text(json.dumps(PICTURE_CAMERA.to_dict()))
    assert handeye.json("solve", folder, *options)["T_flange_camera"]


def test_faults_are_named(folder: Path, pictures: tuple[Path, Pose, list[Pose]]) -> None:
    listed = names(folder)
    with pytest.raises(InputError, match="nothing that can be read"):
        open_folder(folder)
    (folder / "poses.csv").write_text(WAYS[0].text(listed, pictures[2]))
    (folder / "other.csv").write_text(WAYS[0].text(listed, pictures[2]))
    with pytest.raises(InputError, match="hold poses") as caught:
        open_folder(folder)
    assert "--poses" in str(caught.value.hint)
    (folder / "other.csv").write_text("\n".join("1 2 3 4 5 6" for _ in listed[:-1]))
    with pytest.raises(InputError, match="expected as many"):
        open_folder(folder, SourceOptions(poses="other.csv"))
    (folder / "board.toml").unlink()
    with pytest.raises(InputError, match="what the calibration target is") as caught:
        open_folder(folder, SourceOptions(poses="poses.csv"))
    assert "ChArUco" in str(caught.value.hint)
    with pytest.raises(InputError, match=r"no\.csv: no such file"):
        open_folder(folder, SourceOptions(poses="no.csv", target=Chessboard(5, 7, 0.03)))


def test_a_camera_of_another_size_is_refused(folder: Path, pictures: tuple[Path, Pose, list[Pose]]) -> None:
    (folder / "poses.csv").write_text(WAYS[0].text(names(folder), pictures[2]))
    (folder / "camera.yaml").write_text(
        "image_width: 1280\nimage_height: 960\ncamera_matrix: {rows: 3, cols: 3, data: [1240., 0., 639., 0., "
        "1240., 479., 0., 0., 1.]}\ndistortion_model: plumb_bob\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [0., 0., 0., 0., 0.]}\n"
    )
    options = SourceOptions(stated=Statement(NOTATIONS["ur"], Unit.MM))
    with pytest.raises(InputError, match=r"1280 x 960 pixels, the pictures in .* have 640 x 480"):
        open_folder(folder, options)


class MadeUpArm:
    """Turns positions of its one joint, a number, into poses."""

    joint_names = ("b", "a")

    def __init__(self, poses: list[Pose]) -> None:
        self.poses = poses

    def forward(self, joints: np.ndarray) -> np.ndarray:
        return np.array([self.poses[round(row[0])].matrix for row in joints])


def test_joint_states_of_moveit_in_place_of_poses(
    folder: Path, pictures: tuple[Path, Pose, list[Pose]]
) -> None:
    states = {"joint_names": ["a", "gripper", "b"], "joint_values": [[0.5, 0.0, k] for k in range(8)]}
    (folder / "joint_states.yaml").write_text(json.dumps(states))
    with pytest.raises(InputError, match="joint positions in place of poses") as caught:
        open_folder(folder)
    assert "--robot" in str(caught.value.hint)
    arm: Any = MadeUpArm(pictures[2])
    opened = open_folder(folder, SourceOptions(camera=PICTURE_CAMERA, arm=arm))
    for k, view in enumerate(opened.recording.views):
        assert view.joints_rad == (k, 0.5)
        assert view.T_base_flange == pictures[2][k]


@pytest.mark.parametrize(
    ("states", "match"),
    [
        ({"joint_names": ["a"], "joint_values": [[1]]}, "joints a, expected b, a"),
        ({"joint_names": ["a", "b"], "joint_values": [[1, 2], [1]]}, "sample 2: 1 values, expected 2"),
        ({"joint_names": ["a", "b"], "joint_values": [[1, "x"]]}, "sample 1"),
        ({"joint_names": ["a", "b"], "joint_values": []}, "joint_values: expected a list"),
        ({"joint_names": ["a", "b"], "joint_values": [[1, 1e999]]}, "finite"),
    ],
)
def test_damaged_joint_states(states: dict[str, Any], match: str, tmp_path: Path) -> None:
    path = tmp_path / "states.json"
    path.write_text(json.dumps(states))
    with pytest.raises(InputError, match=match):
        read_joint_rows(path, cast("Any", MadeUpArm([])))
