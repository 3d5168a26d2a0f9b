"""`handeye solve` and `handeye plan` with an arm whose kinematics are known."""

from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from folders import made_recording, written
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Pose


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    recording = simulate(ErrorKind.JOINT_OFFSETS, 3, CellOptions(offset_sigma_deg=(0.05, 0.05)))
    return written(recording, tmp_path / "cell")


def test_an_arm_by_name(handeye: Handeye, folder: Path) -> None:
    data = handeye.json("solve", folder, "--robot", "ur5e")
    assert [offset["joint"] for offset in data["joint_offsets"]] == [
        "shoulder_lift_joint",
        "elbow_joint",
        "wrist_1_joint",
        "wrist_2_joint",
    ]
    assert all({"offset_deg", "sigma_deg"} < set(offset) for offset in data["joint_offsets"])
    blind = handeye.json("solve", folder)
    assert "joint_offsets" not in blind
    assert data["sigma_translation_mm"] < 0.6 * blind["sigma_translation_mm"]
    shown = handeye("solve", folder, "--robot", "ur5e")
    assert shown.code == 0
    assert "wrist_1_joint" in shown.out
    assert "beyond where it is read" in shown.out


def test_an_arm_from_a_file(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    from importlib import resources

    shipped = resources.files("handeye.robots") / "arms" / "ur5e.urdf"
    file = tmp_path / "own.urdf"
    file.write_bytes(shipped.read_bytes())
    own = handeye.json("solve", folder, "--robot", file, "--robot-tip", "flange", "--robot-base", "base")
    named = handeye.json("solve", folder, "--robot", "ur5e")
    assert np.allclose(Pose(own["T_flange_camera"]), Pose(named["T_flange_camera"]), atol=1e-12)


def test_plans_with_an_arm(handeye: Handeye, folder: Path) -> None:
    known = handeye.json("plan", folder, "--first", "5", "--robot", "ur5e")
    unknown = handeye.json("plan", folder, "--first", "5")
    assert len(known["ranking"]) == len(unknown["ranking"])
    assert known["ranking"] != unknown["ranking"]


def test_orders_views_by_the_time_of_motions(handeye: Handeye, folder: Path) -> None:
    fast = handeye.json("plan", folder, "--together", "3", "--robot", "ur5e")["together"]
    slow = handeye.json("plan", folder, "--together", "3", "--robot", "ur5e", "--speed-deg-s", "10")[
        "together"
    ]
    assert (fast["measure"], fast["unit"], fast["speed_deg_s"]) == ("motion_time", "s", pytest.approx(30.0))
    assert slow["total"] > 2 * fast["total"]
    shown = " ".join(handeye("plan", folder, "--together", "3", "--robot", "ur5e").out.split())
    assert "the shortest way" in shown
    assert "no joint faster than 30 deg/s" in shown


def test_what_cannot_be_used_is_said(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    assert handeye.fails("solve", folder, "--robot", "epson_c4l")["code"] == "wrong_arm"
    assert handeye.fails("solve", folder, "--robot", "lbr_iiwa_14")["code"] == "wrong_arm"
    assert handeye.fails("solve", folder, "--robot", "no_such_arm")["code"] == "unknown_arm"
    assert handeye.fails("solve", folder, "--robot", tmp_path / "none.urdf")["code"] == "missing_file"
    assert handeye.fails("solve", folder, "--robot", "ur5e", "--robot-tip", "x")["code"] == "unknown_link"
    assert handeye.fails("solve", folder, "--robot", "ur5e", "--model", "paper")["exit_code"] == 2
    assert handeye.fails("solve", folder, "--robot-tip", "flange")["exit_code"] == 2
    bare = written(made_recording(6), tmp_path / "bare")
    assert handeye.fails("solve", bare, "--robot", "ur5e")["code"] == "no_joints"
