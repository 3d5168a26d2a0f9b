"""The bus of Feetech's STS servos (STS3215), that of LeRobot's arms: packets over a serial port.

Feetech, SMS/STS protocol manual and memory table of the STS3215: little-endian, 4096 steps a turn.
"""

import threading
from typing import Any

from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.extension import library

BAUD, ANSWER_S, TRIES = 1_000_000, 0.3, 3
HEAD = b"\xff\xff"
PING, READ, WRITE, SYNC_WRITE = 1, 2, 3, 0x83
EVERYBODY = 0xFE
STEPS_PER_TURN = 4096
# Addresses and sizes in the memory table.
TORQUE_ENABLE = (40, 1)
ACCELERATION_TO_SPEED = (41, 7)
PRESENT_POSITION = (56, 2)
LARGEST_ANSWER = 64


class FeetechBus:
    """A serial port with servos on it; one request at a time, from any thread.

    Parameters
    ----------
    port
        Name of the serial port.

    Raises
    ------
    DeviceError
        The library or the port is not there.
    """

    def __init__(self, port: str) -> None:
        self._serial = library("serial", "lerobot")
        self._port = port
        self._one_at_a_time = threading.Lock()
        self._link: Any = None
        with self._one_at_a_time:
            self._connect()

    def read(self, servo: int, address: int, size: int) -> int:
        """Return a number of the memory table of a servo.

        Raises
        ------
        DeviceError
            `connection_lost` where it does not answer; `not_ready` where it reports an error.
        """
        request = packet(servo, READ, bytes([address, size]))
        with self._one_at_a_time:
            answer = self._answered(servo, request, size)
        return int.from_bytes(answer, "little")

    def write(self, servo: int, address: int, size: int, value: int) -> None:
        """Write a number into the memory table of a servo, which confirms it.

        Raises
        ------
        DeviceError
            As `read`.
        """
        request = packet(servo, WRITE, bytes([address]) + value.to_bytes(size, "little"))
        with self._one_at_a_time:
            self._answered(servo, request, 0)

    def write_all(self, address: int, values: dict[int, bytes]) -> None:
        """Write into several servos at once; nobody confirms it.

        Raises
        ------
        DeviceError
            `connection_lost`.
        """
        size = len(next(iter(values.values())))
        body = bytes([address, size]) + b"".join(bytes([servo]) + value for servo, value in values.items())
        with self._one_at_a_time:
            self._sent(packet(EVERYBODY, SYNC_WRITE, body))

    def close(self) -> None:
        """Let go of the port."""
        with self._one_at_a_time:
            self._forget()

    def _answered(self, servo: int, request: bytes, size: int) -> bytes:
        """Return the parameters of the answer to a request, asked again where it is garbled."""
        for _ in range(TRIES):
            link = self._sent(request)
            try:
                answer = _next_packet(link)
            except (self._serial.SerialException, OSError) as error:
                raise self._lost(str(error)) from error
            if answer is None or answer[0] != servo or len(answer[2]) != size:
                continue
            if answer[1]:
                raise DeviceError(
                    f"servo {servo} reports an error (bits {answer[1]:#04x}, such as voltage, heat, load)",
                    code=Code.NOT_READY,
                    hint="see to its cause, switch the arm off and on, then go on with --resume",
                )
            return answer[2]
        self._forget()
        raise self._lost(f"servo {servo} does not answer")

    def _sent(self, request: bytes) -> Any:  # noqa: ANN401 - a serial port
        link = self._connect()
        try:
            link.reset_input_buffer()
            link.write(request)
        except (self._serial.SerialException, OSError) as error:
            self._forget()
            raise self._lost(str(error)) from error
        return link

    def _connect(self) -> Any:  # noqa: ANN401 - a serial port
        if self._link is None:
            try:
                self._link = self._serial.Serial(self._port, BAUD, timeout=ANSWER_S, write_timeout=1.0)
            except (self._serial.SerialException, OSError, ValueError) as error:
                raise self._lost(str(error)) from error
        return self._link

    def _forget(self) -> None:
        if self._link is not None:
            self._link.close()
            self._link = None

    def _lost(self, why: str) -> DeviceError:
        return DeviceError(
            f"{self._port}: {why}",
            code=Code.CONNECTION_LOST,
            hint="check cable and power of the arm, and that no other program has the port",
        )


def packet(servo: int, instruction: int, body: bytes) -> bytes:
    """Return a packet: head, servo, length, instruction or error bits, parameters, checksum."""
    inside = bytes([servo, len(body) + 2, instruction]) + body
    return HEAD + inside + bytes([~sum(inside) & 0xFF])


def _next_packet(link: Any) -> tuple[int, int, bytes] | None:  # noqa: ANN401 - a serial port
    """Return servo, error bits and parameters of the next packet; None where none comes whole and right."""
    head = link.read(4)
    if len(head) < 4 or head[:2] != HEAD or not 2 <= head[3] <= LARGEST_ANSWER:
        return None
    rest = link.read(head[3])
    if len(rest) < head[3] or rest[-1] != ~(sum(head[2:]) + sum(rest[:-1])) & 0xFF:
        return None
    return head[2], rest[0], rest[1:-1]
