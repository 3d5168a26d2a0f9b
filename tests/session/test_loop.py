"""The closed loop on simulated cells: it reaches what was asked for, and faults end in words, not in numbers."""

import json
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handeye.cameras.simulated import Optics
from handeye.datasets import read_recording
from handeye.errors import DeviceError, InputError, SolveError
from handeye.estimation import Estimate, Measurements, RigEstimate, estimate_rig, solve
from handeye.robots import ArmKinematics, open_arm
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.session.attempt import Cell, Missed, Timeouts
from handeye.session.calls import Calls
from handeye.session.choosing import ArmChooser
from handeye.session.configuration import Prepared, begin, prepare
from handeye.session.deciding import EndReason, Halt, Situation, Step
from handeye.session.entry import Failure
from handeye.session.faults import FaultRates
from handeye.session.loop import End, Session
from handeye.session.settings import Configuration
from handeye.session.simulated import SimulatedCell, SimulationOptions, simulated_cell
from handeye.session.store import SessionStore, create_session
from handeye.session.wish import Wish
from handeye.types import Chessboard, CircleGrid, Mounting, Pose
from sessions import RIG, attempt, configured, run_rig


def ended(configuration: Configuration, folder: Path) -> tuple[End, Prepared, SessionStore]:
    prepared = prepare(configuration)
    session, store = begin(prepared, folder)
    end = session.run()
    store.close()
    return end, prepared, store


def session_of(made: SimulatedCell, cell: Cell, store: SessionStore, wish: Wish) -> Session:
    assert cell.arm is not None
    assert cell.workspace is not None
    chooser = ArmChooser(cell.arm, cell.workspace, cell.camera, made.start, wish)
    return Session(cell, store, chooser, wish)


def true_error(end: End, prepared: Prepared) -> tuple[float, float]:
    assert end.calibration is not None
    assert prepared.truth is not None
    assert prepared.truth.X is not None
    off = (end.calibration.X @ prepared.truth.X.inverse()).log()
    return 1e3 * float(np.linalg.norm(off[:3])), float(np.rad2deg(np.linalg.norm(off[3:])))


@pytest.mark.parametrize(
    ("robot", "mounting"), [("epson_c4l", Mounting.EYE_IN_HAND), ("ur5e", Mounting.EYE_TO_HAND)]
)
def test_it_reaches_what_was_asked_for(robot: str, mounting: Mounting, tmp_path: Path) -> None:
    # With the camera beside the robot, links that are off by 0.1 mm leave half a millimetre open.
    asked = {"accuracy_mm": 1.0, "accuracy_deg": 0.1}
    end, prepared, store = ended(configured(5, robot=robot, mounting=mounting, **asked), tmp_path / "s")
    assert end.reason is EndReason.ACCURACY_REACHED
    assert end.reach is not None
    assert end.reach.translation_mm <= 1.0
    millimetres, degrees = true_error(end, prepared)
    assert millimetres < 1.0
    assert degrees < 0.1
    # The session is a recording, and solves to the same answer.
    recording = read_recording(tmp_path / "s").recording
    assert recording == store.recording
    assert end.calibration is not None
    again = solve(recording, kinematics=ArmKinematics(prepared.arm))
    assert np.array_equal(again.X.matrix, end.calibration.X.matrix)
    # No proposal left the limits or touched anything.
    assert end.calibration is not None
    for entry in store.entries:
        assert prepared.arm.within_limits(entry.goal_joints)
        assert prepared.cell.workspace.contains(entry.goal.translation)


def test_a_camera_that_renders_and_a_detector_that_detects(tmp_path: Path) -> None:
    options = SimulationOptions(seed=4, target=Chessboard(5, 7, 0.03), camera_error=0.0, optics=Optics())
    made = simulated_cell(open_arm("epson_c4l"), options)
    store = create_session(tmp_path / "s", made.recording, {})
    end = session_of(made, made.cell, store, Wish(most_views=3, seed=4)).run()
    store.close()
    assert end.views == 3
    loaded = read_recording(tmp_path / "s")
    assert all(view.image is not None for view in loaded.recording.views)
    assert end.calibration is not None
    assert made.truth.X is not None
    assert (end.calibration.X @ made.truth.X.inverse()).rotation_angle_rad < np.deg2rad(0.5)


def test_labels_of_a_board_that_looks_the_same_when_turned(tmp_path: Path) -> None:
    target = CircleGrid(4, 4, 0.04, 0.02)
    options = SimulationOptions(seed=8, target=target, optics=Optics(points_only=0.05))
    made = simulated_cell(open_arm("epson_c4l"), options)

    class Turning:
        """Labels the points afresh in every picture, as a detector that cannot tell may."""

        def __init__(self) -> None:
            self.count = 0

        def grab(self, label: str) -> object:
            frame = made.cell.source.grab(label)
            assert frame.points is not None
            self.count += 1
            turn = target.symmetries[self.count % len(target.symmetries)]
            points = replace(frame.points, point_ids=turn[frame.points.point_ids])
            return replace(frame, points=points)

    cell = replace(made.cell, source=Turning())
    store = create_session(tmp_path / "s", made.recording, {})
    end = session_of(made, cell, store, Wish(seed=8)).run()
    store.close()
    assert end.reason is EndReason.ACCURACY_REACHED
    assert end.views == end.attempts


# Pairs, as each run takes its time.
FAULTS = [
    {"refused": Failure.MOTION_REFUSED, "not_found": Failure.NOT_FOUND},
    {"robot_dies": Failure.ROBOT_FAILED, "camera_hangs": Failure.CAMERA_TIMEOUT},
    {"camera_fails": Failure.CAMERA_FAILED, "stale": Failure.STALE_IMAGE},
    {"garbage": Failure.INCONSISTENT, "off_target": None},
]


@pytest.mark.parametrize("faults", FAULTS, ids="-".join)
def test_each_fault_is_noticed_named_and_overcome(faults: dict[str, Failure | None], tmp_path: Path) -> None:
    rates = FaultRates(**dict.fromkeys(faults, 0.3))
    configuration = configured(13, faults=rates, failures_in_a_row=20)
    end, prepared, store = ended(configuration, tmp_path / "s")
    assert end.reason is EndReason.ACCURACY_REACHED
    assert true_error(end, prepared)[0] < 1.0
    reasons = {entry.failure for entry in store.entries if entry.failure is not None}
    for failure in faults.values():
        if failure is None:
            assert any("the pose read back is used" in entry.detail for entry in store.entries)
        else:
            assert failure in reasons


def test_a_fault_that_stays_is_a_clear_stop_without_an_answer(tmp_path: Path) -> None:
    dead = configured(0, faults=FaultRates(camera_fails=1.0), failures_in_a_row=5)
    end, _, _ = ended(dead, tmp_path / "dead")
    assert (end.reason, end.attempts, end.calibration) == (EndReason.TOO_MANY_FAILURES, 5, None)
    assert "grab failed" in end.sentence
    blind = configured(0, faults=FaultRates(not_found=1.0))
    end, _, _ = ended(blind, tmp_path / "blind")
    assert (end.reason, end.calibration) == (EndReason.NO_START, None)


def test_nothing_moves_outside_the_workspace_or_unconfirmed() -> None:
    prepared = prepare(configured(0))
    assert prepared.hidden_arm is not None
    stands = prepared.hidden_arm.hidden_pose
    loop_goal = _goal(prepared)
    tiny = replace(prepared.cell.workspace, upper_m=np.array([0.1, 0.1, 0.1]))
    outside = attempt(replace(prepared.cell, workspace=tiny), loop_goal)
    asked = attempt(replace(prepared.cell, confirm=lambda _: False), loop_goal)
    for outcome, failure in ((outside, Failure.MOTION_REFUSED), (asked, Failure.NOT_CONFIRMED)):
        assert isinstance(outcome, Missed)
        assert outcome.failure is failure
    assert prepared.hidden_arm.hidden_pose is stands
    with pytest.raises(InputError, match="no workspace"):
        prepare(
            replace(configured(0), driver="manual"), camera=prepared.cell.camera, target=prepared.cell.target
        )


def _goal(prepared: Prepared) -> Goal:
    joints = np.array(prepared.start.joints_rad) + 0.05
    return Goal("view_01.1", Pose(prepared.arm.forward(joints)), tuple(joints.tolist()))


def test_a_driver_that_hangs_or_raises_becomes_an_error_of_ours() -> None:
    for seconds in (1.0, float("inf")):
        with pytest.raises(DeviceError, match="camera: ZeroDivisionError"):
            Calls("camera").run(seconds, lambda: 1 // 0)
        assert Calls("camera").run(seconds, int, "7") == 7
    with pytest.raises(DeviceError, match=r"no answer within 0\.05 s"):
        Calls("camera").run(0.05, threading.Event().wait, 1.0)


def test_the_decisions_say_how_they_came_about(tmp_path: Path) -> None:
    end, _, store = ended(configured(5), tmp_path / "s")
    planned = [entry for entry in store.entries if entry.phase == "plan"]
    assert planned
    for entry in planned:
        candidates = entry.decision["candidates"]
        assert max(candidates.values()) == pytest.approx(entry.decision["predicted_gain"], abs=1e-5)
        assert entry.decision["turned_down"]
        assert entry.decision["margin_px"] >= 20.0
    assert end.views >= len(planned)
    # Most steps climb to something better than what was drawn, and say from where.
    climbed = [entry.decision for entry in planned if "refined" in entry.decision]
    assert climbed
    for decision in climbed:
        assert decision["refined"]["from"] in decision["candidates"]
        assert decision["refined"]["seed_gain"] < decision["predicted_gain"]


def test_refinement_can_be_left_away(tmp_path: Path) -> None:
    _, _, store = ended(configured(5, refine=False, most_views=4), tmp_path / "s")
    planned = [entry.decision for entry in store.entries if entry.phase == "plan"]
    assert planned
    assert not any("refined" in decision for decision in planned)
    assert all(name.startswith("candidate_") for name in planned[0]["candidates"])


@pytest.mark.parametrize("stood", [(0.1, 0.2, 0.3), (), (0.0,) * 9])
def test_a_reading_of_another_length_in_an_old_journal_is_passed_over(
    tmp_path: Path, stood: tuple[float, ...]
) -> None:
    session, store = begin(prepare(configured(0, most_views=6)), tmp_path / "s")
    try:
        while len(session.views) < 4:
            step = session.next()
            assert isinstance(step, Step)
            last = session.take(step)
        refused = replace(
            last, number=last.number + 1, view=None, failure=Failure.MOTION_REFUSED, standing_rad=stood
        )
        store.append(refused)
        step = session.next()
        assert isinstance(step, Step)
        assert session.take(step).view is not None
    finally:
        store.close()


def test_settings_of_sessions_of_earlier_versions_are_read() -> None:
    known = replace(configured(3), timeouts=Timeouts(move_s=7.0)).to_dict()
    known["patience"] = known.pop("timeouts")
    assert Configuration.from_dict(known).timeouts.move_s == 7.0


def test_numbers_of_numpy_are_settings_too() -> None:
    low, high = (tuple(row) for row in np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.5]]))
    asked = Configuration("ur5e", accuracy_mm=np.float64(0.25), workspace_m=(low, high))
    again = Configuration.from_dict(json.loads(json.dumps(asked.to_dict())))
    assert (again.accuracy_mm, again.workspace_m) == (0.25, (low, high))


class Stuck:
    """A robot that from some motion on stays where it is."""

    def __init__(self, robot: Robot, first: int, error: DeviceError | None) -> None:
        self._robot, self._left, self._error = robot, first - 1, error

    def move_to(self, goal: Goal) -> None:
        self._left -= 1
        if self._left >= 0:
            self._robot.move_to(goal)
        elif self._error is not None:
            raise self._error

    def read_pose(self) -> Reading:
        return self._robot.read_pose()

    def stop(self) -> None:
        pass


@pytest.mark.parametrize("first", [1, 2, 4, 6])
@pytest.mark.parametrize(
    "error", [None, DeviceError("no", code="motion_refused"), DeviceError("no")], ids=["lies", "no", "fails"]
)
def test_a_robot_that_is_stuck_ends_the_session_by_name_within_few_attempts(
    tmp_path: Path, first: int, error: DeviceError | None
) -> None:
    prepared = prepare(configured(77, accuracy_mm=0.02, accuracy_deg=0.002))
    stuck = Stuck(prepared.cell.robot, first, error)
    prepared = replace(prepared, cell=replace(prepared.cell, robot=stuck))
    session, store = begin(prepared, tmp_path / "s")
    try:
        end = session.run()
        entries = store.entries
    finally:
        store.close()
    assert end.reason in {EndReason.TOO_MANY_FAILURES, EndReason.NO_START}
    missed = [entry for entry in entries if entry.failure is not None]
    assert len(missed) <= prepared.configuration.wish().failures_in_a_row
    # No place is tried for ever, and none that was seen is taken for another view.
    tries = prepared.configuration.wish().tries_at_a_place
    places = [entry.goal_joints for entry in missed if entry.failure is not Failure.ROBOT_FAILED]
    assert all(places.count(place) <= tries for place in places)
    assert len({entry.standing_rad for entry in entries if entry.view is not None}) == end.views


def test_numbers_that_fail_once_do_not_end_a_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session, store = begin(
        prepare(configured(6, accuracy_mm=None, accuracy_deg=None, most_views=6)), tmp_path / "s"
    )
    estimator, asked = session._estimator, list[int]()  # pyright: ignore[reportPrivateUsage]

    def failing(measurements: Measurements) -> Estimate:
        asked.append(len(measurements))
        if len(measurements) in {3, 5}:
            raise SolveError("singular")
        return estimator(measurements)

    monkeypatch.setattr(session, "_estimator", failing)
    try:
        end = session.run()
    finally:
        store.close()
    assert {3, 5} <= set(asked)
    assert (end.reason, end.views) == (EndReason.VIEWS_TAKEN, 6)
    assert end.calibration is not None


def test_numbers_that_fail_once_do_not_end_a_session_of_several_cameras(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = [2]

    def failing(*arguments: Any, **named: Any) -> RigEstimate:
        left[0] -= 1
        if left[0] >= 0:
            raise SolveError("singular")
        return estimate_rig(*arguments, **named)

    monkeypatch.setattr("handeye.session.rig.estimate_rig", failing)
    end = run_rig(replace(RIG, seed=4), tmp_path / "s")
    assert left[0] < 0
    assert end.stations == RIG.most_views
    assert end.calibration is not None


def test_in_doubt_nothing_is_reached_and_no_view_is_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, store = begin(prepare(configured(3, accuracy_mm=5, accuracy_deg=0.5)), tmp_path / "s")
    assert session.run().reason is EndReason.ACCURACY_REACHED
    situation, decide = session._situation(), session._decide  # pyright: ignore[reportPrivateUsage]
    store.close()
    assert isinstance(situation, Situation)
    assert isinstance(decide(situation), Halt)
    turned = decide(replace(situation, doubtful=True))
    assert isinstance(turned, Step)
    assert (turned.phase, turned.estimate) == ("start", None)
    # Where there is no room for a turn it is planned, by what is believed of the least.
    monkeypatch.setattr("handeye.session.choosing.starting_goal", lambda *_: None)
    planned = decide(replace(situation, doubtful=True))
    assert isinstance(planned, Step)
    assert (planned.phase, planned.estimate) == ("plan", None)
