"""RTDE, the data exchange of Universal Robots' controllers, as far as a driver needs it.

Universal Robots, Real-Time Data Exchange (RTDE) Guide, protocol version 2. Numbers are big-endian.
"""

import socket
import struct
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self

from handeye.codes import Code
from handeye.errors import DeviceError

RTDE_PORT = 30004
PROTOCOL_VERSION = 2
# Types of packages.
REQUEST_VERSION, TEXT_MESSAGE, DATA, SETUP_OUTPUTS, SETUP_INPUTS, START = (ord(c) for c in "VMUOIS")
HEADER = struct.Struct(">HB")
FORMATS = {"VECTOR6D": "6d", "DOUBLE": "d", "UINT32": "I", "INT32": "i", "UINT8": "B", "UINT64": "Q"}
# So long a controller that sends 50 times a second may be silent.
SILENCE_S = 1.0


class RtdeClient:
    """One connection, from which data are read as they come; for one operation, then closed.

    Parameters
    ----------
    host, port
        Of the controller.
    outputs
        Names of the variables to be sent.
    input_name
        Name of an integer register to be written; it is reserved for this connection.
    frequency_hz
        How often they are sent.

    Raises
    ------
    DeviceError
        The controller is not there, does not speak RTDE, or lacks a variable.
    """

    def __init__(
        self, host: str, port: int, outputs: Sequence[str], input_name: str, frequency_hz: float = 50.0
    ) -> None:
        self._where = f"{host}:{port}"
        self._outputs = tuple(outputs)
        try:
            self._socket = socket.create_connection((host, port), timeout=SILENCE_S)
        except OSError as error:
            raise self._lost(error) from error
        try:
            answer = self._ask(REQUEST_VERSION, struct.pack(">H", PROTOCOL_VERSION))
            if answer[:1] != b"\x01":
                raise DeviceError(f"{self._where}: RTDE version 2 is refused", code=Code.WRONG_PROTOCOL)
            names = struct.pack(">d", frequency_hz) + ",".join(outputs).encode()
            self._output_recipe, formats = self._set_up(SETUP_OUTPUTS, names, outputs)
            self._input_recipe, _ = self._set_up(SETUP_INPUTS, input_name.encode(), [input_name])
            self._format = struct.Struct(">" + "".join(FORMATS[name] for name in formats))
            if self._ask(START, b"")[:1] != b"\x01":
                raise DeviceError(f"{self._where}: RTDE does not start", code=Code.WRONG_PROTOCOL)
        except BaseException:
            self._socket.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()

    def receive(self) -> dict[str, Any]:
        """Return the next data: numbers, and tuples of six numbers, by their names.

        Raises
        ------
        DeviceError
            None come; `code` is `connection_lost`.
        """
        while True:
            kind, body = self._package()
            if kind != DATA or body[:1] != self._output_recipe:
                continue
            if len(body) != 1 + self._format.size:
                raise DeviceError(f"{self._where}: RTDE data of {len(body)} bytes", code=Code.WRONG_PROTOCOL)
            numbers = iter(self._format.unpack(body[1:]))
            return {
                name: tuple(next(numbers) for _ in range(6)) if name.startswith("actual_") else next(numbers)
                for name in self._outputs
            }

    def send(self, number: int) -> None:
        """Write the integer register.

        Raises
        ------
        DeviceError
            The connection is lost.
        """
        self._send(DATA, self._input_recipe + struct.pack(">i", number))

    def _set_up(self, kind: int, request: bytes, names: Sequence[str]) -> tuple[bytes, list[str]]:
        answer = self._ask(kind, request)
        formats = answer[1:].decode("ascii", "replace").split(",")
        if len(formats) != len(names):
            raise DeviceError(f"{self._where}: RTDE answers {answer[:80]!r}", code=Code.WRONG_PROTOCOL)
        for name, form in zip(names, formats, strict=True):
            if form == "IN_USE":
                raise DeviceError(
                    f"{self._where}: {name} is taken by another program",
                    code=Code.BUSY,
                    hint="end the other program that drives this robot",
                )
            if form not in FORMATS:
                raise DeviceError(
                    f"{self._where}: the controller has no {name}",
                    code=Code.WRONG_PROTOCOL,
                    hint="PolyScope 3.9 or 5.3 and later are needed",
                )
        return answer[:1], formats

    def _ask(self, kind: int, body: bytes) -> bytes:
        self._send(kind, body)
        for _ in range(1000):
            answered, answer = self._package()
            if answered == kind and answer:
                return answer
        raise DeviceError(f"{self._where}: RTDE does not answer", code=Code.WRONG_PROTOCOL)

    def _send(self, kind: int, body: bytes) -> None:
        try:
            self._socket.sendall(HEADER.pack(HEADER.size + len(body), kind) + body)
        except OSError as error:
            raise self._lost(error) from error

    def _package(self) -> tuple[int, bytes]:
        size, kind = HEADER.unpack(self._exactly(HEADER.size))
        if size < HEADER.size:
            raise DeviceError(f"{self._where}: no RTDE: a package of {size} bytes", code=Code.WRONG_PROTOCOL)
        return kind, self._exactly(size - HEADER.size)

    def _exactly(self, size: int) -> bytes:
        found = b""
        while len(found) < size:
            try:
                part = self._socket.recv(size - len(found))
            except OSError as error:
                raise self._lost(error) from error
            if not part:
                raise self._lost("closed by the controller")
            found += part
        return found

    def _lost(self, why: object) -> DeviceError:
        return DeviceError(
            f"{self._where}: no connection: {why}",
            code=Code.CONNECTION_LOST,
            hint="check cable, power, network and the robot's address",
        )
