"""The driver of arms in ROS 2: its motions without ROS, the contract against a process on loopback."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest

from handeye.errors import DeviceError, InputError
from handeye.robots import Arm
from handeye.robots.drivers.ros2 import ACCELERATION_RAD_S2, USUAL, Ros2Robot, profile
from handeye.robots.protocol import Goal
from handeye.ros.link import options_of
from handeye.session import contract
from handeye.testing import MockCell, RobotTests
from ros2_peer import BASE_AND_FLANGE, Peer

# Parsers that ROS brings along are older than this Python.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

GOALS = MockCell("ur5e", points_only=True).goals(speed_rad_s=2.0)


@pytest.mark.parametrize("seed", range(20))
def test_a_motion_begins_and_ends_at_rest_and_keeps_its_speed(seed: int) -> None:
    random = np.random.default_rng(seed)
    here, there = random.uniform(-3, 3, (2, 6))
    speed = float(random.uniform(0.05, 3))
    points, total_s = profile(here, there, speed)
    times = np.array([0.0, *(point[0] for point in points)])
    rates = np.array([np.zeros(6), *(point[2] for point in points)])
    accelerations = np.array([np.zeros(6), *(point[3] for point in points)])
    assert np.allclose(points[-1][1], there)
    assert times[-1] == pytest.approx(total_s)
    assert np.abs(rates).max() <= speed * (1 + 1e-9)
    assert np.abs(accelerations).max() <= ACCELERATION_RAD_S2 * (1 + 1e-9)
    assert np.allclose([rates[-1], accelerations[-1]], 0)
    moved = here + np.trapezoid(rates, times, axis=0)
    assert np.allclose(moved, there, atol=0.02 * np.abs(there - here).max())


def test_where_it_stands_is_a_short_motion_too() -> None:
    points, total_s = profile(np.zeros(6), np.zeros(6), 0.5)
    assert total_s == pytest.approx(0.2)
    assert len(points) >= 2


def test_addresses_are_read_or_refused() -> None:
    assert options_of("", "action", USUAL) == USUAL
    found = options_of("/arm/follow_joint_trajectory,base=world,flange=tcp", "action", USUAL)
    assert (found["action"], found["base"], found["flange"]) == (
        "/arm/follow_joint_trajectory",
        "world",
        "tcp",
    )
    assert options_of("base=world", "action", USUAL)["base"] == "world"
    for address in ("/a,/b", "/a,colour=red", "/a,base="):
        with pytest.raises(InputError):
            options_of(address, "action", USUAL)


@pytest.fixture(scope="module")
def peer() -> Iterator[Peer]:
    made = Peer()
    yield made
    made.close()


@pytest.fixture(scope="module")
def driver(peer: Peer) -> Iterator[Ros2Robot]:
    made = Ros2Robot(BASE_AND_FLANGE)
    yield made
    made.close()


class TestContract(RobotTests):
    stops_by_itself = False

    @pytest.fixture(autouse=True)
    def _quick(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(contract, "INTERRUPTED_S", 1.5)

    @pytest.fixture
    def robot(self, peer: Peer) -> Iterator[Ros2Robot]:
        made = Ros2Robot(BASE_AND_FLANGE)
        yield made
        made.close()

    @pytest.fixture
    def cable(self, peer: Peer) -> tuple[Callable[[], None], Callable[[], None]]:
        return peer.cut, peer.mend

    @pytest.fixture
    def goals(self) -> Sequence[Goal]:
        return GOALS

    @pytest.fixture
    def unreachable(self) -> Goal:
        return Goal("far.1", GOALS[0].T_base_flange, (99.0,) * 6)

    @pytest.fixture
    def arm(self) -> Arm:
        return MockCell("ur5e", points_only=True).arm


@pytest.mark.parametrize("stream", ["joints", "tf"])
@pytest.mark.parametrize("fault", ["late", "ahead", "unstamped", "backwards", "silent"])
def test_poses_with_wrong_or_late_stamps_are_refused(
    peer: Peer, driver: Ros2Robot, stream: str, fault: str
) -> None:
    driver.read_pose()
    peer.say(f"{stream} {fault}")
    time.sleep(0.3)
    try:
        with pytest.raises(DeviceError) as caught:
            driver.read_pose()
        expected = {"bad_stamp"} if fault != "silent" else {"no_joints", "no_message"}
        assert caught.value.code in expected
    finally:
        peer.say("well")
    driver.read_pose()


def test_a_controller_that_falls_silent_in_mid_motion_is_told_to_stop(peer: Peer, driver: Ros2Robot) -> None:
    driver.move_to(GOALS[0])
    slow = contract.slowed(GOALS, 4.0)
    assert slow is not None
    threading.Timer(1.0, peer.say, ("joints silent",)).start()
    with pytest.raises(DeviceError) as caught:
        driver.move_to(slow)
    peer.say("well")
    assert caught.value.code == "no_joints"
    driver.stop()
    first, second = driver.read_pose(), driver.read_pose()
    assert first.joints_rad is not None
    assert first.joints_rad == second.joints_rad
    assert np.abs(np.subtract(first.joints_rad, slow.joints_rad or ())).max() > 0.01
    driver.move_to(GOALS[1])


def test_a_trajectory_that_is_refused_and_a_controller_that_is_not_there(
    peer: Peer, driver: Ros2Robot
) -> None:
    peer.say("refuse")
    with pytest.raises(DeviceError) as caught:
        driver.move_to(GOALS[0])
    peer.say("well")
    assert caught.value.code == "motion_refused"
    other = Ros2Robot(f"/other/follow_joint_trajectory,{BASE_AND_FLANGE}")
    try:
        with pytest.raises(DeviceError, match="nobody offers") as caught:
            other.move_to(GOALS[0])
        assert caught.value.code == "not_ready"
    finally:
        other.close()
