"""The driver of RoboDK keeps the contract against a mock of its API, through RoboDK's own library."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence

import pytest

from handeye.errors import DeviceError, InputError
from handeye.robots import Arm
from handeye.robots.drivers.robodk import RoboDKRobot
from handeye.robots.protocol import Goal
from handeye.session import contract
from handeye.testing import MockCell, RobotTests
from handeye.testing.robodk import MockRoboDK

pytest.importorskip("robodk.robolink", reason="robodk is not installed (extra robodk)")
GOALS = MockCell("ur5e", points_only=True).goals(speed_rad_s=2.0)


@pytest.fixture
def station() -> Iterator[MockRoboDK]:
    made = MockRoboDK(MockCell("ur5e", points_only=True))
    yield made
    made.close()
    assert made.unknown == []


@pytest.fixture
def robot(station: MockRoboDK) -> RoboDKRobot:
    return RoboDKRobot(station.address)


class TestContract(RobotTests):
    stops_by_itself = False

    @pytest.fixture
    def cable(self, station: MockRoboDK) -> tuple[Callable[[], None], Callable[[], None]]:
        return station.cut, station.mend

    @pytest.fixture(autouse=True)
    def _quick(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(contract, "INTERRUPTED_S", 1.5)

    @pytest.fixture
    def goals(self) -> Sequence[Goal]:
        return GOALS

    @pytest.fixture
    def unreachable(self) -> Goal:
        return Goal("far.1", GOALS[0].T_base_flange, (99.0,) * 6)

    @pytest.fixture
    def arm(self, station: MockRoboDK) -> Arm:
        return station.cell.arm


def test_a_lost_connection_is_said(station: MockRoboDK, robot: RoboDKRobot) -> None:
    raised: list[DeviceError] = []
    goal = contract.slowed(GOALS, 4.0)
    assert goal is not None

    def move() -> None:
        try:
            robot.move_to(goal)
        except DeviceError as error:
            raised.append(error)

    thread = threading.Thread(target=move)
    thread.start()
    time.sleep(0.5)
    station.close()
    thread.join(20)
    assert [error.code for error in raised] == ["connection_lost"]
    with pytest.raises(DeviceError):
        robot.stop()


def test_what_is_not_there_is_named(station: MockRoboDK) -> None:
    with pytest.raises(InputError):
        RoboDKRobot("localhost,UR5e,fast")
    where = station.address.partition(",")[0]
    with pytest.raises(DeviceError, match="no robot 'KR6'") as caught:
        RoboDKRobot(f"{where},KR6")
    assert caught.value.code == "no_robot"
    with pytest.raises(DeviceError, match="RoboDK") as caught:
        RoboDKRobot("127.0.0.1:9")
    assert caught.value.code == "connection_lost"
