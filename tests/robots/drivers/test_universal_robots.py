"""The driver of Universal Robots keeps the contract against a controller on loopback, and says what is wrong."""

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest

from handeye.errors import DeviceError, InputError
from handeye.robots import Arm
from handeye.robots.drivers.universal_robots import UniversalRobot
from handeye.robots.protocol import Goal, Robot
from handeye.session import contract
from handeye.testing import MockCell, RobotTests
from handeye.testing.universal_robots import MockUniversalRobot
from handeye.types import Pose

CELL = MockCell("ur5e", points_only=True)
GOALS = CELL.goals(speed_rad_s=2.0)


@pytest.fixture
def controller() -> Iterator[MockUniversalRobot]:
    # A tool that somebody set on the pendant is not to be seen.
    made = MockUniversalRobot(MockCell("ur5e", points_only=True), tool=Pose.exp([0.01, 0, 0.12, 0, 0.3, 0]))
    yield made
    made.close()


@pytest.fixture
def robot(controller: MockUniversalRobot) -> UniversalRobot:
    return UniversalRobot(controller.address)


class TestContract(RobotTests):
    @pytest.fixture(autouse=True)
    def _quick(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(contract, "INTERRUPTED_S", 1.5)

    @pytest.fixture
    def goals(self) -> Sequence[Goal]:
        return GOALS

    @pytest.fixture
    def unreachable(self) -> Goal:
        joints = (*GOALS[0].joints_rad[:5], 99.0)  # type: ignore[index]
        return Goal("far.1", Pose(CELL.arm.forward(joints)), joints)

    @pytest.fixture
    def arm(self) -> Arm:
        return CELL.arm

    @pytest.fixture
    def cable(self, controller: MockUniversalRobot) -> tuple[Callable[[], None], Callable[[], None]]:
        return controller.cut, controller.mend


def moving(robot: Robot, seconds: float) -> tuple[threading.Thread, list[DeviceError]]:
    """Begin a long motion; what it raises is in the list."""
    raised: list[DeviceError] = []
    assert contract.arrival(robot, GOALS[0]) == []
    goal = contract.slowed(GOALS, 6.0)
    assert goal is not None

    def move() -> None:
        try:
            robot.move_to(goal)
        except DeviceError as error:
            raised.append(error)

    thread = threading.Thread(target=move)
    thread.start()
    time.sleep(seconds)
    return thread, raised


def test_the_arm_stops_by_itself_where_the_cable_is_pulled(
    controller: MockUniversalRobot, robot: UniversalRobot
) -> None:
    thread, raised = moving(robot, 1.0)
    controller.cut()
    thread.join(10)
    first = controller.cell.joints_rad  # where it came to rest
    assert raised[0].code == "connection_lost"
    assert np.abs(np.subtract(GOALS[1].joints_rad, first)).max() > 0.01
    assert not controller._rate.any()
    controller.mend()
    assert robot.read_pose().joints_rad == pytest.approx(first)


def test_a_protective_stop_is_said_and_nothing_moves_until_it_is_unlocked(
    controller: MockUniversalRobot, robot: UniversalRobot
) -> None:
    thread, raised = moving(robot, 0.7)
    controller.protective_stop()
    thread.join(10)
    assert raised[0].code == "not_ready"
    assert "protective" in raised[0].message
    with pytest.raises(DeviceError, match="protective"):
        robot.move_to(GOALS[1])
    controller.unlock()
    robot.move_to(GOALS[1])


def test_a_program_of_somebody_else_ends_the_motion(
    controller: MockUniversalRobot, robot: UniversalRobot
) -> None:
    thread, raised = moving(robot, 0.7)
    UniversalRobot(controller.address).stop()
    thread.join(10)
    assert raised[0].code == "stopped"


def test_without_remote_control_it_says_so(controller: MockUniversalRobot, robot: UniversalRobot) -> None:
    controller.remote_control = False
    for act in (robot.read_pose, lambda: robot.move_to(GOALS[1])):
        with pytest.raises(DeviceError, match="does not run the program") as caught:
            act()
        assert "remote control" in str(caught.value.hint)


def test_who_is_not_there_or_no_controller_is_named() -> None:
    with pytest.raises(InputError):
        UniversalRobot("")
    with pytest.raises(DeviceError, match="no connection") as caught:
        UniversalRobot("127.0.0.1:9:9")
    assert caught.value.code == "connection_lost"
    with socket.create_server(("127.0.0.1", 0)) as other:

        def talk() -> None:
            link, _ = other.accept()
            with link:
                link.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n" * 4000)

        threading.Thread(target=talk, daemon=True).start()
        with pytest.raises(DeviceError):
            UniversalRobot(f"127.0.0.1:{other.getsockname()[1]}:9")


READER = """
import sys, rtde_receive
link = rtde_receive.RTDEReceiveInterface(sys.argv[1], 125.0)
print(*link.getActualQ(), *link.getActualTCPPose(), link.getSafetyStatusBits(), link.getRuntimeState())
link.disconnect()
"""


def test_the_library_of_others_reads_the_mock_as_a_controller() -> None:
    """So the mock speaks RTDE as others understand it, not only as the driver beside it does."""
    pytest.importorskip("rtde_receive", reason="ur-rtde is not installed")
    host = f"127.0.{os.getpid() % 250}.77"  # its ports are fixed
    tool = Pose.exp([0, 0, 0.1, 0, 0, 0])
    controller = MockUniversalRobot(CELL, host, tool, (30004, 30002))
    try:
        read = subprocess.run(
            [sys.executable, "-c", READER, host], capture_output=True, text=True, check=True, timeout=60
        )
    finally:
        controller.close()
    numbers = [float(word) for word in read.stdout.split()]
    assert numbers[:6] == pytest.approx(CELL.start_rad)
    assert numbers[6:9] == pytest.approx((CELL.T_base_flange @ tool).translation)
    assert numbers[12:] == [1, 1]
