"""`handeye check` and `handeye diff`: what moved, the exit code, the log."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from folders import photographed, written
from handeye.errors import ExitCode
from handeye.estimation import Measurements
from handeye.simulation.cells import CellOptions, ErrorKind, SimulatedCell, simulate_cell
from handeye.studies.shift import picture
from handeye.types import Pose, Target


@pytest.fixture(scope="module")
def cell() -> SimulatedCell:
    return simulate_cell(ErrorKind.MIXTURE_CELL, 4, CellOptions(views=(12, 12)))


def folders(cell: SimulatedCell, tmp_path: Path, shift: Pose) -> tuple[Path, Path]:
    """The calibration's folder, and one of two pictures taken again after a shift of the camera."""
    old = replace(cell.recording, views=cell.recording.views[:10])
    random = np.random.default_rng(0)
    moved = replace(cell, X=shift @ cell.X)
    views = tuple(picture(random, moved, np.zeros(6), view) for view in cell.recording.views[10:])
    new = replace(cell.recording, views=views)
    return written(old, tmp_path / "old"), written(new, tmp_path / "new")


def test_a_cell_in_place(handeye: Handeye, cell: SimulatedCell, tmp_path: Path) -> None:
    old, new = folders(cell, tmp_path, Pose.identity())
    outcome = handeye("check", old, new, "--robot", "ur5e", "--json")
    assert outcome.code == ExitCode.SUCCESS
    assert outcome.data["moved"] == "nothing"
    assert handeye("check", old, new).out.startswith("in place")


def test_a_camera_that_was_knocked(handeye: Handeye, cell: SimulatedCell, tmp_path: Path) -> None:
    old, new = folders(cell, tmp_path, Pose.exp([0.004, 0, 0, 0, 0, 0]))
    log = tmp_path / "nights.jsonl"
    picture_file = tmp_path / "nights.png"
    outcome = handeye("check", old, new, "--robot", "ur5e", "--json", "--log", log, "--picture", picture_file)
    assert outcome.code == ExitCode.MOVED
    assert outcome.data["moved"] == "camera"
    assert outcome.data["causes"][0]["translation_mm"] == pytest.approx(4.0, abs=1.0)
    assert outcome.data["log"]["moved_since_check"] == 1
    assert picture_file.stat().st_size > 1000
    shown = handeye("check", old, new, "--log", log)
    assert shown.out.startswith("moved")
    assert "2 checks in" in shown.out


def test_poses_are_planned(handeye: Handeye, cell: SimulatedCell, tmp_path: Path) -> None:
    old, _ = folders(cell, tmp_path, Pose.identity())
    found = handeye.json("check", old, "--plan", "3")
    assert len(found["poses"]) == 3
    assert found["detectable_mm"] > 0
    assert "Take pictures again where" in handeye("check", old).out


def test_views_of_another_board(handeye: Handeye, cell: SimulatedCell, tmp_path: Path) -> None:
    old, _ = folders(cell, tmp_path, Pose.identity())
    rows = cell.recording.target.to_dict()["rows"]
    larger = Target.from_dict({**cell.recording.target.to_dict(), "rows": rows + 1})
    view = cell.recording.views[11]
    more = replace(view, point_ids=[*view.point_ids[:-1], larger.point_count - 1])
    other = replace(cell.recording, target=larger, views=(more,))
    assert handeye.fails("check", old, written(other, tmp_path / "other"))["code"] == "another_target"
    measured = Measurements.of_recording(cell.recording).with_views([replace(more, name="of_another")])
    assert "(0 to" in measured.rejected["of_another"]


@pytest.mark.parametrize(
    "options", [("--plan", "1"), ("--log", "log"), ("--picture", "a.png")], ids=lambda options: options[0]
)
def test_options_that_do_not_fit(handeye: Handeye, tmp_path: Path, options: tuple[str, ...]) -> None:
    assert handeye("check", tmp_path, *options).code == ExitCode.USAGE


def test_diff(handeye: Handeye, cell: SimulatedCell, tmp_path: Path) -> None:
    one = written(replace(cell.recording, views=cell.recording.views[:6]), tmp_path / "one")
    other = written(replace(cell.recording, views=cell.recording.views[6:]), tmp_path / "other")
    result = tmp_path / "one.json"
    handeye.json("solve", one, "--output", result)
    found = handeye.json("diff", result, other)
    assert found["p_value"] > 0.01
    assert found["distance_mm"] == pytest.approx(np.linalg.norm(found["translation_mm"]))
    assert "than chance" in handeye("diff", result, other).out
    beside = simulate_cell(ErrorKind.PIXEL_ONLY, 1, CellOptions(mounting="eye_to_hand", views=(6, 6)))
    assert (
        handeye("diff", one, written(beside.recording, tmp_path / "beside")).code == ExitCode.UNUSABLE_INPUT
    )


def test_one_picture_where_the_arm_cannot_be_asked(handeye: Handeye, tmp_path: Path) -> None:
    folder, _ = photographed(tmp_path / "views")
    board = ("--rows", "5", "--columns", "7")
    same = handeye("check", folder, folder / "im_03.png", "--at", "im_03", *board, "--json")
    assert same.code == ExitCode.SUCCESS
    assert same.data["told_apart"] is False
    other = handeye("check", folder, folder / "im_05.png", "--at", "im_03", *board, "--json")
    assert other.code == ExitCode.MOVED
    assert "one picture does not tell which" in other.data["sentence"]
    assert (
        handeye.fails("check", folder, folder / "im_03.png", "--at", "none", *board)["code"] == "unknown_view"
    )
    assert handeye.fails("check", folder, "--at", "im_03", *board)["exit_code"] == ExitCode.USAGE
