"""`handeye solve` on recordings with mistakes: what it says, what it leaves out, and what it refuses."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from folders import made_recording, written
from handeye.types import Mounting, Pose, Recording, View


def changed(recording: Recording, change: Callable[[Pose], Pose]) -> Recording:
    """The recording with every robot pose changed."""
    return recording.with_views(
        [replace(view, T_base_flange=change(view.T_base_flange)) for view in recording.views]
    )


def in_millimetres(pose: Pose) -> Pose:
    matrix = pose.matrix.copy()
    matrix[:3, 3] *= 1000
    return Pose(matrix)


def with_view(recording: Recording, at: int, view: View) -> Recording:
    """The recording with one view in the place of another."""
    views = list(recording.views)
    views[at] = view
    return recording.with_views(views)


@pytest.mark.parametrize("mounting", list(Mounting))
def test_a_wrong_direction_is_refused(handeye: Handeye, tmp_path: Path, mounting: Mounting) -> None:
    recording = changed(made_recording(9, mounting=mounting), lambda pose: pose.inverse())
    error = handeye.fails("solve", written(recording, tmp_path / "made"))
    assert (error["exit_code"], error["code"]) == (3, "wrong_direction")
    assert "T_flange_base" in error["message"]
    assert "9 of 9 views agree" in error["message"]
    assert "invert the poses" in error["hint"]


@pytest.mark.parametrize("mounting", list(Mounting))
def test_a_wrong_unit_is_refused(handeye: Handeye, tmp_path: Path, mounting: Mounting) -> None:
    recording = changed(made_recording(9, mounting=mounting), in_millimetres)
    error = handeye.fails("solve", written(recording, tmp_path / "made"))
    assert (error["exit_code"], error["code"]) == (3, "wrong_unit")
    assert "translations of the robot poses are in millimetres" in error["message"]


def test_a_view_with_a_wrong_pose_is_left_out_and_named(handeye: Handeye, tmp_path: Path) -> None:
    clean = made_recording(9)
    wrong = replace(
        clean.views[4], T_base_flange=clean.views[4].T_base_flange @ Pose.exp([0.05, -0.08, 0, 0.1, 0.3, 0])
    )
    folder = written(with_view(clean, 4, wrong), tmp_path / "made")
    data = handeye.json("solve", folder)
    (finding,) = (f for f in data["diagnosis"] if f["code"] == "gross_pose")
    assert finding["evidence"]["views"] == ["view_04"]
    assert finding["evidence"]["translation_mm"] == pytest.approx(94, abs=10)
    assert finding["evidence"]["expected_mm"] < 5
    assert finding["sentence"].startswith("view_04: ")
    (rejected,) = data["views"]["rejected"]
    assert rejected["name"] == "view_04"
    assert rejected["reason"] in finding["sentence"]
    assert "the robot pose of this view is wrong" in " ".join(handeye("solve", folder).out.split())


def test_a_board_labelled_upside_down_is_used_all_the_same(handeye: Handeye, tmp_path: Path) -> None:
    clean = made_recording(9)
    flipped = replace(clean.views[2], point_ids=clean.views[2].point_ids[::-1].copy())
    data = handeye.json("solve", written(with_view(clean, 2, flipped), tmp_path / "made"))
    expected = handeye.json("solve", written(clean, tmp_path / "clean"))
    (finding,) = (f for f in data["diagnosis"] if f["code"] == "view_flipped")
    assert finding["evidence"]["views"] == ["view_02"]
    assert "turned by 180 degrees" in finding["sentence"]
    assert data["views"]["used"] == expected["views"]["used"]
    np.testing.assert_allclose(data["T_flange_camera"], expected["T_flange_camera"], atol=1e-6)


def test_nothing_is_said_of_a_clean_recording(handeye: Handeye, tmp_path: Path) -> None:
    data = handeye.json("solve", written(made_recording(9), tmp_path / "made"))
    assert [f["code"] for f in data["diagnosis"] if not f["code"].startswith("blame")] == []
