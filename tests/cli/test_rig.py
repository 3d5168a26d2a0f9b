"""Several cameras on the command line: the keys of one camera under its name, and what lies between them."""

from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from handeye.datasets import read_rig, write_rig
from handeye.simulation.cells import ErrorKind
from handeye.simulation.rigs import RigOptions, simulate_rig
from handeye.types import RigRecording


@pytest.fixture(scope="module")
def recording() -> RigRecording:
    """A simulated rig."""
    return simulate_rig(ErrorKind.MIXTURE_CELL, 1)


@pytest.fixture
def folder(tmp_path: Path, recording: RigRecording) -> Path:
    """The recording on disk."""
    write_rig(recording, tmp_path / "rig")
    return tmp_path / "rig"


def test_solve_answers_for_all_cameras(handeye: Handeye, folder: Path, recording: RigRecording) -> None:
    data = handeye.json("solve", folder, "--robot", "ur5e", "--output", folder / "answer.json")
    assert list(data["cameras"]) == ["left", "right", "front", "side"]
    assert recording.truth is not None
    for name, camera in data["cameras"].items():
        key = "T_flange_camera" if name in {"left", "right"} else "T_base_camera"
        off = np.array(camera[key])[:3, 3] - recording.truth.cameras[name].inverse().translation
        assert 1e3 * np.linalg.norm(off) < 2 * camera["within_95"]["translation_mm"]
    assert set(data["camera_to_camera"]) == {"T_left_right", "T_front_side"}
    between = data["camera_to_camera"]["T_left_right"]
    alone = data["cameras"]["left"]["within_95"]["translation_mm"]
    assert between["within_95"]["translation_mm"] < alone
    assert np.array(between["covariance"]).shape == (6, 6)
    assert data["targets"]["table"]["on"] == "base"
    assert (folder / "answer.json").is_file()
    words = handeye("solve", folder).out
    for expected in (
        "T_left_right",
        "left: T_flange_camera",
        "front: T_base_camera",
        "with 95 % probability",
    ):
        assert expected in words


def test_one_camera_answers_as_ever(handeye: Handeye, tmp_path: Path) -> None:
    one = simulate_rig(ErrorKind.MIXTURE_CELL, 1, RigOptions(on_flange=1, beside=0))
    write_rig(one, tmp_path / "one")
    data = handeye.json("solve", tmp_path / "one")
    assert "cameras" not in data
    assert "T_flange_camera" in data


def test_import_copies_and_other_commands_say_what_they_take(
    handeye: Handeye, folder: Path, recording: RigRecording
) -> None:
    copy = folder.parent / "copy"
    data = handeye.json("import", folder, copy)
    assert list(data["cameras"]) == ["left", "right", "front", "side"]
    assert read_rig(copy).recording == recording
    assert handeye.fails("solve", folder, "--model", "paper")["code"] == "several_cameras"


def test_export_writes_one_of_the_cameras(handeye: Handeye, folder: Path) -> None:
    handeye("solve", folder, "--output", folder / "answer.json")
    for given in (folder / "answer.json", folder):
        data = handeye.json("export", given, "--only", "right", "--format", "ros2")
        assert data["parent_frame"] == "tool0"
        assert handeye.fails("export", given, "--format", "ros2")["code"] == "several_cameras"
        assert handeye.fails("export", given, "--only", "up", "--format", "ros2")["code"] == "several_cameras"


def test_plan_ranks_stations_by_what_all_cameras_learn(handeye: Handeye, folder: Path) -> None:
    data = handeye.json("plan", folder, "--first", "8", "--top", "3")
    assert len(data["used"]) == 8
    gains = [candidate["gain"] for candidate in data["candidates"]]
    assert len(gains) == 3
    assert gains == sorted(gains, reverse=True)
    assert min(gains) > 0
    assert data["candidates"][0]["seen"]
    assert "teach most" in handeye("plan", folder, "--robot", "ur5e").out
    assert handeye.fails("plan", folder, "--first", "12")["code"] == "no_candidate"
    assert handeye.fails("plan", folder, "--together", "3")["exit_code"] == 2


def test_plan_ranks_stations_by_the_touch_error(handeye: Handeye, folder: Path) -> None:
    data = handeye.json("plan", folder, "--first", "8", "--touch-mm", "50")
    assert set(data["touch"]) == set(data["within_95"])
    assert data["touch_met"]
    assert [c["name"] for c in data["candidates"]]
    box = ["--work-box-mm", "4000", "4000", "0", "4100", "4100", "100"]
    error = handeye.fails("plan", folder, "--first", "8", "--touch-mm", "0.01", *box)
    assert error["code"] == "nothing_to_touch"
    assert not handeye.json("plan", folder, "--first", "8", "--touch-mm", "0.01")["touch_met"]
    assert handeye.fails("plan", folder, "--criterion", "trace")["exit_code"] == 2


def test_other_commands_take_one_of_the_cameras(handeye: Handeye, folder: Path) -> None:
    error = handeye.fails("doctor", folder)
    assert error["code"] == "several_cameras"
    assert "--only" in error["hint"]
    alone = handeye.json("solve", folder, "--only", "front")
    assert "T_base_camera" in alone
    assert handeye("validate", folder, "--only", "left").code == 0


def test_report_is_one_page_about_all_cameras(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    page = tmp_path / "rig.html"
    data = handeye.json("report", folder, "--output", page)
    assert list(data["cameras"]) == ["left", "right", "front", "side"]
    assert set(data["true_error"]) == {*data["cameras"], *data["camera_to_camera"]}
    text = page.read_text()
    for expected in ("left: T_flange_camera", "front: T_base_camera", "T_left_right", "T_base_target"):
        assert expected in text
    assert "<script" not in text
    for name in data["cameras"]:
        radius = data["cameras"][name]["within_95"]["translation_mm"]
        assert data["true_error"][name]["translation_mm"] < 2 * radius
    assert handeye("report", folder, "--model", "paper", "--output", page).code == 2


def test_validate_compares_halves_of_the_stations(handeye: Handeye, tmp_path: Path) -> None:
    rig = simulate_rig(ErrorKind.MIXTURE_CELL, 3, RigOptions(stations=16))
    write_rig(rig, tmp_path / "rig")
    data = handeye.json("validate", tmp_path / "rig", "--splits", "3", "--seed", "4")
    assert set(data["cameras"]) == {"left", "right", "front", "side"}
    assert set(data["camera_to_camera"]) == {"T_left_right", "T_front_side"}
    assert data["undetermined"] < data["splits"] == 3
    for one in (*data["cameras"].values(), *data["camera_to_camera"].values()):
        # What is stated is of the size of what differs.
        assert 0.05 < one["halves"]["nees_per_dof"] < 10
        assert one["truth"]["translation_mm"] < 2 * one["within_95"]["translation_mm"]
    few = simulate_rig(ErrorKind.MIXTURE_CELL, 3, RigOptions(stations=8))
    write_rig(few, tmp_path / "few")
    assert handeye("validate", tmp_path / "few").code == 3
