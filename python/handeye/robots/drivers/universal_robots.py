"""Universal Robots: RTDE for what the arm does, programs in URScript for what it shall do.

Nothing is installed on the robot and no library is needed. A motion is one small program of the controller,
which stops by itself where this side falls silent. Not tried on a real arm.
"""

import secrets
import socket
import time
from typing import Any

import cv2
import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.robots.drivers.rtde import RTDE_PORT, RtdeClient
from handeye.robots.protocol import Goal, Reading
from handeye.types import Pose

# Programs are taken here; the controller also sends on this port, and is not listened to.
SCRIPT_PORT = 30002
# Registers 24 to 47 are for RTDE clients: which program speaks, how far it is, the flange's pose, our pulse.
WHO, STATE, PULSE, POSE = 24, 25, 24, range(24, 30)
RUNNING, DONE, REFUSED = 1, 2, 3
OUTPUTS = (
    "actual_q",
    "actual_qd",
    "runtime_state",
    "safety_status_bits",
    f"output_int_register_{WHO}",
    f"output_int_register_{STATE}",
    *(f"output_double_register_{i}" for i in POSE),
)
STOPPED = 1
# Protective, recovery, safeguard, emergency stops, violation, fault, and stopped due to safety.
NOT_READY_BITS = 0b111_1111_1100
ACCELERATION_RAD_S2, STOP_RAD_S2 = 0.8, 4.0
# The controller stops the arm where it hears nothing from here for half a second.
WATCHDOG_HZ = 2.0
TAKEN_S, STARTS_S, STOPS_S = 0.1, 3.0, 4.0
REST_RAD_S = 1e-3

_MOTION = """def handeye_motion():
  write_output_integer_register({state}, {running})
  write_output_integer_register({who}, {token})
  q = {joints}
  if is_within_safety_limits(q):
    rtde_set_watchdog("input_int_register_{pulse}", {watchdog}, "stop")
    movej(q, a={acceleration}, v={speed})
    write_output_integer_register({state}, {done})
  else:
    write_output_integer_register({state}, {refused})
  end
end
"""
_WHERE = """sec handeye_where():
  p = get_actual_tool_flange_pose()
{writes}
  write_output_integer_register({state}, {done})
  write_output_integer_register({who}, {token})
end
"""
_STOP = """def handeye_stop():
  stopj({stop})
end
"""


class UniversalRobot:
    """A CB3 (PolyScope 3.9 or later) or e-Series (5.3 or later) controller in remote control.

    Parameters
    ----------
    address
        Host, or `host:rtde_port:script_port`.

    Raises
    ------
    InputError
        An address of another form.
    DeviceError
        The controller is not there.
    """

    def __init__(self, address: str) -> None:
        host, _, ports = address.partition(":")
        rtde, _, script = ports.partition(":")
        if not host or not all(port.isdecimal() for port in (rtde, script) if port):
            raise InputError(
                f"address {address[:60]!r}, expected the robot's name or address",
                code=Code.BAD_ADDRESS,
                hint="such as ur:192.168.0.2",
            )
        self._host = host
        self._rtde_port = int(rtde or RTDE_PORT)
        self._script_port = int(script or SCRIPT_PORT)
        with self._connected() as link:
            link.receive()

    def move_to(self, goal: Goal) -> None:
        """Turn the joints to those of the goal.

        Raises
        ------
        DeviceError
            `motion_refused` outside the safety limits, or without joints; `connection_lost`;
            `not_ready` after a protective or emergency stop; `stopped` where it was stopped on its way.
        """
        if goal.joints_rad is None or len(goal.joints_rad) != 6:
            raise DeviceError(f"{goal.label}: six joint positions are needed", code=Code.MOTION_REFUSED)
        token = _token()
        program = _MOTION.format(
            who=WHO,
            state=STATE,
            pulse=PULSE,
            token=token,
            running=RUNNING,
            done=DONE,
            refused=REFUSED,
            joints=[float(q) for q in goal.joints_rad],
            watchdog=WATCHDOG_HZ,
            acceleration=ACCELERATION_RAD_S2,
            speed=float(goal.speed_rad_s),
        )
        with self._connected() as link:
            _check_ready(link.receive())
            self._send(program)
            _await_program(link, token)
            stopped = 0
            while True:
                link.send(secrets.randbelow(1 << 30))
                now = link.receive()
                _check_ready(now)
                if now[f"output_int_register_{WHO}"] != token:
                    raise DeviceError(
                        f"{goal.label}: stopped on its way by another program", code=Code.STOPPED
                    )
                state = now[f"output_int_register_{STATE}"]
                if state == REFUSED:
                    raise DeviceError(f"{goal.label}: outside the safety limits", code=Code.MOTION_REFUSED)
                if state == DONE and _rests(now):
                    return
                # The state of the program may lag behind the registers by a package.
                stopped = stopped + 1 if state == RUNNING and now["runtime_state"] == STOPPED else 0
                if stopped > 3:
                    raise DeviceError(f"{goal.label}: the controller stopped the program", code=Code.STOPPED)

    def read_pose(self) -> Reading:
        """Return pose of the flange, whatever tool is set, and joints.

        Raises
        ------
        DeviceError
            The connection is lost, or the controller runs no programs of others.
        """
        token = _token()
        writes = "\n".join(f"  write_output_float_register({i}, p[{k}])" for k, i in enumerate(POSE))
        with self._connected() as link:
            self._send(_WHERE.format(who=WHO, state=STATE, token=token, done=DONE, writes=writes))
            now = _await_program(link, token)
        pose = [now[f"output_double_register_{i}"] for i in POSE]
        matrix = np.eye(4)
        matrix[:3, :3] = cv2.Rodrigues(np.array(pose[3:]))[0]
        matrix[:3, 3] = pose[:3]
        return Reading(Pose(matrix), now["actual_q"])

    def stop(self) -> None:
        """Stop the arm by a program of its own, and see that it rests.

        Raises
        ------
        DeviceError
            The connection is lost, or the arm still moves after four seconds.
        """
        self._send(_STOP.format(stop=STOP_RAD_S2))
        began = time.monotonic()
        with self._connected() as link:
            # What is underway when the program arrives may look like rest for a moment.
            rests = 0
            while time.monotonic() - began < STOPS_S:
                rests = rests + 1 if _rests(link.receive()) else 0
                if rests >= 5:
                    return
        raise DeviceError(f"{self._host}: the arm still moves", code=Code.STOP_FAILED)

    def _connected(self) -> RtdeClient:
        return RtdeClient(self._host, self._rtde_port, OUTPUTS, f"input_int_register_{PULSE}")

    def _send(self, program: str) -> None:
        try:
            with socket.create_connection((self._host, self._script_port), timeout=STARTS_S) as link:
                link.sendall(program.encode())
                _listen(link, TAKEN_S)
        except OSError as error:
            raise DeviceError(
                f"{self._host}:{self._script_port}: no connection: {error}",
                code=Code.CONNECTION_LOST,
                hint="check cable, power, network and the robot's address",
            ) from error


def _listen(link: socket.socket, seconds: float) -> None:
    """Take in what the controller says of itself: closed with something unread, a connection is torn down."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        link.settimeout(left)
        try:
            if not link.recv(4096):
                return
        except TimeoutError:
            return


def _await_program(link: RtdeClient, token: int) -> dict[str, Any]:
    """Return the first data after the program has begun to speak."""
    began = time.monotonic()
    while time.monotonic() - began < STARTS_S:
        now = link.receive()
        if now[f"output_int_register_{WHO}"] == token:
            return now
        _check_ready(now)
    raise DeviceError(
        "the controller does not run the program",
        code=Code.NOT_READY,
        hint="switch the arm on, release the brakes, and choose remote control on the pendant",
    )


def _check_ready(now: dict[str, Any]) -> None:
    bits = now["safety_status_bits"] & NOT_READY_BITS
    if bits:
        raise DeviceError(
            f"a protective, safeguard or emergency stop is active (safety status bits {bits:#x})",
            code=Code.NOT_READY,
            hint="see to its cause, unlock it on the pendant, then go on with --resume",
        )


def _rests(now: dict[str, Any]) -> bool:
    return max(abs(rate) for rate in now["actual_qd"]) < REST_RAD_S


def _token() -> int:
    """Return a number that marks one program; zero is what a register holds at first."""
    return 1 + secrets.randbelow((1 << 30) - 1)
