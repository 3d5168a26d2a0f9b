"""`handeye export`: from a result or a folder, to a file or to stdout."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from cells import Cell
from handeye.cli.boundary import run
from handeye.cli.export import Format
from handeye.datasets import write_recording
from handeye.errors import ExitCode
from handeye.export import EXPORTERS
from handeye.types import Mounting, Pose, Recording


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cell = Cell(np.random.default_rng(11))
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(6)], sigma_px=0.05)
    folder = tmp_path_factory.mktemp("export") / "cell"
    write_recording(Recording("cell", cell.mounting, cell.camera, cell.target, tuple(views)), folder)
    return folder


@pytest.fixture(scope="module")
def result(folder: Path) -> Path:
    path = folder.parent / "result.json"
    assert run(["solve", str(folder), "--model", "paper", "--output", str(path)]) == ExitCode.SUCCESS
    return path


def answered(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert run(["export", *arguments, "--json"]) == ExitCode.SUCCESS
    return json.loads(capsys.readouterr().out)


def test_formats_are_those_of_the_library() -> None:
    assert {member.value for member in Format} == {*EXPORTERS, "moveit_samples"}


def test_folder_and_result_say_the_same(
    folder: Path, result: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from_folder = answered(capsys, str(folder), "--format", "urdf", "--model", "paper")
    from_result = answered(capsys, str(result), "--format", "urdf")
    assert from_folder == from_result
    assert from_result["parent_frame"] == "tool0"
    solved = json.loads(result.read_text())
    np.testing.assert_allclose(from_result["T_parent_child"], solved["T_flange_camera"])


def test_text_goes_to_stdout_as_it_is(result: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = answered(capsys, str(result), "--format", "ros2", "--camera-link", "cam")["text"]
    assert run(["export", str(result), "--format", "ros2", "--camera-link", "cam"]) == ExitCode.SUCCESS
    printed = capsys.readouterr()
    assert printed.out == text
    assert "tf2_echo" in printed.err  # a warning does not get into a file that stdout is redirected to


def test_output_is_written_whole(result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "camera.urdf"
    path.write_text("older")
    data = answered(capsys, str(result), "--format", "urdf", "--output", str(path))
    assert path.read_text() == data["text"]
    assert [entry.name for entry in tmp_path.iterdir()] == ["camera.urdf"]


def test_names_and_place_of_the_link(result: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = ["--link-optical", "0", "0.015", "0", "-0.5", "0.5", "-0.5", "0.5"]
    names = ["--parent-frame", "flange", "--child-frame", "rgb", "--camera-link", "cam"]
    data = answered(capsys, str(result), "--format", "json", *names, *place)
    assert (data["parent_frame"], data["child_frame"]) == ("flange", "cam")
    assert not data["warnings"]
    again = Pose(data["T_parent_child"]) @ Pose.from_quaternion([0, 0.015, 0], [-0.5, 0.5, -0.5, 0.5])
    np.testing.assert_allclose(again.matrix, json.loads(result.read_text())["T_flange_camera"], atol=1e-12)


def test_samples_need_the_views(folder: Path, result: Path, capsys: pytest.CaptureFixture[str]) -> None:
    samples = yaml.safe_load(answered(capsys, str(folder), "--format", "moveit_samples")["text"])
    assert len(samples) == 6
    assert run(["export", str(result), "--format", "moveit_samples"]) == ExitCode.USAGE


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--format", "nonsense"], ExitCode.USAGE),
        ([], ExitCode.USAGE),
        (["--format", "urdf", "--parent-frame", 'a" evil="'], ExitCode.UNUSABLE_INPUT),
        (["--format", "urdf", "--child-frame", "tool0"], ExitCode.UNUSABLE_INPUT),
        (["--format", "urdf", "--link-optical", "0", "0", "0", "0", "0", "0", "1"], ExitCode.USAGE),
        (["--format", "urdf", "--camera-link", "l", "--link-optical", *"0000000"], ExitCode.UNUSABLE_INPUT),
        (["--format", "urdf", "--model", "paper"], ExitCode.USAGE),
        (["--format", "urdf", "--rows", "3", "--columns", "4"], ExitCode.USAGE),
        (["--format", "urdf", "--output", "/nonexistent/x.urdf"], ExitCode.OUTPUT),
    ],
)
def test_what_cannot_be_is_refused(result: Path, arguments: list[str], code: ExitCode) -> None:
    assert run(["export", str(result), *arguments]) == code


def test_missing_files_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("none.json", "none"):
        assert run(["export", str(tmp_path / name), "--format", "urdf"]) == ExitCode.UNUSABLE_INPUT
        assert name in capsys.readouterr().err


def test_camera_beside_the_robot_hangs_on_the_base(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = Cell(np.random.default_rng(3), Mounting.EYE_TO_HAND)
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(5)], sigma_px=0.05)
    write_recording(
        Recording("cell", cell.mounting, cell.camera, cell.target, tuple(views)), tmp_path / "cell"
    )
    data = answered(capsys, str(tmp_path / "cell"), "--format", "easy_handeye2", "--model", "paper")
    assert data["parent_frame"] == "base"
    np.testing.assert_allclose(data["T_parent_child"], cell.X.inverse().matrix, atol=2e-3)
    assert yaml.safe_load(data["text"])["parameters"]["robot_effector_frame"] == "tool0"
