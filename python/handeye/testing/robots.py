"""What every robot's driver must do."""

from collections.abc import Callable, Sequence

import pytest

from handeye.errors import DeviceError
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Robot
from handeye.robots.replay import is_near
from handeye.session.contract import (
    REST_M,
    REST_RAD,
    SECONDS,
    arrival,
    closed_twice,
    interrupted,
    limits_stated,
    read,
    refusal,
    slowed,
    speed_kept,
    stop_at_rest,
    stop_in_motion,
)

Cable = tuple[Callable[[], None], Callable[[], None]]


class RobotTests:
    """Subclass it and give the fixtures `robot` and `goals`; the other three where you can.

    robot
        The driver, connected.
    goals
        At least two goals that differ by 0.1 rad or more in some joint, with joints, safe in any order.
    unreachable
        A goal that must be refused; None where that cannot be tried.
    arm
        Description of the arm, with which its readings must agree; None to leave that out.
    cable
        Two functions: one that cuts the connection at once, one that mends it; None where there is none.

    `takes_time` is False for arms that stand at their goal at once, `stops_by_itself` for those whose
    controller goes on where it hears nothing: say so on the driver's page.

    Examples
    --------
    >>> class TestMine(RobotTests):  # with the fixtures `robot` and `goals`
    ...     takes_time = False
    >>> hasattr(TestMine, "test_has_the_methods")
    True
    """

    takes_time = True
    stops_by_itself = True

    @pytest.fixture
    def unreachable(self) -> Goal | None:
        """Nothing is tried."""
        return None

    @pytest.fixture
    def arm(self) -> Arm | None:
        """Not described."""
        return None

    @pytest.fixture
    def cable(self) -> Cable | None:
        """None."""
        return None

    def test_has_the_methods(self, robot: Robot) -> None:
        """It is a `Robot`."""
        assert isinstance(robot, Robot), "it lacks move_to, read_pose or stop"

    def test_ends_where_it_was_sent_and_says_so(
        self, robot: Robot, goals: Sequence[Goal], arm: Arm | None
    ) -> None:
        """Metres and radians, the flange of the description, at rest."""
        for goal in (*goals, goals[0]):
            assert arrival(robot, goal, arm) == []

    def test_refuses_what_it_cannot_reach(
        self, robot: Robot, goals: Sequence[Goal], unreachable: Goal | None
    ) -> None:
        """With `motion_refused`, and stays where it stands."""
        if unreachable is None:
            pytest.skip("no goal is known that can be refused safely")
        assert arrival(robot, goals[0]) == []
        assert refusal(robot, unreachable) == []
        assert arrival(robot, goals[1]) == []

    def test_stands_within_the_limits_that_it_states(self, robot: Robot, goals: Sequence[Goal]) -> None:
        """Two numbers for each joint, in radians, where it has `joint_limits`."""
        for goal in goals[:2]:
            assert arrival(robot, goal) == []
            assert limits_stated(robot) == []

    def test_stops_at_rest(self, robot: Robot) -> None:
        """From any thread, and twice."""
        assert stop_at_rest(robot) == []

    def test_is_as_slow_as_asked(self, robot: Robot, goals: Sequence[Goal]) -> None:
        """No joint turns faster than the goal says."""
        if not self.takes_time:
            pytest.skip("its motions take no time")
        assert speed_kept(robot, goals) == []

    def test_stops_in_mid_motion(self, robot: Robot, goals: Sequence[Goal]) -> None:
        """Short of the goal, says so, and goes on afterwards."""
        if not self.takes_time:
            pytest.skip("its motions take no time")
        assert stop_in_motion(robot, goals) == []

    def test_says_that_the_connection_is_lost(
        self, robot: Robot, goals: Sequence[Goal], cable: Cable | None
    ) -> None:
        """In mid-motion: an error; once mended it works again. It does not go on, if it `stops_by_itself`."""
        if cable is None:
            pytest.skip("there is no cable to pull")
        assert arrival(robot, goals[0]) == []
        slow = slowed(goals, SECONDS / 20)
        assert slow is not None, "goals with joints are needed"
        cut, mend = cable
        _, error = interrupted(robot, slow, cut)
        assert isinstance(error, DeviceError), f"{error!r}, expected DeviceError"
        mend()
        if not self.stops_by_itself:
            assert stop_at_rest(robot) == []
        first, second = read(robot), read(robot)
        assert first is not None, "the pose cannot be read once the connection is back"
        assert second is not None, "the pose cannot be read once the connection is back"
        assert is_near(first.T_base_flange, second.T_base_flange, REST_M, REST_RAD), (
            "the arm moves on without a connection"
        )
        if self.stops_by_itself:
            assert arrival(_Still(robot), slow), "the arm went on to its goal without a connection"
        assert arrival(robot, goals[1]) == []

    def test_can_be_closed(self, robot: Robot) -> None:
        """Twice, where it has `close`."""
        assert closed_twice(robot) == []

    def test_can_be_closed_without_a_connection(self, robot: Robot, cable: Cable | None) -> None:
        """A session that ends by a lost connection closes its driver too."""
        if cable is None:
            pytest.skip("there is no cable to pull")
        cut, mend = cable
        cut()
        try:
            assert closed_twice(robot) == []
        finally:
            mend()


class _Still:
    """A robot that is asked where it is, and not moved."""

    def __init__(self, robot: Robot) -> None:
        self.read_pose, self.stop = robot.read_pose, robot.stop

    def move_to(self, goal: Goal) -> None:
        """Stay."""
