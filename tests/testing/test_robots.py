"""The shipped tests of robots: ours pass, and each rule finds the driver that breaks it."""

import threading
import time
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from handeye.errors import DeviceError
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.session import contract
from handeye.testing import MockCell, RobotTests
from handeye.types import Pose
from rules import rules_of

CELL = MockCell("ur5e", points_only=True)
GOALS = CELL.goals()


class SlowArm:
    """A driver as it should be: an arm that takes its time, on a link that can be cut."""

    joint_limits: object = CELL.arm.limits

    def __init__(self) -> None:
        self.joints = np.array(CELL.start_rad)
        self.connected = True
        self.halted = threading.Event()
        self.closed = 0

    def close(self) -> None:
        self.closed += 1

    def move_to(self, goal: Goal) -> None:
        if goal.joints_rad is None:
            raise DeviceError("out of reach", code="motion_refused")
        self.halted.clear()
        here, there, began = self.joints.copy(), np.array(goal.joints_rad), time.monotonic()
        seconds = float(np.abs(there - here).max()) / goal.speed_rad_s
        while (share := (time.monotonic() - began) / max(seconds, 1e-9)) < 1:
            self.joints = here + share * (there - here)
            if self.halted.wait(0.005):
                raise DeviceError("stopped", code="stopped")
            if not self.connected:
                raise DeviceError("no connection", code="connection_lost")
        self.joints = there

    def read_pose(self) -> Reading:
        if not self.connected:
            raise DeviceError("no connection", code="connection_lost")
        return Reading(Pose(CELL.arm.forward(self.joints)), tuple(self.joints.tolist()))

    def stop(self) -> None:
        self.halted.set()


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contract, "INTERRUPTED_S", 0.4)
    monkeypatch.setattr(contract, "ENDED_S", 0.4)


class TestSlowArm(RobotTests):
    @pytest.fixture
    def robot(self) -> Robot:
        return SlowArm()

    @pytest.fixture
    def goals(self) -> Sequence[Goal]:
        return GOALS

    @pytest.fixture
    def unreachable(self) -> Goal:
        return CELL.beyond()

    @pytest.fixture
    def arm(self) -> Arm:
        return CELL.arm

    @pytest.fixture
    def cable(self, robot: SlowArm) -> tuple[Callable[[], None], Callable[[], None]]:
        return (lambda: setattr(robot, "connected", False)), (lambda: setattr(robot, "connected", True))


class TestSimulatedArm(RobotTests):
    takes_time = False

    @pytest.fixture
    def robot(self) -> Robot:
        return MockCell("epson_c4l", points_only=True)._hidden

    @pytest.fixture
    def goals(self) -> Sequence[Goal]:
        return MockCell("epson_c4l", points_only=True).goals()

    @pytest.fixture
    def unreachable(self) -> Goal:
        return CELL.beyond()


class NoStop:
    def __init__(self) -> None:
        self.read_pose, self.move_to = SlowArm().read_pose, SlowArm().move_to


class Degrees(SlowArm):
    def read_pose(self) -> Reading:
        reading = super().read_pose()
        return Reading(reading.T_base_flange, tuple(np.rad2deg(reading.joints_rad or ())))


class Millimetres(SlowArm):
    def read_pose(self) -> Reading:
        reading = super().read_pose()
        matrix = reading.T_base_flange.matrix.copy()
        matrix[:3, 3] *= 1000
        return Reading(Pose(matrix), reading.joints_rad)


class Tool(SlowArm):
    def read_pose(self) -> Reading:
        reading = super().read_pose()
        return Reading(reading.T_base_flange @ Pose.exp([0, 0, 0.05, 0, 0, 0]), reading.joints_rad)


class TooEarly(SlowArm):
    def move_to(self, goal: Goal) -> None:
        threading.Thread(target=super().move_to, args=(goal,), daemon=True).start()


class GoesAnyway(SlowArm):
    def move_to(self, goal: Goal) -> None:
        if goal.joints_rad is not None:
            super().move_to(goal)


class RefusesUnnamed(SlowArm):
    def move_to(self, goal: Goal) -> None:
        if goal.joints_rad is None:
            raise DeviceError("no")
        super().move_to(goal)


class MovesAndRefuses(SlowArm):
    def move_to(self, goal: Goal) -> None:
        if goal.joints_rad is None:
            self.joints = np.array(GOALS[2].joints_rad)
        super().move_to(goal)


class StopFails(SlowArm):
    def stop(self) -> None:
        raise OSError("no connection")


class TooFast(SlowArm):
    def move_to(self, goal: Goal) -> None:
        super().move_to(Goal(goal.label, goal.T_base_flange, goal.joints_rad, 3 * goal.speed_rad_s))


class DeafToStop(SlowArm):
    def stop(self) -> None:
        pass


class StopsSilently(SlowArm):
    def move_to(self, goal: Goal) -> None:
        try:
            super().move_to(goal)
        except DeviceError as error:
            if error.code == "motion_refused":
                raise


class NeverAgain(SlowArm):
    def stop(self) -> None:
        super().stop()
        self.stopped = True

    def move_to(self, goal: Goal) -> None:
        if hasattr(self, "stopped"):
            raise DeviceError("stopped")
        super().move_to(goal)


class SilentLoss(SlowArm):
    """The link is gone, and it waits as long as the motion would take."""

    def move_to(self, goal: Goal) -> None:
        try:
            super().move_to(goal)
        except DeviceError as error:
            if error.code != "connection_lost":
                raise


class GoesOnBlind(SlowArm):
    """The controller goes on by itself once the link is gone."""

    def move_to(self, goal: Goal) -> None:
        try:
            super().move_to(goal)
        except DeviceError as error:
            if error.code == "connection_lost":
                self.joints = np.array(goal.joints_rad)
            raise


class NotMended(SlowArm):
    def read_pose(self) -> Reading:
        self.connected = self.connected and not hasattr(self, "lost")
        return super().read_pose()

    def move_to(self, goal: Goal) -> None:
        try:
            super().move_to(goal)
        except DeviceError:
            self.lost = True
            raise


class ClosesOnce(SlowArm):
    def close(self) -> None:
        super().close()
        if self.closed > 1:
            raise ValueError("closed already")


class ClosesPolitely(SlowArm):
    """It says goodbye, and cannot where nobody hears it."""

    def close(self) -> None:
        self.read_pose()


class Raw(SlowArm):
    def read_pose(self) -> Reading:
        return super().read_pose().T_base_flange  # type: ignore[return-value]


class Inverse(SlowArm):
    def read_pose(self) -> Reading:
        reading = super().read_pose()
        return Reading(reading.T_base_flange.inverse(), reading.joints_rad)


class OneJointLess(SlowArm):
    def read_pose(self) -> Reading:
        reading = super().read_pose()
        return Reading(reading.T_base_flange, (reading.joints_rad or ())[:-1])


class Restless(SlowArm):
    def read_pose(self) -> Reading:
        self.joints = self.joints + np.array([0.002, 0, 0, 0, 0, 0])
        return super().read_pose()


class HangsOnStop(SlowArm):
    """It hears of the stop only once the motion would have ended, and stands where it was stopped."""

    def move_to(self, goal: Goal) -> None:
        try:
            super().move_to(goal)
        except DeviceError as error:
            if error.code == "stopped":
                time.sleep(1.0)
            raise


class StopsWithAnyError(SlowArm):
    def move_to(self, goal: Goal) -> None:
        try:
            super().move_to(goal)
        except DeviceError as error:
            if error.code == "stopped":
                raise RuntimeError("stopped") from error
            raise


class MuteOnceStopped(SlowArm):
    def read_pose(self) -> Reading:
        if self.halted.is_set():
            raise DeviceError("no answer")
        return super().read_pose()


class Coasts(SlowArm):
    """It says that it has stopped, and rolls on."""

    def read_pose(self) -> Reading:
        if self.halted.is_set():
            self.joints = self.joints + np.array([0.002, 0, 0, 0, 0, 0])
        return super().read_pose()


class LimitsOfOneJoint(SlowArm):
    joint_limits = ((-3.0, 3.0),)


class LimitsTurnedRound(SlowArm):
    joint_limits = np.fliplr(CELL.arm.limits)


class LimitsInTurns(SlowArm):
    joint_limits = CELL.arm.limits / 100


BROKEN: list[tuple[type, str, str]] = [
    (NoStop, "test_has_the_methods", "lacks"),
    (Degrees, "test_ends_where_it_was_sent_and_says_so", "degrees"),
    (Millimetres, "test_ends_where_it_was_sent_and_says_so", "millimetres"),
    (Tool, "test_ends_where_it_was_sent_and_says_so", "flange of the description"),
    (TooEarly, "test_ends_where_it_was_sent_and_says_so", "before the arm rests|away"),
    (Raw, "test_ends_where_it_was_sent_and_says_so", "expected Reading"),
    (Inverse, "test_ends_where_it_was_sent_and_says_so", "base in the flange"),
    (OneJointLess, "test_ends_where_it_was_sent_and_says_so", "5 joint positions"),
    (Restless, "test_ends_where_it_was_sent_and_says_so", "before the arm rests"),
    (GoesAnyway, "test_refuses_what_it_cannot_reach", "must refuse"),
    (RefusesUnnamed, "test_refuses_what_it_cannot_reach", "motion_refused"),
    (MovesAndRefuses, "test_refuses_what_it_cannot_reach", "all the same"),
    (LimitsOfOneJoint, "test_stands_within_the_limits_that_it_states", "of 6 joints"),
    (LimitsTurnedRound, "test_stands_within_the_limits_that_it_states", "not below the highest"),
    (LimitsInTurns, "test_stands_within_the_limits_that_it_states", "stands beyond them"),
    (StopFails, "test_stops_at_rest", "no connection"),
    (TooFast, "test_is_as_slow_as_asked", "at the speed of the goal"),
    (DeafToStop, "test_stops_in_mid_motion", "went on to its goal"),
    (StopsSilently, "test_stops_in_mid_motion", "as if the goal had been reached"),
    (NeverAgain, "test_stops_in_mid_motion", "stopped"),
    (HangsOnStop, "test_stops_in_mid_motion", "came back only"),
    (StopsWithAnyError, "test_stops_in_mid_motion", "RuntimeError, expected DeviceError"),
    (MuteOnceStopped, "test_stops_in_mid_motion", "cannot be read afterwards"),
    (Coasts, "test_stops_in_mid_motion", "still moves"),
    (SilentLoss, "test_says_that_the_connection_is_lost", "expected DeviceError"),
    (GoesOnBlind, "test_says_that_the_connection_is_lost", "without a connection"),
    (NotMended, "test_says_that_the_connection_is_lost", "once the connection is back"),
    (ClosesOnce, "test_can_be_closed", "second time: .*closed already"),
    (ClosesPolitely, "test_can_be_closed_without_a_connection", "first time: .*no connection"),
]


@pytest.mark.parametrize(("driver", "rule", "words"), BROKEN, ids=[kind.__name__ for kind, _, _ in BROKEN])
def test_each_rule_finds_who_breaks_it(driver: type, rule: str, words: str) -> None:
    robot = driver()
    given: dict[str, object] = {
        "robot": robot,
        "goals": GOALS,
        "unreachable": CELL.beyond(),
        "arm": CELL.arm,
        "cable": (
            lambda: setattr(robot, "connected", False),
            lambda: setattr(robot, "connected", True),
        ),
    }
    test = getattr(RobotTests(), rule)
    wanted = test.__code__.co_varnames[1 : test.__code__.co_argcount]
    with pytest.raises(AssertionError, match=words):
        test(**{name: given[name] for name in wanted})


def test_every_rule_is_broken_by_somebody() -> None:
    assert {rule for _, rule, _ in BROKEN} == rules_of(RobotTests)
