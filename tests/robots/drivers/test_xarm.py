"""The driver of UFACTORY's arms keeps the contract against a mock of the control box, which their library reads."""

import socket
import threading
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest

from handeye.errors import DeviceError, InputError
from handeye.robots import Arm
from handeye.robots.drivers import xarm
from handeye.robots.drivers.xarm import XArmRobot
from handeye.robots.protocol import Goal
from handeye.session import contract
from handeye.testing import MockCell, RobotTests
from handeye.testing.xarm import MockXArm

GOALS = MockCell("ur5e", points_only=True).goals(speed_rad_s=2.0)


@pytest.fixture
def box() -> Iterator[MockXArm]:
    made = MockXArm(MockCell("ur5e", points_only=True))
    yield made
    made.close()


@pytest.fixture
def robot(box: MockXArm) -> Iterator[XArmRobot]:
    made = XArmRobot(box.address)
    yield made
    made.close()


class TestContract(RobotTests):
    stops_by_itself = False

    @pytest.fixture(autouse=True)
    def _quick(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(contract, "INTERRUPTED_S", 1.5)
        monkeypatch.setattr(xarm, "ANSWER_S", 0.5)

    @pytest.fixture
    def cable(self, box: MockXArm) -> tuple[Callable[[], None], Callable[[], None]]:
        return box.cut, box.mend

    @pytest.fixture
    def goals(self) -> Sequence[Goal]:
        return GOALS

    @pytest.fixture
    def arm(self, box: MockXArm) -> Arm:
        return box.cell.arm


def test_what_is_beyond_the_limits_is_refused(robot: XArmRobot, box: MockXArm) -> None:
    far = Goal("far.1", GOALS[0].T_base_flange, (99.0,) * 6)
    with pytest.raises(DeviceError, match="error 23") as caught:
        robot.move_to(far)
    assert caught.value.code == "motion_refused"
    with pytest.raises(DeviceError) as caught:
        robot.move_to(GOALS[0])
    assert caught.value.code == "motion_refused"
    box.error = 0
    robot.move_to(GOALS[0])
    box.error = 1  # the emergency stop
    with pytest.raises(DeviceError, match="error 1") as caught:
        robot.move_to(GOALS[1])
    assert caught.value.code == "not_ready"


def test_a_lost_connection_is_said(robot: XArmRobot, box: MockXArm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xarm, "ANSWER_S", 0.3)
    box.cut()
    with pytest.raises(DeviceError, match="timed out") as caught:
        robot.read_pose()
    assert caught.value.code == "connection_lost"
    box.mend()
    assert robot.read_pose().joints_rad is not None


@pytest.mark.parametrize(
    "answer", [b"", b"\x00\x01\x00\x02\xff\xff\x0d", b"\x00\x01\x00\x02\x00\x00\x0d", b"HTTP/1.1 400"]
)
def test_another_server_is_no_control_box(answer: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xarm, "ANSWER_S", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            link, _ = server.accept()
            with link:
                link.recv(100)
                link.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(DeviceError) as caught:
            XArmRobot(f"127.0.0.1:{server.getsockname()[1]}")
        thread.join()
    assert caught.value.code == "connection_lost"


def test_addresses_are_read_or_refused() -> None:
    for address in ("", "host:port", "host,8", ":502"):
        with pytest.raises(InputError):
            XArmRobot(address)


def test_the_makers_library_reads_the_mock(box: MockXArm, monkeypatch: pytest.MonkeyPatch) -> None:
    """The mock speaks the protocol, not a dialect of its own."""
    pytest.importorskip("xarm.core", reason="xarm-python-sdk is not installed")
    from xarm.core.comm.socket_port import SocketPort
    from xarm.core.config.x_config import XCONF
    from xarm.core.wrapper.uxbus_cmd_tcp import UxbusCmdTcp

    # The library takes any other port for one that reports.
    monkeypatch.setattr(XCONF.SocketConf, "TCP_CONTROL_PORT", box.port)
    port = SocketPort("127.0.0.1", box.port, forbid_uds=True)
    try:
        commands = UxbusCmdTcp(port)
        assert commands.get_state()[0] == 0
        code, *joints = commands.get_joint_pos()
        assert code == 0
        assert np.allclose(joints[:6], box.cell.start_rad, atol=1e-6)
        code, *pose = commands.get_tcp_pose()
        assert code == 0
        assert np.allclose(
            np.array(pose[:3]) / 1000, box.cell.arm.forward(box.cell.start_rad)[:3, 3], atol=1e-6
        )
        for ask in (
            lambda: commands.motion_en(8, 1),
            lambda: commands.set_mode(0),
            lambda: commands.set_state(0),
        ):
            assert ask()[0] == 0
        there = GOALS[1].joints_rad
        assert there is not None
        assert commands.move_joint([*there, 0.0], 2.0, 10.0, 0)[0] == 0
        robot = XArmRobot(box.address)
        end = robot._settled()
        robot.close()
        assert np.allclose(end, there, atol=1e-5)
    finally:
        port.close()
        socket.setdefaulttimeout(None)  # which that library sets for the whole process


def test_poses_are_those_of_the_flange(robot: XArmRobot, box: MockXArm) -> None:
    for goal in GOALS:
        robot.move_to(goal)
        found = robot.read_pose().T_base_flange
        assert np.allclose(found.matrix, goal.T_base_flange.matrix, atol=1e-5)
