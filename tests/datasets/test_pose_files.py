"""Poses from files of any kind."""

import json
from pathlib import Path

import numpy as np
import pytest

from datasets.layouts import some_pose
from handeye.datasets import PoseTable, Statement, read_pose_rows, read_poses
from handeye.errors import InputError
from handeye.notations import NOTATIONS, Direction, Unit
from poses_written import MM, WAYS, Way, said, some_poses

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
        ("", "no_poses", "no poses"),
        ("# nothing\n", "no_poses", "no poses"),
        (HEADER, "no_poses", "after the header"),
        ("1,2,3,0,0,0,1\n", "notation_unstated", "header"),  # the order of a quaternion is not guessed
        ("x,y,z,roll,pitch,yaw\n1,2,3,0,0,0\n", "notation_unstated", "header"),
        (HEADER.replace("x,", "x,x,", 1) + "1,1,2,3,0,0,0,1", "invalid_field", "columns"),
        ("speed,x,y,qx,qy,qz,qw,a\n1,1,2,3,0,0,0,1", "invalid_field", "speed"),
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


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
def test_every_way_is_read_right_when_stated(way: Way, tmp_path: Path) -> None:
    poses = some_poses(9, 3)
    names = [f"im_{k}.png" for k in range(1, 10)]
    path = tmp_path / f"poses{way.suffix}"
    path.write_text(way.text(names, poses), newline="")
    rows = read_pose_rows(path)
    (reading,) = rows.readings(way.stated)
    assert len(rows) == 9
    assert rows.names == tuple(names) or not any("png" in name for name in rows.names)
    for expected, pose in zip(poses, rows.poses(reading), strict=True):
        assert np.abs((expected.inverse() @ pose).log()).max() < 3e-4


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_marks_and_line_ends_are_no_obstacle(tmp_path: Path, encoding: str, end: str) -> None:
    path = tmp_path / "poses.csv"
    text = "image;X [mm];Y [mm];Z [mm];A [deg];B [deg];C [deg]\na.png;400,5;0,0;300,25;90,0;0,0;180,0\n"
    path.write_bytes(text.replace("\n", end).encode(encoding))
    rows = read_pose_rows(path)
    assert rows.stated.unit is Unit.MM
    assert rows.degrees
    assert rows.names == ("a.png",)
    (pose,) = rows.poses(rows.readings(said("kuka"))[0])
    assert pose.translation.tolist() == [0.4005, 0.0, 0.30025]


def test_a_file_may_say_how_it_is_written(tmp_path: Path) -> None:
    numbers = "400, 0, 300, 0, 0, 90\n"
    (tmp_path / "a.txt").write_text(f"# notation: fanuc\n# unit: mm\n{numbers}")
    assert read_poses(tmp_path / "a.txt").poses[0].translation.tolist() == [0.4, 0, 0.3]
    (tmp_path / "b.json").write_text(
        '{"notation": "ur", "unit": "mm", "poses_are": "base-in-flange", "poses": [[400, 0, 300, 0, 0, 0]]}'
    )
    assert read_poses(tmp_path / "b.json").poses[0].translation.tolist() == [-0.4, 0, -0.3]
    with pytest.raises(InputError, match="the file says fanuc"):
        read_poses(tmp_path / "a.txt", said("kuka"))
    (tmp_path / "c.txt").write_text(f"# notation: martian\n{numbers}")
    with pytest.raises(InputError, match="martian"):
        read_poses(tmp_path / "c.txt")


def test_what_is_stated_must_fit_the_file(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text(HEADER + row(1))
    with pytest.raises(InputError, match="a quaternion, not kuka"):
        read_poses(path, said("kuka"))
    path.write_text("0.1 0.2 0.3 0 0 0\n")
    with pytest.raises(InputError, match="6 numbers, expected 7"):
        read_poses(path, said("abb"))
    assert read_poses(path, Statement(NOTATIONS["ur"], Unit.M)).poses[0].translation[0] == 0.1


def test_a_first_column_that_counts_names_the_rows(tmp_path: Path) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("0 400 0 300 0 0 0\n1 410 0 300 0 0 0\n2 420 0 300 0 0 0\n")
    rows = read_pose_rows(path)
    assert rows.names == ("0", "1", "2")
    assert rows.poses(rows.readings(said("ur", MM))[0])[1].translation[0] == pytest.approx(0.41)


def test_the_inverse_is_inverted(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text(HEADER + row(1))
    stated = Statement(direction=Direction.BASE_IN_FLANGE)
    assert np.allclose(read_poses(path, stated).poses[0].matrix, some_pose(1).inverse().matrix, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.json", "[" * 50_000),
        ("a.json", '{"poses": {"poses": {"poses": {"poses": {"poses": {"poses": {"poses": [[1,2,3,4,5,6]]}}}}}}}}'),
        ("a.json", "[[1, 2, 3, 4, 5, 1e400]]"),
        ("a.json", '[[1, 2, 3, 4, 5, "x"]]'),
        ("a.yaml", "&a [*a, *a]"),
        ("a.yaml", "- !!python/object/apply:os.system ['true']\n"),
        ("a.xml", "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>"),
        ("a.xml", "<a>" * 100),
        ("a.xml", "<" * 400_000),
        ("a.xml", "<a" * 200_000),
        ("a.csv", "x" * 30_000),
        ("a.csv", '"' * 3),
        ("a.csv", "1;2;3\n"),
        ("a.csv", "9" * 5000 + ",1,2,3,4,5\n"),
        ("a.txt", "\x00" * 100),
        ("a.txt", "X X X X 1 Y"),
    ],
)  # fmt: skip
def test_hostile_files_are_refused(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as caught:
        read_poses(tmp_path / name, said("ur", MM))
    assert name in caught.value.message


POSE = {"position": {"x": 0.1, "y": 0.2, "z": 0.3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
PLAIN = "image,x,y,z,qx,qy,qz,qw"


@pytest.mark.parametrize(
    ("name", "text", "called"),
    [
        ("a.csv", f"{PLAIN},cov_xx,cov_yy\na.png,1,2,3,0,0,0,1,4,5\nb.png,1,2,3,0,0,0,1,4,5\n", ("cov_xx", "cov_yy")),
        ("a.csv", "std_x,x,y,z,rx,ry,rz\n9,1,2,3,0,0,1\n9,1,2,3,0,0,1\n", ("std_x",)),
        ("a.json", json.dumps([{"image": "a.png", "pose": {"pose": POSE, "covariance": [0.0] * 36}}] * 2), ("covariance",)),
        ("a.yaml", json.dumps({"poses": [{"image": "a.png", **POSE, "sigma_mm": 0.1}] * 2}), ("sigma_mm",)),
        ("a.csv", f"{PLAIN}\na.png,1,2,3,0,0,0,1\n", ()),
    ],
)  # fmt: skip
def test_accuracies_of_poses_are_passed_over_and_named(
    name: str, text: str, called: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    rows = read_pose_rows(tmp_path / name)
    assert rows.accuracies == called
    (reading, *_) = rows.readings(Statement(unit=Unit.M))
    assert [round(float(v), 9) for v in rows.poses(reading)[0].translation] in ([1, 2, 3], [0.1, 0.2, 0.3])
