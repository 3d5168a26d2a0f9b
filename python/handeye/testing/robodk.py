"""RoboDK's API on loopback, as much of it as a driver of a robot asks; read by RoboDK's own library.

Lines end in a line feed, numbers are big-endian: RoboDK API, robodk.robolink. Joints in degrees, millimetres.
"""

import socket
import struct
import threading
import time
from contextlib import suppress
from typing import BinaryIO, cast

import numpy as np

from handeye.testing.cell import MockCell
from handeye.types.arrays import FloatArray

ROBOT, ROBOT_TYPE, NOTHING = 0x2B00B5, 2, 0
OUT_OF_REACH = 10
TELLING = {"RDK_API", "G_Item", "G_Item2", "G_Thetas", "G_FK"}


class MockRoboDK:
    """Listens on loopback until it is closed.

    Parameters
    ----------
    cell
        What its robot moves.
    name
        Of the robot in the station.
    """

    def __init__(self, cell: MockCell, name: str = "UR5e") -> None:
        self.cell, self.name = cell, name
        self.unknown: list[str] = []
        self._joints: FloatArray = np.array(cell.start_rad)
        self._speed_rad_s = 1.0
        self._motion: tuple[threading.Thread, threading.Event] | None = None
        self._links: list[socket.socket] = []
        self._port = 0
        self.mend()
        self.address = f"127.0.0.1:{self._port},{name}"

    def cut(self) -> None:
        """End every connection and take no other; a motion that runs goes on."""
        with suppress(OSError):  # wakes who waits for connections; some systems refuse that
            self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        for link in self._links:
            with suppress(OSError):
                link.shutdown(socket.SHUT_RDWR)
        self._links.clear()

    def mend(self) -> None:
        """Listen again, where it did before."""
        self._server = socket.create_server(("127.0.0.1", self._port))
        self._port = int(self._server.getsockname()[1])
        threading.Thread(target=self._serve, args=(self._server,), daemon=True).start()

    def close(self) -> None:
        """Stop listening and moving."""
        self.cut()
        self._halt()

    def _serve(self, server: socket.socket) -> None:
        while True:
            try:
                link, _ = server.accept()
            except OSError:
                return
            self._links.append(link)
            threading.Thread(target=self._talk, args=(link,), daemon=True).start()

    def _talk(self, link: socket.socket) -> None:
        try:
            with link, link.makefile("rwb") as stream:
                wire = _Wire(cast("BinaryIO", stream))
                while (line := stream.readline()) != b"":
                    self._answer(line.decode().strip(), wire)
                    stream.flush()
        except (OSError, ValueError, struct.error):
            return

    def _answer(self, command: str, wire: "_Wire") -> None:
        status = self._told(command, wire) if command in TELLING else self._ordered(command, wire)
        wire.stream.write(struct.pack(">i", status))
        if status:
            wire.stream.write(b"The target can not be reached\n")
        if command == "WaitMove":
            wire.stream.write(struct.pack(">i", 0))

    def _told(self, command: str, wire: "_Wire") -> int:
        """Say something of the station."""
        if command == "RDK_API":
            wire.array()
            wire.stream.write(b"RDK_API\n" + struct.pack(">ii", 1, 5900))
        elif command in {"G_Item", "G_Item2"}:
            known = wire.stream.readline().decode().strip() in {"", self.name}
            if command == "G_Item2":
                wire.number()
            answer = (ROBOT, ROBOT_TYPE) if known else (NOTHING, -1)
            wire.stream.write(struct.pack(">Qi", *answer))
        elif command == "G_Thetas":
            wire.item()
            wire.write_array(np.rad2deg(self._joints))
        else:  # G_FK
            matrix = self.cell.arm.forward(np.deg2rad(wire.array())).copy()
            wire.item()
            matrix[:3, 3] *= 1000.0
            wire.stream.write(struct.pack(">16d", *matrix.T.ravel()))
        return 0

    def _ordered(self, command: str, wire: "_Wire") -> int:
        """Do something with the robot; return the status."""
        if command == "MoveX":
            wire.number()
            wire.number()
            joints = np.deg2rad(wire.array())
            wire.item()
            wire.item()
            if not self.cell.arm.within_limits(joints):
                return OUT_OF_REACH
            self._begin(joints)
            return 0
        wire.item()
        running = self._motion is not None and self._motion[0].is_alive()
        if command == "S_Speed4":
            self._speed_rad_s = float(np.deg2rad(wire.array()[1]))
        elif command == "IsBusy":
            wire.stream.write(struct.pack(">i", int(running)))
        elif command == "Stop":
            self._halt()
        elif command == "WaitMove":
            if self._motion is not None:
                self._motion[0].join()
        else:
            self.unknown.append(command)
            raise ValueError(command)
        return 0

    def _begin(self, there: FloatArray) -> None:
        self._halt()
        halted = threading.Event()
        thread = threading.Thread(target=self._move, args=(there, halted), daemon=True)
        self._motion = (thread, halted)
        thread.start()

    def _halt(self) -> None:
        if self._motion is not None:
            self._motion[1].set()
            self._motion[0].join()

    def _move(self, there: FloatArray, halted: threading.Event) -> None:
        here, began = self._joints.copy(), time.monotonic()
        seconds = max(float(np.abs(there - here).max()) / self._speed_rad_s, 1e-9)
        while (share := (time.monotonic() - began) / seconds) < 1:
            self._joints = here + share * (there - here)
            if halted.wait(0.004):
                break
        else:
            self._joints = there
        self.cell.stand(tuple(self._joints.tolist()))


class _Wire:
    """What numbers, lists and items look like on the wire."""

    def __init__(self, stream: BinaryIO) -> None:
        self.stream = stream

    def number(self) -> int:
        """Read an integer."""
        return struct.unpack(">i", self.stream.read(4))[0]

    def item(self) -> int:
        """Read what names an item."""
        return struct.unpack(">Q", self.stream.read(8))[0]

    def array(self) -> FloatArray:
        """Read numbers (n,)."""
        count = self.number()
        return np.array(struct.unpack(f">{count}d", self.stream.read(8 * count)))

    def write_array(self, values: FloatArray) -> None:
        """Write numbers (n,)."""
        self.stream.write(struct.pack(f">i{len(values)}d", len(values), *values))
