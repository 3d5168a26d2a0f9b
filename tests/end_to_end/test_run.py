"""`handeye run` from nothing to a session that other commands take, without a robot."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from commands import Handeye
from folders import made_recording, written
from handeye.cameras.protocol import Frame
from handeye.cameras.simulated import Optics
from handeye.errors import ExitCode
from handeye.extension import CAMERAS, ROBOTS
from handeye.notations import NOTATIONS, read_pose_text
from handeye.robots import open_arm
from handeye.robots.protocol import Goal
from handeye.session.attempt import Cell
from handeye.session.calls import Calls
from handeye.session.simulated import SimulationOptions, simulated_cell

QUICK = ("--points-only", "0.1", "--seed", "5")
LOOSE = ("--accuracy-mm", "5", "--accuracy-deg", "0.5")


def test_a_session_is_run_resumed_and_solved(handeye: Handeye, tmp_path: Path) -> None:
    folder = tmp_path / "cell"
    data = handeye.json("run", "--session", folder, *QUICK)
    assert data["end"] == "accuracy_reached"
    assert data["request_met"] is True
    assert data["within_95"]["translation_mm"] <= 0.5
    assert data["true_error"]["translation_mm"] < 1.0
    page = (folder / "report.html").read_text()
    assert data["report"] == str(folder / "report.html")
    # The page weighs the joints as the run did: both promise the same.
    assert f"{data['within_95']['translation_mm']:.2f} mm" in page
    again = handeye.json("run", "--resume", "--session", folder)
    assert again == data
    solved = handeye.json("solve", folder)
    assert len(solved["views"]["used"]) == data["views"]
    # Solving by hand need not weigh the joints; the answer is the same within what it claims.
    off = np.array(solved["T_flange_camera"]) - np.array(data["calibration"]["T_flange_camera"])
    assert np.abs(off[:3, 3]).max() < 1e-3


def test_a_report_that_fails_does_not_fail_the_run(
    handeye: Handeye, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("no paper left")

    monkeypatch.setattr("handeye.report.gather_recording", broken)
    outcome = handeye("run", "--session", tmp_path / "cell", *QUICK, "--json")
    assert outcome.code == 0
    assert outcome.data["report"] is None
    assert "no paper left" in outcome.err


def test_a_dry_run_moves_and_writes_nothing(handeye: Handeye, tmp_path: Path) -> None:
    data = handeye.json("run", "--dry-run", "--session", tmp_path / "cell", "--robot", "ur5e")
    assert not (tmp_path / "cell").exists()
    arm = open_arm("ur5e")
    for goal in data["first_goals"]:
        reached = arm.forward(np.deg2rad(goal["joints_deg"]))
        assert np.allclose(reached, goal["T_base_flange"], atol=1e-6)
    text = handeye("run", "--dry-run").out
    line = next(line for line in text.splitlines() if line.strip().startswith("fanuc"))
    assert read_pose_text(line.split("fanuc")[1], NOTATIONS["fanuc"]).translation[2] > 0.2


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ((), 2),
        (("--resume",), 2),
        (("--driver", "manual"), 2),
        (("--session", "x", "--robot", "nobody"), 3),
        (("--session", "x", "--accuracy-mm", "-1"), 3),
        (("--dry-run", "--driver", "manual", "--images", "opencv:0"), 3),
        (("--session", "nowhere", "--resume"), 3),
        (("--session", "nowhere", "--resume", "--max-views", "9"), 2),
        (("--session", "nowhere", "--resume", "--speed-deg-s", "9"), 2),
        (("--session", "x", "--touch-mm", "0.5", "--tool-mm", "0", "0", "1e300"), 2),
        (("--session", "x", "--points-only", "inf"), 2),
        (("--session", "x", "--blur-px", "-1"), 2),
        (("--session", "x", "--accuracy-mm", "nan"), 2),
        (("--session", "missing/folder"), 7),
    ],
)
def test_what_does_not_go_together_is_said_before_anything_moves(
    handeye: Handeye,
    arguments: tuple[str, ...],
    code: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = handeye("run", *arguments)
    assert outcome.code == code, outcome.err
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_fails_ends_in_words_and_can_be_resumed(handeye: Handeye, tmp_path: Path) -> None:
    outcome = handeye(
        "run", "--session", tmp_path / "cell", "--points-only", "0.1", "--faults", "1", "--json"
    )
    assert outcome.code == 5
    assert outcome.error["code"] == "no_start"
    assert outcome.error["message"].startswith("nothing comes of the first view, where the arm stands: ")
    assert "--resume" in outcome.error["hint"]


def test_through_the_views_of_a_recording(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(9), tmp_path / "source")
    data = handeye.json("run", "--session", tmp_path / "s", "--driver", f"replay:{folder}", *LOOSE)
    assert (data["end"], data["request_met"]) == ("accuracy_reached", True)
    assert data["collisions_judged"].startswith("none")
    assert data["true_error"]["translation_mm"] < 0.5
    assert data["views"] == 6
    assert handeye.json("run", "--resume", "--session", tmp_path / "s")["calibration"] == data["calibration"]
    assert (tmp_path / "s" / "report.html").is_file()
    again = handeye.json("run", "--session", tmp_path / "t", "--driver", f"replay:{tmp_path / 's'}", *LOOSE)
    assert again["views"] == 6
    error = handeye.fails(
        "run", "--session", tmp_path / "u", "--driver", f"replay:{folder}", "--mounting", "eye-to-hand"
    )
    assert error["exit_code"] == 2
    assert handeye.fails("run", "--dry-run", "--driver", f"replay:{folder}")["exit_code"] == 2
    missing = handeye.fails("run", "--session", tmp_path / "u", "--driver", f"replay:{tmp_path / 'none'}")
    assert missing["exit_code"] == 3


class Opened:
    """Announces the drivers of a simulated cell, which note when they are closed."""

    def __init__(self, cell: Cell, group: str) -> None:
        self.closed = list[str]()
        self._device: Any = cell.robot if group == ROBOTS else cell.source
        self._group = group
        self.failing: BaseException | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._device, name)

    def load(self) -> Callable[[str], Any]:
        return lambda _: self

    def move_to(self, goal: Goal) -> None:
        if self.failing is not None and goal.label.startswith("view_02"):
            raise self.failing
        self._device.move_to(goal)

    def grab(self, label: str) -> Frame:
        return self._device.grab(label)

    def close(self) -> None:
        self.closed.append(self._group)


def test_drivers_are_closed_at_the_end_of_every_run(
    handeye: Handeye, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = SimulationOptions(seed=31, optics=Optics(points_only=0.1))
    cell = simulated_cell(open_arm("epson_c4l"), options).cell
    drivers = {group: Opened(cell, group) for group in (ROBOTS, CAMERAS)}
    monkeypatch.setattr("handeye.session.drivers.announced", lambda group: {"noted": drivers[group]})
    for name, value in (("camera", cell.camera), ("target", cell.target)):
        (tmp_path / f"{name}.json").write_text(json.dumps(value.to_dict()))
    line = [
        *("run", "--driver", "noted:x", "--images", "noted:x", "--robot", "epson_c4l", "--no-confirm"),
        *("--camera", tmp_path / "camera.json", "--target", tmp_path / "target.json"),
        *("--workspace-mm", "-900", "-900", "20", "900", "900", "1400", *LOOSE),
    ]

    def closed() -> list[int]:
        found = [len(driver.closed) for driver in drivers.values()]
        for driver in drivers.values():
            driver.closed.clear()
        return found

    assert handeye(*line, "--dry-run").code == 0
    assert closed() == [1, 1]
    drivers[ROBOTS].failing = KeyboardInterrupt()
    monkeypatch.setattr(Calls, "run", lambda _self, _seconds, call, *arguments: call(*arguments))
    assert handeye(*line, "--session", tmp_path / "s").code == ExitCode.INTERRUPTED
    assert closed() == [1, 1]
    drivers[ROBOTS].failing = None
    assert handeye("run", "--resume", "--session", tmp_path / "s", "--no-confirm").code == 0
    assert closed() == [1, 1]
