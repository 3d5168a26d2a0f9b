"""The driver of LeRobot's arms keeps the contract against a bus of servos behind a pseudo terminal."""

import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from handeye.errors import DeviceError, InputError
from handeye.robots import Arm, read_urdf
from handeye.robots.drivers.feetech import FeetechBus, packet
from handeye.robots.drivers.lerobot import STEP_RAD, LeRobotArm, trapezoid
from handeye.robots.protocol import Goal
from handeye.session import contract
from handeye.testing import RobotTests
from handeye.types import Pose

pytest.importorskip("serial", reason="pyserial is not installed (extra lerobot)")
pytest.importorskip("pty", reason="there are no pseudo terminals on this system")
from handeye.testing.feetech import MockFeetechBus

NAMES = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
AXES = ("0 0 1", "0 1 0", "0 1 0", "0 1 0", "1 0 0")
RANGE = (700, 3400)
MIDDLE = sum(RANGE) / 2
POSTURES = np.array([[0.1, -0.2, 0.3, 0.2, 0.0], [0.3, 0.0, 0.1, 0.4, -0.3], [-0.1, 0.1, 0.2, 0.0, 0.2]])


def description() -> str:
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        f'<origin xyz="0.1 0 0.02"/><axis xyz="{axis}"/><limit lower="-2" upper="2" effort="1" velocity="3"/></joint>'
        for k, (name, axis) in enumerate(zip(NAMES, AXES, strict=True))
    )
    links = "".join(f'<link name="l{k}"/>' for k in range(6))
    return f'<robot name="so101">{links}{joints}</robot>'


def calibration() -> dict[str, dict[str, int]]:
    return {
        name: {"id": k, "drive_mode": 0, "homing_offset": 12, "range_min": RANGE[0], "range_max": RANGE[1]}
        for k, name in enumerate((*NAMES, "gripper"), 1)
    }


@pytest.fixture
def files(tmp_path: Path) -> str:
    (tmp_path / "so101.urdf").write_text(description())
    (tmp_path / "so101.json").write_text(json.dumps(calibration()))
    return f"{tmp_path / 'so101.json'},{tmp_path / 'so101.urdf'}"


@pytest.fixture
def bus() -> Iterator[MockFeetechBus]:
    made = MockFeetechBus([round(MIDDLE + q / STEP_RAD) for q in (*POSTURES[2], 0.0)])
    yield made
    made.close()


@pytest.fixture
def robot(bus: MockFeetechBus, files: str) -> LeRobotArm:
    return LeRobotArm(f"{bus.address},{files}")


class TestContract(RobotTests):
    @pytest.fixture(autouse=True)
    def _quick(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(contract, "INTERRUPTED_S", 1.5)

    @pytest.fixture
    def arm(self, files: str) -> Arm:
        return read_urdf(files.split(",")[1])

    @pytest.fixture
    def goals(self, arm: Arm) -> Sequence[Goal]:
        return [
            Goal(f"view_{k}.1", Pose(arm.forward(q)), tuple(q.tolist()), 1.0) for k, q in enumerate(POSTURES)
        ]

    @pytest.fixture
    def unreachable(self) -> Goal:
        return Goal("far.1", Pose.identity(), (2.5, 0.0, 0.0, 0.0, 0.0))

    @pytest.fixture
    def cable(self, bus: MockFeetechBus) -> tuple[Callable[[], None], Callable[[], None]]:
        return bus.cut, bus.mend


def test_a_servo_in_trouble_is_named(bus: MockFeetechBus, robot: LeRobotArm) -> None:
    bus.error_bits = 0x20
    with pytest.raises(DeviceError, match=r"servo 1 reports an error \(bits 0x20") as caught:
        robot.read_pose()
    assert caught.value.code == "not_ready"


def test_no_servo_is_ever_told_speed_zero(bus: MockFeetechBus, robot: LeRobotArm) -> None:
    """Which it would take for as fast as it can."""
    speeds: list[int] = []
    take = bus._take

    def look(request: bytes) -> None:
        if request[4] == 0x83:
            speeds.extend(
                int.from_bytes(request[k + 6 : k + 8], "little") for k in range(7, len(request) - 1, 8)
            )
        take(request)

    bus._take = look  # type: ignore[method-assign]
    joints = POSTURES[2] + [0.2, 0, 0, 0, 0]
    robot.move_to(Goal("view_01.1", Pose.identity(), tuple(joints.tolist()), 0.5))
    assert len(speeds) > 20
    assert min(speeds) >= 1
    assert max(speeds) <= 2 * 0.5 / STEP_RAD


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c.pop("wrist_flex"), "wrist_flex"),
        (lambda c: c["elbow_flex"].update(range_min=3500), "range 3500 to 3400"),
        (lambda c: c["elbow_flex"].update(range_max=9000), "range 700 to 9000"),
        (lambda c: c["elbow_flex"].update(id="3"), "Expected `int`"),
        (lambda c: c["elbow_flex"].update(drive_mode=1), "drive_mode 1"),
    ],
)
def test_a_calibration_that_cannot_be_used_is_refused(
    files: str, change: Callable[[dict[str, dict[str, int]]], object], words: str
) -> None:
    made = calibration()
    change(made)
    Path(files.split(",", maxsplit=1)[0]).write_text(json.dumps(made))
    with pytest.raises(InputError, match=words):
        LeRobotArm(f"/dev/null,{files}")


@pytest.mark.parametrize("text", ["", "[]", "{", "[" * 100_000, '{"shoulder_pan": 3}'])
def test_files_that_are_no_calibration_are_refused(files: str, text: str) -> None:
    Path(files.split(",", maxsplit=1)[0]).write_text(text)
    with pytest.raises(InputError):
        LeRobotArm(f"/dev/null,{files}")


def test_its_limits_are_those_that_were_calibrated(robot: LeRobotArm) -> None:
    limits = np.array(robot.joint_limits)
    assert limits[2] == pytest.approx(np.array([700 - 2050, 3400 - 2050]) * STEP_RAD)
    for joint, side in np.ndindex(limits.shape):
        there = POSTURES[0].copy()
        there[joint] = limits[joint, side]
        outward = STEP_RAD * (1 if side else -1)
        far = there + np.where(np.arange(5) == joint, outward, 0.0)
        with pytest.raises(DeviceError, match="calibrated from"):
            robot.move_to(Goal("far.1", Pose.identity(), tuple(far.tolist())))
        # The description is narrower here.
        with pytest.raises(DeviceError, match="beyond the joint limits"):
            robot.move_to(Goal("near.1", Pose.identity(), tuple(there.tolist())))


def test_a_port_that_is_not_there_is_named(files: str) -> None:
    with pytest.raises(DeviceError, match="/dev/ttyNONE") as caught:
        LeRobotArm(f"/dev/ttyNONE,{files}")
    assert caught.value.code == "connection_lost"
    with pytest.raises(InputError, match=r"PORT,CALIBRATION\.json,ARM\.urdf"):
        LeRobotArm("/dev/ttyNONE")


def test_packets_are_those_of_the_manual() -> None:
    # Ping of servo 1 and its answer, as printed in the protocol manual.
    assert packet(1, 1, b"").hex() == "ffff010201fb"
    assert packet(1, 0, b"").hex() == "ffff010200fc"


def test_garbled_answers_are_asked_for_again(bus: MockFeetechBus) -> None:
    link, write, garbled = FeetechBus(bus.address), os.write, [2]
    take = bus._take

    def spoil(request: bytes) -> None:
        if garbled[0]:
            garbled[0] -= 1
            write(bus._inside, b"\xff\xff\x01\x04\x00\x10")
        else:
            take(request)

    bus._take = spoil  # type: ignore[method-assign]
    assert link.read(1, 56, 2) == round(MIDDLE + POSTURES[2][0] / STEP_RAD)


@pytest.mark.parametrize("way", [0.001, 0.1, 2.0])
def test_a_trapezoid_begins_and_ends_at_rest(way: float) -> None:
    done, total_s = trapezoid(way, 0.5, 1.5)
    times = np.linspace(0, total_s, 2000)
    places = np.array([done(float(t)) for t in times])
    assert done(0.0) == 0
    assert done(total_s) == way
    assert np.all(np.diff(places) >= 0)
    assert np.diff(places).max() <= 0.5 * total_s / 1999 * 1.001
    assert math.isclose(places[1000], way / 2, rel_tol=0.01)
