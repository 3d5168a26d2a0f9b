"""`handeye verify`, and `solve --touches`: verdict, exit code, and what the touches bring."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from commands import Handeye
from folders import written
from handeye.datasets.toml_text import toml_text
from handeye.errors import ExitCode
from handeye.simulation.cells import TARGET, CellOptions, ErrorKind, simulate_cell
from handeye.studies.probing import touch_corners
from handeye.types import Chessboard


def touched(tmp_path: Path, scale: float) -> tuple[Path, Path]:
    """A recording whose board is larger than stated, and the file of three touches."""
    board = Chessboard(TARGET.rows, TARGET.columns, TARGET.pitch_m * (1 + scale))
    cell = simulate_cell(ErrorKind.MIXTURE_CELL, 5, CellOptions(target=board), seed=21)
    cell = replace(cell, recording=replace(cell.recording, target=TARGET))
    probing = touch_corners(np.random.default_rng(2), cell, board.points)
    document = {
        "sigma_mm": 0.1,
        "tip": [{"name": "tool", "at_mm": [0.0, 0.0, 150.0], "sigma_mm": 0.3}],
        "touch": [
            {
                "tip": "tool",
                "point": touch.point,
                "T_base_flange": touch.T_base_flange.to_list(),
                "joints_rad": list(touch.joints_rad or ()),
            }
            for touch in probing.touches
        ],
    }
    file = tmp_path / "touches.toml"
    file.write_text(toml_text(document))
    return written(cell.recording, tmp_path / "recording"), file


def test_touches_agree(handeye: Handeye, tmp_path: Path) -> None:
    recording, touches = touched(tmp_path, 0.0)
    outcome = handeye("verify", recording, touches, "--robot", "ur5e", "--json")
    assert outcome.code == ExitCode.SUCCESS
    assert outcome.data["verdict"] == "agrees"
    assert set(outcome.data["tips"]) == {"tool"}
    shown = handeye("verify", recording, touches, "--robot", "ur5e").out
    assert shown.startswith("agrees")
    assert "tool at 0" in shown


def test_a_board_of_another_size_is_named(handeye: Handeye, tmp_path: Path) -> None:
    recording, touches = touched(tmp_path, 0.005)
    outcome = handeye("verify", recording, touches, "--robot", "ur5e", "--json")
    assert outcome.code == ExitCode.MOVED
    assert outcome.data["verdict"] == "board_size"
    assert abs(outcome.data["board_scale"] - 0.005) < 0.002
    alone = handeye.json("solve", recording, "--robot", "ur5e")
    together = handeye.json("solve", recording, "--robot", "ur5e", "--touches", touches)
    assert together["T_flange_camera"] != alone["T_flange_camera"]


def test_a_file_without_joints_is_refused_for_a_known_arm(handeye: Handeye, tmp_path: Path) -> None:
    recording, touches = touched(tmp_path, 0.0)
    lines = [line for line in touches.read_text().split("\n") if not line.startswith("joints_rad")]
    touches.write_text("\n".join(lines))
    assert handeye.fails("verify", recording, touches, "--robot", "ur5e")["code"] == "no_joints"
    assert handeye("verify", recording, touches, "--json").data["p_value"] > 0
