"""A control box of UFACTORY on loopback, as much of it as a driver asks; read by UFACTORY's own library.

Written from the private protocol of the xArm developer manual. Not shown: errors of the arm, other modes,
reports, the timing of a real control box.
"""

import socket
import struct
import threading
import time

import numpy as np

from handeye.robots.drivers.xarm import (
    GET_ERROR,
    GET_JOINTS,
    GET_STATE,
    GET_TCP_POSE,
    HEADER,
    MOST_JOINTS,
    MOTION_ENABLE,
    MOVE_JOINT,
    MOVING,
    PRIVATE,
    REFUSED_BIT,
    SET_MODE,
    SET_STATE,
    STOP,
)
from handeye.testing.cell import MockCell
from handeye.types.arrays import FloatArray

CYCLE_S, SLEEPING, STOPPED = 0.004, 2, 4
JOINT_LIMIT_ERROR = 23


class MockXArm:
    """Listens on loopback until it is closed.

    Parameters
    ----------
    cell
        What it moves; its camera sees it where the arm truly stands, once it rests.
    """

    def __init__(self, cell: MockCell) -> None:
        self.cell = cell
        self.error = 0
        self._q: FloatArray = np.array(cell.start_rad)
        self._enabled, self._state = False, STOPPED
        self._halted = threading.Event()
        self._motion: threading.Thread | None = None
        self._silent, self._closed = threading.Event(), threading.Event()
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._server.getsockname()[1])
        self.address = f"127.0.0.1:{self.port},{len(cell.arm)}"
        threading.Thread(target=self._serve, daemon=True).start()

    def close(self) -> None:
        """Stop listening and moving."""
        self._closed.set()
        self._halt()
        self._server.close()

    def cut(self) -> None:
        """Fall silent; a motion that runs goes on."""
        self._silent.set()

    def mend(self) -> None:
        """Be heard again."""
        self._silent.clear()

    def _serve(self) -> None:
        while not self._closed.is_set():
            try:
                link, _ = self._server.accept()
            except OSError:
                return
            threading.Thread(target=self._answered, args=(link,), daemon=True).start()

    def _answered(self, link: socket.socket) -> None:
        waiting = b""
        with link:
            link.settimeout(0.2)
            while not self._closed.is_set():
                try:
                    part = link.recv(4096)
                except TimeoutError:
                    continue
                except OSError:
                    return
                if not part:
                    return
                waiting += part
                while len(waiting) >= HEADER.size:
                    number, _, length, what = HEADER.unpack_from(waiting)
                    size = HEADER.size - 1 + length
                    if len(waiting) < size:
                        break
                    body, waiting = waiting[HEADER.size : size], waiting[size:]
                    if self._silent.is_set() or what == 0:  # 0 keeps the connection alive
                        continue
                    state, answer = self._done(what, body)
                    link.sendall(
                        HEADER.pack(number, PRIVATE, len(answer) + 2, what) + bytes([state]) + answer
                    )

    def _done(self, what: int, body: bytes) -> tuple[int, bytes]:
        if what == MOTION_ENABLE:
            self._enabled = bool(body[1])
        elif what == SET_STATE:
            self._halt()
            self._state = STOPPED if body[0] == STOP else SLEEPING
        elif what == GET_STATE:
            moves = self._motion is not None and self._motion.is_alive()
            return 0, bytes([MOVING if moves else self._state])
        elif what == GET_ERROR:
            return 0, bytes([self.error, 0])
        elif what == GET_JOINTS:
            return 0, struct.pack("<7f", *self._q, *([0.0] * (MOST_JOINTS - len(self._q))))
        elif what == GET_TCP_POSE:
            pose = self.cell.arm.forward(self._q)
            yaw, pitch = np.arctan2(pose[1, 0], pose[0, 0]), -np.arcsin(np.clip(pose[2, 0], -1, 1))
            roll = np.arctan2(pose[2, 1], pose[2, 2])
            return 0, struct.pack("<6f", *(1000 * pose[:3, 3]), roll, pitch, yaw)
        elif what == MOVE_JOINT:
            return self._started(struct.unpack("<10f", body))
        elif what != SET_MODE:
            return REFUSED_BIT, b""
        return 0, b""

    def _started(self, numbers: tuple[float, ...]) -> tuple[int, bytes]:
        there, speed = np.array(numbers[: len(self._q)]), numbers[MOST_JOINTS]
        if not self._enabled or self._state == STOPPED or self.error:
            return REFUSED_BIT, b""
        if not self.cell.arm.within_limits(there):
            self.error, self._state = JOINT_LIMIT_ERROR, STOPPED
            return 0, b""
        self._halt()
        self._halted = threading.Event()
        self._motion = threading.Thread(target=self._move, args=(there, speed, self._halted), daemon=True)
        self._motion.start()
        return 0, b""

    def _move(self, there: FloatArray, speed: float, halted: threading.Event) -> None:
        here, began = self._q.copy(), time.monotonic()
        total_s = float(np.abs(there - here).max()) / speed
        while (at_s := time.monotonic() - began) < total_s:
            self._q = here + (there - here) * at_s / total_s
            if halted.wait(CYCLE_S):
                break
        else:
            self._q = there
        self.cell.stand(tuple(self._q.tolist()))

    def _halt(self) -> None:
        self._halted.set()
        if self._motion is not None:
            self._motion.join()
