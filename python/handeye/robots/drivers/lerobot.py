"""LeRobot's arms SO-100 and SO-101, over the bus of their servos (extra `lerobot`). Not tried on a real arm.

The servos have no watchdog: they are sent a place a moment ahead, again and again, so that where this process
or the cable fails the arm stops after that moment.
"""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.robots.drivers.feetech import (
    ACCELERATION_TO_SPEED,
    PRESENT_POSITION,
    STEPS_PER_TURN,
    TORQUE_ENABLE,
    FeetechBus,
)
from handeye.robots.model import Arm
from handeye.robots.protocol import Goal, Reading
from handeye.robots.shipped import open_arm
from handeye.types import Pose
from handeye.types.arrays import FloatArray

MAX_BYTES, MOST_SERVOS = 1 << 20, 252
STEP_RAD = 2 * math.pi / STEPS_PER_TURN
ACCELERATION_RAD_S2 = 1.5
# Places are sent so often, each the one of so much later.
CYCLE_S, AHEAD_S = 0.03, 0.15
# The servo may hurry after its place by so much; 0 would be as fast as it can.
HURRY = 1.5
# A servo that bears a load stays a little short; the arm rests where no joint has moved by more in so long.
NEAR_RAD, REST_RAD, REST_S, SETTLE_S = 0.05, 1.5 * STEP_RAD, 0.6, 20.0
# Short of its place it may only be late.
LATE_S = 2.0
# With this it holds the place at which it was stopped.
STOP_RAD_S = 0.2


class _Entry(msgspec.Struct):
    """What LeRobot has written of a joint."""

    id: int
    range_min: int
    range_max: int
    drive_mode: int = 0


@dataclass(frozen=True)
class _Servo:
    """The servo of a joint: its number, the step at zero, and the steps that it may reach."""

    number: int
    zero: float
    low: int
    high: int


class LeRobotArm:
    """An SO-100 or SO-101 that LeRobot has calibrated.

    Parameters
    ----------
    address
        Serial port, the file of LeRobot's calibration (.json) and the description of the arm (.urdf), whose
        joints have the calibration's names, separated by commas; after another comma the link at its tip,
        where it is not the last one.

    Raises
    ------
    InputError
        An address of another form, or a file that cannot be used.
    DeviceError
        The library, the port or a servo is not there.
    """

    def __init__(self, address: str) -> None:
        port, *files = address.split(",")
        if not port or len(files) not in {2, 3}:
            raise InputError(
                f"address {address[:80]!r}, expected PORT,CALIBRATION.json,ARM.urdf", code=Code.BAD_ADDRESS
            )
        self._arm = open_arm(files[1], tip=files[2] if len(files) == 3 else None)
        self._servos = _calibrated(Path(files[0]), self._arm)
        self._bus = FeetechBus(port)
        self._stopped = threading.Event()
        self._moving = threading.Lock()
        for servo in self._servos:
            self._bus.read(servo.number, *PRESENT_POSITION)

    @property
    def joint_limits(self) -> tuple[tuple[float, float], ...]:
        """Lowest and highest position of each joint that was calibrated, radians."""
        return tuple(((s.low - s.zero) * STEP_RAD, (s.high - s.zero) * STEP_RAD) for s in self._servos)

    @staticmethod
    def found() -> list[tuple[str, str]]:
        """Return the serial ports, behind which an arm may be.

        Raises
        ------
        DeviceError
            The library is not there.
        """
        from handeye.extension import library  # noqa: PLC0415 - beside the library itself

        ports = library("serial.tools.list_ports", "lerobot").comports()
        return [(each.device, str(each.description)) for each in ports if each.vid is not None]

    def move_to(self, goal: Goal) -> None:
        """Lead the joints to those of the goal, all in step.

        Raises
        ------
        DeviceError
            `motion_refused` without joints or beyond what was calibrated; `stopped`; `not_ready` where a
            servo reports an error; `connection_lost`.
        """
        there = self._checked(goal)
        self._stopped.clear()
        with self._moving:
            here = self._joints()
            self._lead(here, there, goal.speed_rad_s)
            joints = self._settled(there)
        off = float(np.abs(joints - there).max())
        if self._stopped.is_set() or off > NEAR_RAD:
            raise DeviceError(
                f"{goal.label}: stopped {np.rad2deg(off):.1f} deg short of it", code=Code.STOPPED
            )

    def read_pose(self) -> Reading:
        """Return the joints as the servos measure them, and the flange of the description there.

        Raises
        ------
        DeviceError
            `connection_lost`, `not_ready`.
        """
        joints = self._joints()
        return Reading(Pose(self._arm.forward(joints)), tuple(joints.tolist()))

    def stop(self) -> None:
        """Stop where it is; the servos go on holding the arm.

        Raises
        ------
        DeviceError
            `connection_lost`, `not_at_rest`.
        """
        self._stopped.set()
        with self._moving:  # move_to no longer sends places
            self._send(self._joints(), np.full(len(self._servos), STOP_RAD_S))
            self._settled()

    def close(self) -> None:
        """Let go of the port; the servos go on holding the arm."""
        self._bus.close()

    def _checked(self, goal: Goal) -> FloatArray:
        if goal.joints_rad is None or len(goal.joints_rad) != len(self._servos):
            raise DeviceError(
                f"{goal.label}: {len(self._servos)} joint positions are needed", code=Code.MOTION_REFUSED
            )
        there = np.array(goal.joints_rad, dtype=np.float64)
        steps = self._steps(there)
        for servo, name, step in zip(self._servos, self._arm.joint_names, steps, strict=True):
            if not servo.low <= step <= servo.high:
                raise DeviceError(
                    f"{goal.label}: {name} at step {step}, calibrated from {servo.low} to {servo.high}",
                    code=Code.MOTION_REFUSED,
                )
        if not self._arm.within_limits(there):
            raise DeviceError(f"{goal.label}: beyond the joint limits", code=Code.MOTION_REFUSED)
        return there

    def _lead(self, here: FloatArray, there: FloatArray, speed_rad_s: float) -> None:
        """Send places along the way, each a moment ahead, until the last or until `stop`."""
        turn = there - here
        way = float(np.abs(turn).max())
        if way < STEP_RAD / 2:
            return
        for servo in self._servos:
            self._bus.write(servo.number, *TORQUE_ENABLE, 1)
        done_at, total_s = trapezoid(way, speed_rad_s, ACCELERATION_RAD_S2)
        # The same to the end: a servo that is late must not creep.
        rates = HURRY * speed_rad_s * np.abs(turn) / way
        began = time.monotonic()
        while not self._stopped.is_set():
            at_s = time.monotonic() - began
            place = here + turn * done_at(at_s + AHEAD_S) / way
            self._send(place, rates)
            self._bus.read(self._servos[0].number, *PRESENT_POSITION)  # somebody is there
            if at_s > total_s:
                return
            time.sleep(CYCLE_S)

    def _send(self, joints: FloatArray, rates_rad_s: FloatArray) -> None:
        """Send places (n,) and the speeds (n,) to go there with: acceleration, position, time, speed."""
        values: dict[int, bytes] = {}
        for servo, step, rate in zip(self._servos, self._steps(joints), rates_rad_s, strict=True):
            speed = max(int(rate / STEP_RAD), 1)
            inside = min(max(step, servo.low), servo.high)
            values[servo.number] = b"\x00" + b"".join(n.to_bytes(2, "little") for n in (inside, 0, speed))
        self._bus.write_all(ACCELERATION_TO_SPEED[0], values)

    def _joints(self) -> FloatArray:
        steps = [self._bus.read(servo.number, *PRESENT_POSITION) for servo in self._servos]
        return np.array([(s - servo.zero) * STEP_RAD for s, servo in zip(steps, self._servos, strict=True)])

    def _steps(self, joints: FloatArray) -> list[int]:
        return [
            round(servo.zero + q / STEP_RAD) for q, servo in zip(joints.tolist(), self._servos, strict=True)
        ]

    def _settled(self, there: FloatArray | None = None) -> FloatArray:
        """Return the joints (n,) once they no longer change, longer where they are not yet `there`."""
        end = time.monotonic() + SETTLE_S
        since_s, reference = time.monotonic(), np.full(len(self._servos), np.inf)
        while time.monotonic() < end:
            joints = self._joints()
            if np.abs(joints - reference).max() > REST_RAD:
                since_s, reference = time.monotonic(), joints
            else:
                late = there is not None and np.abs(joints - there).max() > 2 * REST_RAD
                patient_s = LATE_S if late and not self._stopped.is_set() else REST_S
                if time.monotonic() - since_s > patient_s:
                    return joints
            time.sleep(CYCLE_S)
        raise DeviceError("the arm does not come to rest", code=Code.NOT_AT_REST)


def trapezoid(way: float, speed: float, acceleration: float) -> tuple[Callable[[float], float], float]:
    """Return how much of a way is done at a time, from rest to rest, and how long it takes."""
    top = min(speed, math.sqrt(way * acceleration))
    ramp_s = top / acceleration
    total_s = way / top + ramp_s

    def done(at_s: float) -> float:
        left_s = total_s - at_s
        if left_s <= 0:
            return way
        if at_s < ramp_s:
            return acceleration * at_s * at_s / 2
        if left_s < ramp_s:
            return way - acceleration * left_s * left_s / 2
        return top * (at_s - ramp_s / 2)

    return done, total_s


def _calibrated(file: Path, arm: Arm) -> list[_Servo]:
    """Return the servos of the joints of an arm, in their order, by LeRobot's calibration.

    Zero is the middle of the range, as in LeRobot's degrees; its homing offset is in the servo already.

    Raises
    ------
    InputError
        The file cannot be used, or lacks a joint.
    """
    try:
        text = file.read_bytes()
        entries = msgspec.json.decode(text[:MAX_BYTES], type=dict[str, _Entry])
    except (OSError, msgspec.MsgspecError, RecursionError) as error:
        raise InputError(f"{file}: {str(error)[:200]}", code=Code.BAD_CALIBRATION) from error
    servos: list[_Servo] = []
    for name in arm.joint_names:
        entry = entries.get(name)
        if entry is None:
            raise InputError(
                f"{file}: no calibration of joint {name[:60]!r}",
                code=Code.BAD_CALIBRATION,
                hint="the joints of the description must have LeRobot's names, such as shoulder_pan",
            )
        ordered = 0 <= entry.range_min < entry.range_max < STEPS_PER_TURN
        if not ordered or not 0 <= entry.id <= MOST_SERVOS or entry.drive_mode != 0:
            raise InputError(
                f"{file}: joint {name[:60]!r}: range {entry.range_min} to {entry.range_max}, servo "
                f"{entry.id}, drive_mode {entry.drive_mode}; "
                f"expected steps of one turn, 0 to {MOST_SERVOS}, and 0",
                code=Code.BAD_CALIBRATION,
            )
        middle = (entry.range_min + entry.range_max) / 2
        servos.append(_Servo(entry.id, middle, entry.range_min, entry.range_max))
    return servos
