"""The loop on a rig: it ends as asked, and goes on after kills and faults as if nothing had been."""

import json
import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import read_rig
from handeye.errors import InputError
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.session.deciding import EndReason, Step
from handeye.session.entry import Failure
from handeye.session.faults import FaultRates
from handeye.session.rig_prepared import begin_rig
from handeye.session.rig_store import open_rig_session
from handeye.session.settings import Configuration, RigSettings, Simulation
from handeye.studies.rig_cell import rig_cell
from handeye.studies.rig_loop import judged
from sessions import RIG, Lying, Outcome, run_killed, run_rig


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session of seven stations."""
    folder = tmp_path_factory.mktemp("rig") / "finished"
    run_rig(RIG, folder)
    return folder


def test_a_request_for_all_cameras_is_met_and_kept(tmp_path: Path) -> None:
    kept: list[bool] = []
    for seed in (5, 100, 101, 102):
        asked = Configuration(
            "ur5e",
            accuracy_mm=1.5,
            accuracy_deg=0.15,
            most_views=12,
            seed=seed,
            rig=RigSettings(candidates=100),
        )
        prepared = rig_cell(asked)
        session, store = begin_rig(prepared, tmp_path / str(seed))
        end = session.run()
        phases = [entry.phase for entry in store.entries]
        # The same in doubt has reached nothing.
        situation = replace(session._situation(), doubtful=True)  # pyright: ignore[reportPrivateUsage]
        assert isinstance(session._decide(situation), Step)  # pyright: ignore[reportPrivateUsage]
        store.close()
        assert end.reason is EndReason.ACCURACY_REACHED, seed
        assert end.calibration is not None
        # Turns that lose a board are not repeated until they keep it.
        assert phases.count("start") <= 5, seed
        run = judged(prepared, end)
        assert set(run.inside) == {"left", "right", "front", "side"}
        kept += run.inside.values()
    assert sum(kept) >= 15  # of 16, at 95 %


def test_an_arm_without_room_for_its_tool_goes_back_the_way_it_came(tmp_path: Path) -> None:
    """The last small turn ends where the board on the flange, once it is known, touches the arm."""
    asked = replace(RIG, seed=107, most_views=8, rig=RigSettings(candidates=100))
    end = run_rig(asked, tmp_path / "s")
    assert end.reason is EndReason.VIEWS_TAKEN
    store = open_rig_session(tmp_path / "s")
    store.close()
    phases = [entry.phase for entry in store.entries]
    first = phases.index("back")
    assert phases[first:] == ["back", "back", "plan", "plan"]
    for k, joints in enumerate(entry.goal_joints for entry in store.entries[first : first + 2]):
        assert joints == pytest.approx(store.entries[first - 2 - k].standing_rad)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_run_that_is_killed_goes_on_as_if_nothing_had_been(
    finished: Path, tmp_path: Path, seed: int
) -> None:
    began = time.monotonic()
    run_rig(RIG, tmp_path / "whole")
    mean_s = (time.monotonic() - began) / 6
    kills = run_killed(RIG, tmp_path / "killed", np.random.default_rng(seed), mean_s, run_rig)
    assert kills > 0
    assert Outcome.of(tmp_path / "killed") == Outcome.of(finished)
    assert read_rig(tmp_path / "killed").recording == read_rig(finished).recording


def test_what_a_break_leaves_of_the_recording_is_made_again(finished: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(finished, tmp_path / "s"))
    lost = next((folder / "corners").glob("station_03.*"))
    content = lost.read_bytes()
    lost.unlink()
    open_rig_session(folder).close()
    assert lost.read_bytes() == content
    (folder / "recording.toml").unlink()
    open_rig_session(folder).close()
    assert read_rig(folder).recording == read_rig(finished).recording


def test_what_was_edited_is_refused(finished: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(finished, tmp_path / "s"))
    corners = next((folder / "corners").glob("station_03.*"))
    good, table = corners.read_text(), folder / "recording.toml"
    number = good.split(",")[3]
    corners.write_text(good.replace(number, str(float(number) + 5), 1))
    with pytest.raises(InputError, match="station_03 is not as in the journal"):
        open_rig_session(folder)
    corners.write_text(good)
    said = table.read_text()
    table.write_text(said.replace('on = "flange"', 'on = "base"', 1))
    with pytest.raises(InputError, match="not those that the session began with"):
        open_rig_session(folder)
    table.write_text(said)
    lines = (folder / "journal.jsonl").read_bytes().splitlines(keepends=True)
    (folder / "journal.jsonl").write_bytes(b"".join(lines[:-1]))
    with pytest.raises(InputError) as caught:
        open_rig_session(folder)
    assert caught.value.code == "journal_cut"
    assert (folder / "corners" / corners.name).read_text() == good


@pytest.mark.parametrize("fault", ["refused", "robot_dies", "off_target", "camera_fails", "garbage"])
def test_each_fault_costs_attempts_but_no_station(tmp_path: Path, fault: str) -> None:
    rates = FaultRates(**{fault: 0.25})
    asked = replace(RIG, seed=4, most_views=6, simulation=Simulation(faults=rates))
    end = run_rig(asked, tmp_path / "s")
    assert end.reason is EndReason.VIEWS_TAKEN
    assert (end.stations, len(read_rig(tmp_path / "s").recording)) == (6, 6)
    assert end.calibration is not None
    entries = [json.loads(line) for line in (tmp_path / "s" / "journal.jsonl").read_text().splitlines()]
    # One camera that fails costs its own views; the others of the station are kept, and it is said.
    noticed = [e for e in entries if e.get("failure") or e.get("detail")]
    assert noticed
    off = judged(rig_cell(asked), end).error_mm
    assert max(off.values()) < 5


def test_a_robot_that_never_goes_ends_the_run(tmp_path: Path) -> None:
    end = run_rig(replace(RIG, simulation=Simulation(faults=FaultRates(refused=1.0))), tmp_path / "s")
    assert end.reason is EndReason.TOO_MANY_FAILURES
    assert (end.stations, end.calibration) == (0, None)


class Astray:
    """A robot that stands centimetres from where it says, at one station."""

    def __init__(self, robot: Robot, station: str, seed: int) -> None:
        self.robot, self.station, self.said = robot, station, None
        self.way = np.random.default_rng([seed, 77]).choice([-1, 1], 6)

    def move_to(self, goal: Goal) -> None:
        self.said: Reading | None = None
        if goal.label.startswith(self.station) and goal.joints_rad is not None:
            self.said = Reading(goal.T_base_flange, goal.joints_rad)
            off = np.array(goal.joints_rad) + 0.03 * self.way
            goal = Goal(goal.label, goal.T_base_flange, tuple(off.tolist()), goal.speed_rad_s)
        self.robot.move_to(goal)

    def read_pose(self) -> Reading:
        return self.said or self.robot.read_pose()

    def stop(self) -> None:
        self.robot.stop()


@pytest.mark.parametrize(("seed", "station"), [(70002, "station_01"), (70018, "station_02")])
def test_one_wrong_station_among_the_first_does_not_hold_up_the_others(
    tmp_path: Path, seed: int, station: str
) -> None:
    asked = replace(RIG, seed=seed)
    prepared = rig_cell(asked)
    astray = replace(prepared.cell, robot=Astray(prepared.cell.robot, station, seed))
    prepared = replace(prepared, cell=astray)
    session, store = begin_rig(prepared, tmp_path / "s")
    end = session.run()
    store.close()
    assert end.reason is EndReason.VIEWS_TAKEN
    run = judged(prepared, end)
    assert max(run.error_mm.values()) < 5
    assert end.calibration is not None
    assert any(station in finding.sentence for finding in end.calibration.diagnosis)


def test_a_rig_that_ended_without_an_answer_goes_on_when_the_robot_is_put_right(tmp_path: Path) -> None:
    asked = replace(RIG, seed=202, rig=RigSettings(candidates=100))
    prepared = rig_cell(asked)
    lying = Lying(prepared.cell.robot, range(3, 100), 0.5)
    session, store = begin_rig(replace(prepared, cell=replace(prepared.cell, robot=lying)), tmp_path / "s")
    end = session.run()
    store.close()
    assert (end.stations, end.calibration) == (7, None)
    end = run_rig(asked, tmp_path / "s")
    assert 7 < end.stations <= 15
    assert end.calibration is not None
    assert end.estimate is not None
    run = judged(prepared, end)
    for name in prepared.recording.cameras:
        assert run.error_mm[name] < 2 * end.estimate.of_camera(name).within_95.translation_mm


class Watched:
    """A robot that remembers where it was sent."""

    def __init__(self, robot: Robot) -> None:
        self.robot, self.goals = robot, list[Goal]()

    def move_to(self, goal: Goal) -> None:
        self.goals.append(goal)
        self.robot.move_to(goal)

    def read_pose(self) -> Reading:
        return self.robot.read_pose()

    def stop(self) -> None:
        self.robot.stop()


def test_no_goal_leaves_the_workspace_and_what_is_mounted_takes_part(tmp_path: Path) -> None:
    prepared = rig_cell(RIG)
    space = prepared.cell.workspace
    assert space is not None
    robot = Watched(prepared.cell.robot)
    low = prepared.start.T_base_flange.translation - 0.25
    tight = replace(space, lower_m=low, upper_m=low + 0.5)
    session, store = begin_rig(
        replace(prepared, cell=replace(prepared.cell, robot=robot, workspace=tight)), tmp_path / "s"
    )
    end = session.run()
    store.close()
    assert robot.goals
    assert all(tight.contains(goal.T_base_flange.translation) for goal in robot.goals)
    assert end.stations == 7


def test_cameras_that_do_not_move_against_the_arm_alone_are_no_start(tmp_path: Path) -> None:
    """Where no station ties every camera, small turns go on; they are counted, and the run ends."""
    blind = replace(RIG, most_views=4, simulation=Simulation(faults=FaultRates(not_found=1.0)))
    end = run_rig(blind, tmp_path / "s")
    assert end.reason in {EndReason.TOO_MANY_FAILURES, EndReason.NO_START}
    store = open_rig_session(tmp_path / "s")
    store.close()
    failures = {entry.failure for entry in store.entries}
    assert failures == {Failure.NOT_FOUND}
