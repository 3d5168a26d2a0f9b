"""A bus of Feetech's servos behind a pseudo terminal (Linux, macOS), as in LeRobot's arms.

Written from the SMS/STS protocol manual. Not shown: loads, heat, garbled lines, the timing of a real servo.
"""

import os
import pty
import select
import threading
import time
import tty
from collections.abc import Sequence

from handeye.robots.drivers.feetech import EVERYBODY, HEAD, PING, READ, SYNC_WRITE, WRITE, packet

CYCLE_S = 0.005
TORQUE, PLACE, SPEED, PRESENT = 40, 42, 46, 56
# Steps a second of a servo whose speed is 0.
FASTEST = 3000.0


class MockFeetechBus:
    """Servos that turn in time, until it is closed.

    Parameters
    ----------
    steps
        Where each servo stands at first, by its number from 1 on.
    """

    def __init__(self, steps: Sequence[int]) -> None:
        self._inside, outside = pty.openpty()
        tty.setraw(outside)
        self.address = os.ttyname(outside)
        self._outside = outside
        self._tables = {number: bytearray(128) for number in range(1, len(steps) + 1)}
        self._places = {number: float(step) for number, step in enumerate(steps, 1)}
        for number, step in enumerate(steps, 1):
            self._put(number, PLACE, step)
            self._put(number, PRESENT, step)
        self.error_bits = 0
        self._silent, self._closed = threading.Event(), threading.Event()
        self._turned_s = time.monotonic()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def cut(self) -> None:
        """Fall silent; the servos go on to where they were sent."""
        self._silent.set()

    def mend(self) -> None:
        """Answer again."""
        self._silent.clear()

    def close(self) -> None:
        """End it."""
        self._closed.set()
        self._thread.join()
        os.close(self._inside)
        os.close(self._outside)

    def _run(self) -> None:
        waiting = b""
        while not self._closed.is_set():
            ready, _, _ = select.select([self._inside], [], [], CYCLE_S)
            self._turn()
            if not ready:
                continue
            waiting += os.read(self._inside, 4096)
            while (start := waiting.find(HEAD)) >= 0 and len(waiting) >= start + 4:
                size = 4 + waiting[start + 3]
                if len(waiting) < start + size:
                    break
                request, waiting = waiting[start : start + size], waiting[start + size :]
                if not self._silent.is_set():
                    self._take(request)

    def _turn(self) -> None:
        """Let every servo turn towards its place for the time that has passed."""
        now = time.monotonic()
        passed_s, self._turned_s = now - self._turned_s, now
        for number, table in self._tables.items():
            if not table[TORQUE]:
                continue
            speed = float(self._get(number, SPEED)) or FASTEST
            left = self._get(number, PLACE) - self._places[number]
            self._places[number] += max(-speed * passed_s, min(speed * passed_s, left))
            self._put(number, PRESENT, round(self._places[number]))

    def _take(self, request: bytes) -> None:
        number, instruction, body = request[2], request[4], request[5:-1]
        if packet(number, instruction, body) != request:
            return
        if instruction == SYNC_WRITE and number == EVERYBODY:
            address, size = body[0], body[1]
            for at in range(2, len(body), size + 1):
                self._tables[body[at]][address : address + size] = body[at + 1 : at + 1 + size]
        elif number in self._tables and instruction in {PING, READ, WRITE}:
            answer = b""
            if instruction == READ:
                answer = bytes(self._tables[number][body[0] : body[0] + body[1]])
            elif instruction == WRITE:
                self._tables[number][body[0] : body[0] + len(body) - 1] = body[1:]
            os.write(self._inside, packet(number, self.error_bits, answer))

    def _get(self, number: int, address: int) -> int:
        return int.from_bytes(self._tables[number][address : address + 2], "little")

    def _put(self, number: int, address: int, value: int) -> None:
        self._tables[number][address : address + 2] = value.to_bytes(2, "little")
