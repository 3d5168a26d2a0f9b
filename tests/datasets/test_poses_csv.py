"""Poses from CSV files."""

from pathlib import Path

import numpy as np
import pytest

from datasets.layouts import some_pose
from handeye.datasets import PoseTable, read_poses
from handeye.errors import InputError

HEADER = "x,y,z,qx,qy,qz,qw\n"


def read(tmp_path: Path, text: str) -> PoseTable:
    path = tmp_path / "poses.csv"
    path.write_text(text)
    return read_poses(path)


def row(k: int) -> str:
    pose = some_pose(k)
    return ",".join(f"{value!r}" for value in [*pose.translation.tolist(), *pose.quaternion_xyzw.tolist()])


def test_translation_and_quaternion(tmp_path: Path) -> None:
    table = read(tmp_path, HEADER + "# a remark\n\n" + row(1) + "\n" + row(2))
    assert table.names == ("line 4", "line 5")
    assert len(table) == 2
    for k, pose in enumerate(table.poses, start=1):
        np.testing.assert_allclose(pose.matrix, some_pose(k).matrix, atol=1e-12)


def test_columns_in_any_order_with_names(tmp_path: Path) -> None:
    table = read(tmp_path, "Name;qw;qx;qy;qz;z;y;x\nhome;1;0;0;0;3;2;1\n;1;0;0;0;6;5;4\n")
    assert table.names == ("home", "line 3")
    assert [pose.translation.tolist() for pose in table.poses] == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("separator", [",", "\t", " ; "])
def test_matrices(tmp_path: Path, separator: str) -> None:
    matrix = some_pose(3).matrix.ravel().tolist()
    table = read(tmp_path, separator.join(map(repr, matrix)) + "\n")
    assert table.poses == (some_pose(3),)


def test_millimetres_are_a_warning(tmp_path: Path) -> None:
    assert read(tmp_path, HEADER + "1,2,3,0,0,0,1").warnings == ()
    (warning,) = read(tmp_path, HEADER + "1,2,3,0,0,0,1\n500,200,700,0,0,0,1").warnings
    assert warning.code == "poses_not_metres"
    assert "line 3" in warning.message


@pytest.mark.parametrize(
    ("text", "code", "place"),
    [
        ("", "no_poses", "header"),
        ("# nothing\n", "no_poses", "header"),
        (HEADER, "no_poses", "after the header"),
        ("1,2,3,0,0,0,1\n", "wrong_shape", "header"),  # the order of a quaternion is not guessed
        ("x,y,z,roll,pitch,yaw\n1,2,3,0,0,0\n", "wrong_shape", "header"),
        (HEADER.replace("x,", "x,x,", 1) + "1,1,2,3,0,0,0,1", "invalid_field", "columns"),
        (HEADER.replace("x,", "speed,x,", 1) + "1,1,2,3,0,0,0,1", "invalid_field", "speed"),
        (HEADER + "1,2,3,0,0,0\n", "wrong_shape", "line 2"),
        (HEADER + "1,2,3,0,0,0,nan\n", "not_finite", "line 2: qw"),
        (HEADER + "1,2,3,0,0,0,1_0\n", "not_numbers", "line 2: qw"),
        (HEADER + "1,2,3,0,0,0,2\n", "not_rigid", "line 2"),
        (",".join(["1"] * 16), "not_rigid", "line 1"),
        (",".join(["1"] * 15), "wrong_shape", "line 1"),
        (",".join(map(str, np.eye(4).ravel())) + "\n1,2", "wrong_shape", "line 2"),
    ],
)
def test_faults_name_the_line(tmp_path: Path, text: str, code: str, place: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert caught.value.code == code
    assert place in caught.value.message


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_poses(tmp_path / "no.csv")
    assert caught.value.code == "missing_file"
