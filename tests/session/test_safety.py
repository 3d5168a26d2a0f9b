"""Nothing is sent that was not checked from where the arm really stands."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from handeye.cameras.protocol import Frame, Points
from handeye.errors import DeviceError, InputError
from handeye.planning.collisions import Body
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.session.attempt import Cell, Missed, Seen, Timeouts
from handeye.session.configuration import Prepared, begin, go_on, prepare
from handeye.session.contract import check_at_rest
from handeye.session.deciding import EndReason, Situation
from handeye.session.entry import Entry, Failure
from handeye.session.safety import objection_to_motion
from handeye.types import Mounting, Pose
from sessions import attempt, configured

PREPARED = prepare(configured(0))
HOME = np.array(PREPARED.start.joints_rad) if PREPARED.start is not None else np.zeros(6)


class Recorder:
    """A robot that stands where it is told to say it stands, and keeps what was sent."""

    def __init__(self, robot: Robot, change: Callable[[Reading], object] = lambda reading: reading) -> None:
        self._robot, self.change = robot, change
        self.sent: list[Goal] = []
        self.stops = 0
        self.error: Exception | None = None
        self.moves = True

    def move_to(self, goal: Goal) -> None:
        self.sent.append(goal)
        if self.error is not None:
            raise self.error
        if self.moves:
            self._robot.move_to(goal)

    def read_pose(self) -> Reading:
        return self.change(self._robot.read_pose())  # type: ignore[return-value]

    def stop(self) -> None:
        self.stops += 1


def watched(seed: int = 0, **changes: object) -> tuple[Prepared, Recorder]:
    prepared = prepare(configured(seed, **changes))
    robot = Recorder(prepared.cell.robot)
    return replace(prepared, cell=replace(prepared.cell, robot=robot)), robot


def goal_at(arm: Arm, joints: np.ndarray, label: str = "view_01.1", **changes: float) -> Goal:
    return Goal(label, Pose(arm.forward(joints)), tuple(joints.tolist()), **changes)


def tried(cell: Cell, goal: Goal) -> Seen | Missed:
    return attempt(cell, goal)


def test_goals_that_break_a_rule_are_never_sent() -> None:
    prepared, robot = watched()
    arm, space = prepared.arm, prepared.cell.workspace
    assert space is not None
    low, high = arm.limits.T
    near = HOME + 0.05
    beyond = [np.where(np.arange(6) == i, high + 0.01, near) for i in range(6)]
    beyond += [np.where(np.arange(6) == i, low - 0.01, near) for i in range(6)]
    random = np.random.default_rng(0)
    drawn = random.uniform(low, high, (2000, 6))
    why = Body(arm, space).obstacles(drawn)
    floor = next(q for q, reason in zip(drawn, why, strict=True) if reason is not None and "floor" in reason)
    itself = next(
        q for q, reason in zip(drawn, why, strict=True) if reason is not None and "itself" in reason
    )
    cases = [(goal_at(arm, joints), "limits|workspace|floor|itself") for joints in beyond]
    # Turning the last joint moves nothing but the flange about its own axis: only its limits can speak.
    cases += [(goal_at(arm, beyond[5]), "limits"), (goal_at(arm, beyond[11]), "limits")]
    cases += [
        (goal_at(arm, floor), "floor|workspace|itself"),
        (goal_at(arm, itself), "floor|workspace|itself"),
        (Goal("a.1", Pose(arm.forward(near)), tuple(HOME.tolist())), "not the same place"),
        (Goal("a.1", Pose(arm.forward(near)), (float("nan"),) * 6), "finite"),
        (Goal("a.1", Pose(arm.forward(near)), tuple(near[:3].tolist())), "3 joints, expected 6"),
        (Goal("a.1", Pose(arm.forward(near))), "no joints"),
        (Goal("a.1", Pose.exp([5.0, 0, 1, 0, 0, 0]), tuple(near.tolist())), "outside the stated workspace"),
        (goal_at(arm, near, speed_rad_s=prepared.cell.speed_rad_s * 1.01), "faster"),
    ]
    for goal, words in cases:
        outcome = tried(prepared.cell, goal)
        assert isinstance(outcome, Missed)
        assert outcome.failure is Failure.MOTION_REFUSED
        assert any(word in outcome.detail for word in words.split("|")), (outcome.detail, words)
        assert not outcome.moved
        assert outcome.standing is not None
    assert robot.sent == []
    assert isinstance(tried(prepared.cell, goal_at(arm, near)), Seen)
    assert len(robot.sent) == 1


def test_the_way_is_judged_from_where_the_arm_stands() -> None:
    # Beside the arm's base on both sides, with the way between them through the floor of a high table.
    arm = PREPARED.arm
    space = replace(PREPARED.cell.workspace, floor_m=0.0) if PREPARED.cell.workspace is not None else None
    assert space is not None
    body = Body(arm, space)
    goal = goal_at(arm, HOME)
    free = HOME + 0.3
    assert objection_to_motion(body, goal, tuple(free.tolist()), 1.0) is None
    low = HOME + np.array([0.0, 1.5, 0.6, 0.0, 0.0, 0.0])
    high = HOME + np.array([0.0, 1.3, -1.2, 0.0, 0.0, 0.0])
    blocked = [q for q in (low, high) if body.obstacle_on_path(q, HOME) is not None]
    assert blocked
    for standing in blocked:
        assert objection_to_motion(body, goal, tuple(standing.tolist()), 1.0) is not None
    # The same goal, sent through a cell whose arm says that it stands there.
    prepared, robot = watched()
    stands = blocked[0]
    robot.change = lambda _: Reading(Pose(arm.forward(stands)), tuple(stands.tolist()))
    outcome = tried(prepared.cell, goal)
    assert isinstance(outcome, Missed)
    assert outcome.failure in {Failure.MOTION_REFUSED, Failure.BAD_READING}
    assert robot.sent == []


def test_what_is_mounted_takes_part() -> None:
    prepared, _ = watched(5)
    goal, here = goal_at(prepared.arm, HOME + 0.05), prepared.cell.read()
    assert prepared.cell.objection(goal, here, None) is None
    # A camera held out a metre and a half in front of the flange, which looks down at the table.
    held = SimpleNamespace(mounting=Mounting.EYE_IN_HAND, X=Pose.exp([0.0, 0.0, -1.5, 0, 0, 0]))
    why = prepared.cell.objection(goal, here, held)  # type: ignore[arg-type]
    assert why is not None
    assert "workspace" in why or "floor" in why
    # Held out to the side it is above the table, and beyond the box.
    aside = SimpleNamespace(mounting=Mounting.EYE_IN_HAND, X=Pose.exp([-1.5, 0.0, 0.0, 0, 0, 0]))
    why = prepared.cell.objection(goal, here, aside)  # type: ignore[arg-type]
    assert why == "flange or tool would leave the workspace"


def test_decisions_begin_where_the_journal_says_that_the_arm_stands(tmp_path: Path) -> None:
    prepared, _ = watched(5)
    session, store = begin(prepared, tmp_path / "s")
    for _ in range(3):
        session.take(session.next())  # type: ignore[arg-type]
    store.close()
    assert prepared.start is not None
    entries = list(store.entries)
    stood = tuple((HOME + 0.1).tolist())
    entries.append(replace(entries[-1], number=4, view=None, moved=True, standing_rad=stood))
    situation = Situation(tuple(entries), (), None, None)  # type: ignore[arg-type]
    assert situation.standing(prepared.start) == stood


def test_a_picture_that_comes_again_is_no_new_one() -> None:
    prepared, _ = watched(5)
    goal = goal_at(prepared.arm, HOME + 0.02)
    tried(prepared.cell, goal)  # which way it came from tells in the play of the joints
    first = tried(prepared.cell, goal)
    assert isinstance(first, Seen)
    again = attempt(prepared.cell, goal, frozenset({first.digest}))
    assert isinstance(again, Missed)
    assert again.failure is Failure.STALE_IMAGE


def test_readings_are_checked_before_the_first_motion(tmp_path: Path) -> None:
    def degrees(reading: Reading) -> Reading:
        return Reading(reading.T_base_flange, tuple(np.rad2deg(reading.joints_rad or ()).tolist()))

    prepared, robot = watched()
    robot.change = degrees
    session, store = begin(prepared, tmp_path / "s")
    with pytest.raises(DeviceError, match="in degrees"):
        session.run()
    store.close()
    assert robot.sent == []
    # Also where it begins only later.
    robot.change = lambda reading: reading
    assert isinstance(tried(prepared.cell, goal_at(prepared.arm, HOME + 0.02)), Seen)
    robot.change = degrees
    outcome = tried(prepared.cell, goal_at(prepared.arm, HOME))
    assert isinstance(outcome, Missed)
    assert outcome.failure is Failure.BAD_READING
    assert len(robot.sent) == 1


def test_a_robot_that_cannot_be_stopped_or_does_not_rest_is_not_moved() -> None:
    prepared, robot = watched()
    check_at_rest(prepared.cell)
    assert robot.stops == 1

    def broken() -> None:
        raise OSError("no connection")

    robot.stop = broken  # type: ignore[method-assign]
    with pytest.raises(DeviceError, match=r"cannot be stopped.*no connection"):
        check_at_rest(prepared.cell)
    prepared, robot = watched()
    drift = iter(np.linspace(0, 0.1, 50))

    def drifting(_: Reading) -> Reading:
        joints = HOME + next(drift)
        return Reading(Pose(prepared.arm.forward(joints)), tuple(joints.tolist()))

    robot.change = drifting
    with pytest.raises(DeviceError, match="moves before"):
        check_at_rest(prepared.cell)
    assert robot.sent == []


@pytest.mark.parametrize(
    ("error", "failure", "stops"),
    [
        (DeviceError("no", code="motion_refused"), Failure.MOTION_REFUSED, 0),
        (DeviceError("protective stop", code="stopped"), Failure.ROBOT_FAILED, 1),
        (OSError("cable"), Failure.ROBOT_FAILED, 1),
    ],
)
def test_after_a_motion_that_failed_the_arm_is_stopped_and_read_again(
    error: Exception, failure: Failure, stops: int
) -> None:
    prepared, robot = watched()
    robot.error = error
    stands = HOME + 0.07
    robot.change = lambda reading: reading if not robot.sent else _standing(prepared.arm, stands)
    outcome = tried(prepared.cell, goal_at(prepared.arm, HOME + 0.1))
    assert isinstance(outcome, Missed)
    assert (outcome.failure, outcome.moved, robot.stops) == (failure, True, stops)
    assert outcome.standing is not None
    assert outcome.standing.joints_rad == tuple(stands.tolist())


def _standing(arm: Arm, joints: np.ndarray) -> Reading:
    return Reading(Pose(arm.forward(joints)), tuple(joints.tolist()))


def test_where_a_motion_ended_is_judged_too() -> None:
    prepared, robot = watched()
    arm, space = prepared.arm, prepared.cell.workspace
    assert space is not None
    low, high = arm.limits.T
    drawn = np.random.default_rng(0).uniform(low, high, (2000, 6))
    why = Body(arm, space).obstacles(drawn)
    itself = next(
        q for q, reason in zip(drawn, why, strict=True) if reason is not None and "itself" in reason
    )
    aside = HOME + np.array([0.8, 0, 0, 0, 0, 0])
    narrow = replace(space, upper_m=np.array([1.4, 0.2, 1.7]))
    for workspace, ended, words in ((space, itself, "itself"), (narrow, aside, "outside the workspace")):
        prepared, robot = watched()
        hidden = prepared.hidden_arm
        assert hidden is not None
        robot.move_to = lambda goal, to=ended, by=hidden: by.move_to(goal_at(arm, to, goal.label))  # type: ignore[method-assign]
        outcome = tried(replace(prepared.cell, workspace=workspace), goal_at(arm, HOME + 0.05))
        assert isinstance(outcome, Missed)
        assert outcome.failure is Failure.ELSEWHERE
        assert words in outcome.detail
        assert robot.stops == 1


def test_the_next_decision_begins_where_the_arm_says_it_stands(tmp_path: Path) -> None:
    # A protective stop half way to the first planned view: the journal says where the arm stands, and the
    # next goal is reached from there.
    prepared, robot = watched(5)
    moves = robot.move_to

    def half(goal: Goal) -> None:
        if goal.label == "view_04.1":
            before = np.array(prepared.hidden_arm.read_pose().joints_rad)  # type: ignore[union-attr]
            middle = 0.5 * (before + np.array(goal.joints_rad))
            moves(goal_at(prepared.arm, middle, goal.label))
            raise DeviceError("protective stop", code="stopped")
        moves(goal)

    robot.move_to = half  # type: ignore[method-assign]
    session, store = begin(prepared, tmp_path / "s")
    end = session.run()
    entries = store.entries
    store.close()
    assert end.reason is EndReason.ACCURACY_REACHED
    failed = next(entry for entry in entries if entry.label == "view_04.1")
    assert failed.failure is Failure.ROBOT_FAILED
    assert failed.standing_rad != failed.goal_joints
    for entry in entries:
        if entry.view is not None:
            assert entry.standing_rad == entry.view.joints_rad


def test_a_robot_that_reports_success_and_stands_still_is_named(tmp_path: Path) -> None:
    prepared, robot = watched(5)
    session, store = begin(prepared, tmp_path / "s")
    entries: list[Entry] = []
    for _ in range(4):
        entries.append(session.take(session.next()))  # type: ignore[arg-type]
        robot.moves = len(entries) < 2
    store.close()
    assert [entry.failure for entry in entries] == [None, None, Failure.NOT_MOVED, Failure.NOT_MOVED]
    assert not entries[-1].moved


def test_a_camera_that_repeats_itself_but_for_noise_is_named(tmp_path: Path) -> None:
    prepared, _ = watched(5)
    random, first = np.random.default_rng(1), []

    class Frozen:
        def grab(self, label: str) -> Frame:
            frame = prepared.cell.source.grab(label)
            assert frame.points is not None
            first.append(frame.points)
            points = first[0]
            return Frame(
                None, Points(points.point_ids, points.pixels + 0.05 * random.normal(size=points.pixels.shape))
            )

    frozen = replace(prepared, cell=replace(prepared.cell, source=Frozen()))
    session, store = begin(frozen, tmp_path / "s")
    entries = [session.take(session.next()) for _ in range(3)]  # type: ignore[arg-type]
    store.close()
    assert [entry.failure for entry in entries] == [None, Failure.STALE_IMAGE, Failure.STALE_IMAGE]


@pytest.mark.parametrize(
    "answer",
    [
        None,
        np.zeros((1024, 1280), np.uint8),
        Frame(None, Points([0, 1, 2], [[1, 2]] * 3)),  # type: ignore[arg-type]
        Frame(None, Points(np.arange(70), np.full((70, 2), np.nan))),
        Frame(None, Points(np.zeros(70, int), np.ones((70, 2)))),
        Frame(None, Points(np.arange(7000), np.ones((7000, 2)))),
        Frame(None, Points("abc", None)),  # type: ignore[arg-type]
        Frame(np.zeros((10, 10), np.uint8)),
        Frame(np.zeros((1024, 1280), np.uint8), timestamp_s=float("nan")),
        Frame(np.zeros((1024, 1280), np.uint8), timestamp_s="now"),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_picture_is_a_rejected_attempt(answer: object, tmp_path: Path) -> None:
    prepared, _ = watched(5)

    class Wrong:
        def grab(self, label: str) -> object:
            return answer

    wrong = replace(prepared, cell=replace(prepared.cell, source=Wrong()))  # type: ignore[arg-type]
    session, store = begin(wrong, tmp_path / "s")
    entry = session.take(session.next())  # type: ignore[arg-type]
    store.close()
    assert entry.failure in {Failure.BAD_IMAGE, Failure.NOT_FOUND, Failure.INCONSISTENT}


def test_the_speed_that_was_asked_for_is_passed_on(tmp_path: Path) -> None:
    prepared, robot = watched(5, speed_rad_s=0.1234)
    session, store = begin(prepared, tmp_path / "s")
    session.run()
    store.close()
    assert {goal.speed_rad_s for goal in robot.sent} == {0.1234}
    fast, robot = watched(5, speed_rad_s=99.0, most_views=3)
    session, store = begin(fast, tmp_path / "t")
    session.run()
    store.close()
    # No joint of the arm can turn as fast.
    assert {goal.speed_rad_s for goal in robot.sent} == {float(fast.arm.velocities.min())}


def test_an_arm_that_stands_where_it_may_not_go_is_refused_at_once() -> None:
    lower, upper = (-1.4, -1.4, 0.02), (0.3, 1.4, 1.7)
    with pytest.raises(InputError, match="stands where it may not go"):
        prepare(configured(0, workspace_m=(lower, upper)))


def test_a_robot_that_hangs_ends_the_session_and_it_goes_on_later(tmp_path: Path) -> None:
    import threading

    prepared, robot = watched(5)
    timeouts = Timeouts(move_s=0.1, read_s=0.1, grab_s=5.0)
    moves, back = robot.move_to, threading.Event()

    def hangs(goal: Goal) -> None:
        if goal.label == "view_02.1":
            back.wait()
        else:
            moves(goal)

    robot.move_to = hangs  # type: ignore[method-assign]
    hanging = replace(prepared, cell=replace(prepared.cell, timeouts=timeouts))
    session, store = begin(hanging, tmp_path / "s")
    end = session.run()
    store.close()
    back.set()
    assert end.reason is EndReason.ROBOT_HANGS
    assert "has not come back" in end.sentence
    assert len(robot.sent) == 1
    session, store, _ = go_on(tmp_path / "s")
    assert session.run().reason is EndReason.ACCURACY_REACHED
    store.close()


def test_a_session_that_ended_in_failures_goes_on_when_it_is_told_to(tmp_path: Path) -> None:
    prepared, robot = watched(5)
    robot.error = OSError("cable")
    session, store = begin(prepared, tmp_path / "s")
    end = session.run()
    store.close()
    assert (end.reason, end.attempts) == (EndReason.TOO_MANY_FAILURES, 10)
    session, store, _ = go_on(tmp_path / "s")
    end = session.run()
    store.close()
    assert end.reason is EndReason.ACCURACY_REACHED
    assert end.attempts > 10


def test_a_view_with_joints_of_another_length_is_left_out(tmp_path: Path) -> None:
    # As older sessions may hold one.
    prepared, _ = watched(5)
    session, store = begin(prepared, tmp_path / "s")
    for _ in range(4):
        session.take(session.next())  # type: ignore[arg-type]
    last = store.entries[-1]
    assert last.view is not None
    view = last.view.to_dict() | {"name": "view_05", "joints_rad": [0.1, 0.2, 0.3]}
    entry = Entry.from_dict(last.to_dict() | {"number": 5, "label": "view_05.1", "view": view})
    store.append(entry)
    store.close()
    session, store, _ = go_on(tmp_path / "s")
    end = session.run()
    store.close()
    assert end.reason is EndReason.ACCURACY_REACHED
    assert "without view_05" in end.sentence
