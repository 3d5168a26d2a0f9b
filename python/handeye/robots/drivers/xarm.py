"""UFACTORY's arms (xArm 5, 6, 7, 850, Lite 6), by the protocol of their control box. Not tried on a real arm.

Requests are one at a time, over TCP port 502 (UFACTORY, xArm developer manual, private protocol): big-endian
head, little-endian floats, lengths in mm, angles in rad. Nothing is installed for it.
"""

import socket
import struct
import threading
import time

import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.robots.protocol import Goal, Reading
from handeye.types import Pose
from handeye.types.arrays import FloatArray

PORT, PRIVATE = 502, 2
HEADER = struct.Struct(">HHHB")
# Requests by their number.
MOTION_ENABLE, SET_STATE, GET_STATE, GET_ERROR, SET_MODE = 11, 12, 13, 15, 19
MOVE_JOINT, GET_TCP_POSE, GET_JOINTS = 23, 41, 42
ALL_JOINTS, READY, STOP, POSITION_MODE = 8, 0, 4, 0
MOVING, SUSPENDED, STOPPING = 1, 3, 4
MOST_JOINTS = 7
# Bits of the state that comes with every answer: the request cannot be taken now; an error; a warning.
REFUSED_BIT, ERROR_BIT = 0x08, 0x40
ACCELERATION_RAD_S2 = 1.5
ANSWER_S, POLL_S, STARTS_S, SETTLE_S, REST_S, REST_RAD, NEAR_RAD = 2.0, 0.02, 0.5, 10.0, 0.3, 2e-4, 0.02
LARGEST_ANSWER = 512


class XArmRobot:
    """An arm behind its control box, with no offset set for the tool.

    Parameters
    ----------
    address
        `HOST`, or `HOST:PORT`; after a comma the number of joints, 5, 6 or 7 (6 where it is not said).

    Raises
    ------
    InputError
        An address of another form.
    DeviceError
        The control box is not there.
    """

    _link: socket.socket | None = None

    def __init__(self, address: str) -> None:
        where, _, count = address.partition(",")
        self._host, _, port = where.partition(":")
        numbers = (not port or port.isdecimal()) and count in {"", "5", "6", "7"}
        if not self._host or not numbers:
            raise InputError(f"address {address[:60]!r}, expected HOST:PORT,JOINTS", code=Code.BAD_ADDRESS)
        self._port, self._count = int(port or PORT), int(count or 6)
        self._one_at_a_time = threading.Lock()
        self._number = 0
        self._stopped = threading.Event()
        self._ask(GET_STATE)

    def move_to(self, goal: Goal) -> None:
        """Turn the joints to those of the goal, and wait until the arm rests.

        Raises
        ------
        DeviceError
            `motion_refused` without joints or by the control box; `stopped`; `not_ready`; `connection_lost`.
        """
        if goal.joints_rad is None or len(goal.joints_rad) != self._count:
            raise DeviceError(
                f"{goal.label}: {self._count} joint positions are needed", code=Code.MOTION_REFUSED
            )
        self._check_errors()
        self._stopped.clear()
        # In this order, as the manual has it after a stop.
        self._ask(MOTION_ENABLE, bytes([ALL_JOINTS, 1]))
        self._ask(SET_MODE, bytes([POSITION_MODE]))
        self._ask(SET_STATE, bytes([READY]))
        padded = (*goal.joints_rad, *([0.0] * (MOST_JOINTS - self._count)))
        here = self._joints()
        self._ask(MOVE_JOINT, struct.pack("<10f", *padded, goal.speed_rad_s, ACCELERATION_RAD_S2, 0.0))
        began = time.monotonic()
        while self._state() == MOVING or (
            time.monotonic() - began < STARTS_S and np.abs(self._joints() - here).max() < REST_RAD
        ):
            time.sleep(POLL_S)
        joints = self._settled()
        off = float(np.abs(joints - goal.joints_rad).max())
        if off <= NEAR_RAD and not self._stopped.is_set():
            return
        self._check_errors(goal.label)
        raise DeviceError(f"{goal.label}: stopped {np.rad2deg(off):.1f} deg short of it", code=Code.STOPPED)

    def read_pose(self) -> Reading:
        """Return the pose that the control box tells, that of the flange without a tool, and the joints.

        Raises
        ------
        DeviceError
            `connection_lost`.
        """
        joints = self._joints()
        x, y, z, roll, pitch, yaw = struct.unpack("<6f", self._ask(GET_TCP_POSE, size=24))
        turned = Pose.exp([0, 0, 0, 0, 0, yaw]) @ Pose.exp([0, 0, 0, 0, pitch, 0])
        turned = turned @ Pose.exp([0, 0, 0, roll, 0, 0])
        matrix = np.array(turned.matrix)
        matrix[:3, 3] = np.array([x, y, z]) / 1000.0
        return Reading(Pose(matrix), tuple(joints.tolist()))

    def stop(self) -> None:
        """Stop the arm, and see that it rests.

        Raises
        ------
        DeviceError
            `connection_lost`, `not_at_rest`.
        """
        self._stopped.set()
        self._ask(SET_STATE, bytes([STOP]))
        self._settled()

    def close(self) -> None:
        """Let go of the connection."""
        with self._one_at_a_time:
            self._forget()

    def __del__(self) -> None:
        # Nobody closes the drivers of a session that has ended.
        self._forget()

    def _state(self) -> int:
        return self._ask(GET_STATE, size=1)[0]

    def _joints(self) -> FloatArray:
        seven = struct.unpack("<7f", self._ask(GET_JOINTS, size=28))
        return np.array(seven[: self._count], dtype=np.float64)

    def _check_errors(self, label: str = "before the motion") -> None:
        error, _ = self._ask(GET_ERROR, size=2)
        if error:
            refused = error in {
                22,
                23,
                24,
            }  # collision with itself, joint limits, speed: the goal is at fault
            raise DeviceError(
                f"{label}: the control box reports error {error}",
                code=Code.MOTION_REFUSED if refused else Code.NOT_READY,
                hint="see to its cause, clear it in UFACTORY Studio, then go on with --resume",
            )

    def _settled(self) -> FloatArray:
        """Return the joints (n,) once they no longer change."""
        end = time.monotonic() + SETTLE_S
        since_s, reference = time.monotonic(), np.full(self._count, np.inf)
        while time.monotonic() < end:
            joints = self._joints()
            if np.abs(joints - reference).max() > REST_RAD:
                since_s, reference = time.monotonic(), joints
            elif time.monotonic() - since_s > REST_S:
                return joints
            time.sleep(POLL_S)
        raise DeviceError("the arm does not come to rest", code=Code.NOT_AT_REST)

    def _ask(self, what: int, body: bytes = b"", size: int | None = None) -> bytes:
        """Return the parameters of the answer to a request.

        Raises
        ------
        DeviceError
            `connection_lost`; `motion_refused` where the control box does not take the request.
        """
        with self._one_at_a_time:
            try:
                state, answer = self._exchanged(what, body)
            except (OSError, struct.error) as error:
                self._forget()
                raise DeviceError(
                    f"control box {self._host}:{self._port}: {str(error) or type(error).__name__}",
                    code=Code.CONNECTION_LOST,
                    hint="check cable, power and address; the arm may still finish its motion",
                ) from error
        if state & REFUSED_BIT or (state & ERROR_BIT and what == MOVE_JOINT):
            raise DeviceError(
                f"the control box does not take request {what} (state {state:#04x})", code=Code.MOTION_REFUSED
            )
        if size is not None and len(answer) < size:
            raise DeviceError(
                f"{len(answer)} bytes for request {what}, expected {size}", code=Code.BAD_READING
            )
        return answer if size is None else answer[:size]

    def _exchanged(self, what: int, body: bytes) -> tuple[int, bytes]:
        if self._link is None:
            self._link = socket.create_connection((self._host, self._port), timeout=ANSWER_S)
            self._link.settimeout(ANSWER_S)
        link = self._link
        self._number = self._number % 0xFFFF + 1
        link.sendall(HEADER.pack(self._number, PRIVATE, len(body) + 1, what) + body)
        end = time.monotonic() + ANSWER_S
        while time.monotonic() < end:
            number, _, length, kind = HEADER.unpack(_whole(link, HEADER.size))
            if not 1 <= length <= LARGEST_ANSWER:
                raise OSError(f"an answer of {length} bytes")
            rest = _whole(link, length - 1)
            if (number, kind) == (self._number, what) and rest:
                return rest[0], rest[1:]
        raise TimeoutError("no answer")

    def _forget(self) -> None:
        if self._link is not None:
            self._link.close()
            self._link = None


def _whole(link: socket.socket, size: int) -> bytes:
    """Return so many bytes."""
    found = b""
    while len(found) < size:
        part = link.recv(size - len(found))
        if not part:
            raise ConnectionError("the connection was closed")
        found += part
    return found
