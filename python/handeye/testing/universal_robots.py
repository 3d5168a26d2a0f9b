"""A controller of Universal Robots on loopback: RTDE, and as much of URScript as drivers send.

Written from the RTDE guide and the URScript manual, and read by ur-rtde's receiver as a real one is.
Not shown: blending, payloads, singularities, protective stops by force, the timing of a real controller.
"""

import ast
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import cv2
import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.robots.drivers.rtde import (
    DATA,
    FORMATS,
    HEADER,
    REQUEST_VERSION,
    SETUP_INPUTS,
    SETUP_OUTPUTS,
    START,
)
from handeye.testing.cell import MockCell
from handeye.types import Pose
from handeye.types.arrays import FloatArray

GET_CONTROLLER_VERSION, PAUSE = ord("v"), ord("P")
VERSION = (5, 11, 0, 0)
CYCLE_S = 0.004
SIXES = (
    "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current "
    "joint_control_output actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose target_TCP_speed "
    "joint_temperatures actual_joint_voltage ft_raw_wrench payload_inertia"
)
NUMBERS = (
    "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum actual_main_voltage "
    "actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1 "
    "standard_analog_output0 standard_analog_output1 payload"
)
VARIABLES = {
    **dict.fromkeys(SIXES.split(), "VECTOR6D"),
    **dict.fromkeys(NUMBERS.split(), "DOUBLE"),
    **dict.fromkeys(["actual_tool_accelerometer", "payload_cog"], "VECTOR3D"),
    **dict.fromkeys(["runtime_state", "robot_status_bits", "safety_status_bits"], "UINT32"),
    **dict.fromkeys(["actual_digital_input_bits", "actual_digital_output_bits"], "UINT64"),
    **dict.fromkeys(["robot_mode", "safety_mode"], "INT32"),
    "joint_mode": "VECTOR6INT32",
}
FORMS = FORMATS | {"VECTOR3D": "3d", "VECTOR6INT32": "6i"}
PLAYING, STOPPED = 2, 1
PROTECTIVE_STOP = 1 << 2


class MockUniversalRobot:
    """Listens on loopback until it is closed.

    Parameters
    ----------
    cell
        What it moves; its camera sees it where the arm truly stands, once it rests.
    host
        An address of the loopback; ports are free ones, or `ports`.
    tool
        Pose of a tool centre point in the flange, as somebody may have set on the pendant.
    ports
        RTDE and programs; 0 for free ones.
    pace
        So many times faster than stated the arm moves, for tests that have no time.
    """

    def __init__(
        self,
        cell: MockCell,
        host: str = "127.0.0.1",
        tool: Pose | None = None,
        ports: tuple[int, int] = (0, 0),
        pace: float = 1.0,
    ) -> None:
        self.cell = cell
        self._pace = pace
        self.remote_control = True
        self.safety_bits = 1
        self.programs: list[str] = []
        self._tool = tool or Pose.identity()
        self._q: FloatArray = np.array(cell.start_rad)
        self._rate: FloatArray = np.zeros(6)
        self._registers: dict[str, float] = {}
        self._heard_s: dict[str, float] = {}
        self._watchdog: tuple[str, float] | None = None
        self._silent = threading.Event()
        self._closed = threading.Event()
        self._program: tuple[threading.Thread, threading.Event] | None = None
        self._starting = threading.Lock()
        self._servers = [socket.create_server((host, port)) for port in ports]
        rtde, script = (server.getsockname()[1] for server in self._servers)
        self.address = f"{host}:{rtde}:{script}"
        for server, answer in zip(self._servers, (self._rtde, self._script), strict=True):
            threading.Thread(target=self._serve, args=(server, answer), daemon=True).start()

    def close(self) -> None:
        """Stop listening and moving."""
        self._closed.set()
        self._halt()
        for server in self._servers:
            server.close()

    def cut(self) -> None:
        """Fall silent, as where the cable is pulled: nothing comes, nothing is heard, nobody says so."""
        self._silent.set()

    def mend(self) -> None:
        """Be heard again."""
        self._silent.clear()

    def protective_stop(self) -> None:
        """Stop as after a collision, until `unlock`."""
        self.safety_bits = PROTECTIVE_STOP
        self._halt()

    def unlock(self) -> None:
        """Be ready again."""
        self.safety_bits = 1

    def _serve(self, server: socket.socket, answer: Callable[[socket.socket], None]) -> None:
        while not self._closed.is_set():
            try:
                link, _ = server.accept()
            except OSError:
                return
            threading.Thread(target=self._answered, args=(answer, link), daemon=True).start()

    def _answered(self, answer: Callable[[socket.socket], None], link: socket.socket) -> None:
        with link:
            try:
                answer(link)
            except (OSError, struct.error):
                return

    # RTDE.

    def _rtde(self, link: socket.socket) -> None:
        exchange, waiting = _Exchange(link, self._registers, self._heard_s), b""
        link.settimeout(CYCLE_S)
        while not self._closed.is_set():
            if self._silent.is_set():
                time.sleep(CYCLE_S)
                continue
            try:
                part = link.recv(4096)
                if not part:
                    return
                waiting += part
            except TimeoutError:
                pass
            while len(waiting) >= HEADER.size and len(waiting) >= HEADER.unpack_from(waiting)[0]:
                size, kind = HEADER.unpack_from(waiting)
                body, waiting = waiting[HEADER.size : size], waiting[size:]
                exchange.take(kind, body)
            if exchange.is_due():
                exchange.publish(self._value)

    def _value(self, name: str) -> Any:  # noqa: ANN401 - a number or six
        running = self._program is not None and self._program[0].is_alive()
        return {
            "timestamp": time.monotonic(),
            "actual_q": self._q,
            "target_q": self._q,
            "actual_qd": self._rate,
            "actual_TCP_pose": _six(self._flange() @ self._tool),
            "runtime_state": PLAYING if running else STOPPED,
            "robot_mode": 7,
            "robot_status_bits": 1 | (2 if running else 0),
            "safety_status_bits": self.safety_bits,
        }.get(name, self._registers.get(name, 0))

    # Programs.

    def _script(self, link: socket.socket) -> None:
        text = ""
        link.settimeout(0.2)
        while not self._closed.is_set():
            try:
                part = link.recv(4096)
            except TimeoutError:
                continue
            if not part:
                return
            if self._silent.is_set() or not self.remote_control:
                continue
            text += part.decode()
            while "\nend\n" in text:
                program, _, text = text.partition("\nend\n")
                self._start(program.splitlines())

    def _start(self, lines: list[str]) -> None:
        self.programs.append("\n".join(lines))
        if lines[0].startswith("sec "):
            self._run(iter(lines[1:]), {}, threading.Event())
            return
        with self._starting:
            self._halt()
            if self.safety_bits != 1:
                return
            halted = threading.Event()
            thread = threading.Thread(target=self._run, args=(iter(lines[1:]), {}, halted), daemon=True)
            self._program = (thread, halted)
            thread.start()

    def _halt(self) -> None:
        if self._program is not None:
            thread, halted = self._program
            halted.set()
            thread.join()

    def _run(self, lines: Iterator[str], names: dict[str, Any], halted: threading.Event) -> None:
        """Run lines up to `end`."""
        for raw in lines:
            line = raw.strip()
            if line == "end" or halted.is_set():
                return
            if line.startswith("if "):
                self._branches(lines, names, halted, taken=bool(self._evaluated(line[3:-1], names, halted)))
            else:
                self._done(line, names, halted)

    def _branches(
        self, lines: Iterator[str], names: dict[str, Any], halted: threading.Event, *, taken: bool
    ) -> None:
        """Run the branch that is taken; none lies inside another."""
        for raw in lines:
            line = raw.strip()
            if line == "end" or halted.is_set():
                return
            if line == "else:":
                taken = not taken
            elif taken:
                self._done(line, names, halted)

    def _done(self, line: str, names: dict[str, Any], halted: threading.Event) -> None:
        name, equals, expression = line.partition(" = ")
        found = self._evaluated(expression if equals else line, names, halted)
        if equals:
            names[name] = found

    def _evaluated(self, text: str, names: dict[str, Any], halted: threading.Event) -> Any:  # noqa: ANN401
        """Return what an expression of URScript gives; it is read, never run as Python."""

        def value(node: ast.expr) -> Any:  # noqa: ANN401
            if isinstance(node, ast.Constant):
                return node.value
            if isinstance(node, ast.Name):
                return names[node.id]
            if isinstance(node, ast.List):
                return [value(item) for item in node.elts]
            if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
                return -value(node.operand)
            if isinstance(node, ast.Subscript):
                return value(node.value)[value(node.slice)]
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                given = {k.arg or "": value(k.value) for k in node.keywords}
                return self._called(node.func.id, [value(a) for a in node.args], given, halted)
            raise DeviceError(f"URScript that is not known here: {text[:80]}", code=Code.BAD_PROGRAM)

        return value(ast.parse(text, mode="eval").body)

    def _called(self, name: str, given: list[Any], named: dict[str, Any], halted: threading.Event) -> Any:  # noqa: ANN401
        if name == "write_output_integer_register":
            self._registers[f"output_int_register_{given[0]}"] = given[1]
        elif name == "write_output_float_register":
            self._registers[f"output_double_register_{given[0]}"] = given[1]
        elif name == "get_actual_tool_flange_pose":
            return _six(self._flange()).tolist()
        elif name == "is_within_safety_limits":
            return self.cell.arm.within_limits(given[0])
        elif name == "rtde_set_watchdog":
            self._heard_s[given[0]] = time.monotonic()
            self._watchdog = (given[0], 1.0 / given[1])
        elif name == "movej":
            self._move(np.array(given[0]), named["v"], named["a"], halted)
        elif name == "stopj":
            self._rate = np.zeros(6)
        else:
            raise DeviceError(f"URScript function {name} is not known here", code=Code.BAD_PROGRAM)
        return None

    def _move(self, there: FloatArray, speed: float, acceleration: float, halted: threading.Event) -> None:
        """Move all joints in step, the fastest at `speed`; stop where nobody is heard any more."""
        here, turn = self._q.copy(), there - self._q
        way, began = float(np.abs(turn).max()), time.monotonic()
        top = min(speed, float(np.sqrt(way * acceleration)))
        ramp_s = top / acceleration
        total_s = way / top + ramp_s if way > 0 else 0.0
        while (t := self._pace * (time.monotonic() - began)) < total_s:
            late = self._watchdog is not None and (
                time.monotonic() - self._heard_s[self._watchdog[0]] > self._watchdog[1]
            )
            if late or halted.wait(CYCLE_S):
                halted.set()
                break
            left_s = total_s - t
            if t < ramp_s:
                done = acceleration * t * t / 2
            elif left_s < ramp_s:
                done = way - acceleration * left_s * left_s / 2
            else:
                done = top * (t - ramp_s / 2)
            self._rate = turn / max(way, 1e-12) * min(acceleration * min(t, left_s), top)
            self._q = here + turn * done / way
        else:
            self._q = there
        self._watchdog = None
        self.cell.stand(tuple(self._q.tolist()))
        self._rate = np.zeros(6)

    def _flange(self) -> Pose:
        return Pose(self.cell.arm.forward(self._q))


class _Exchange:
    """One connection of RTDE: what was asked for, and what is sent."""

    def __init__(self, link: socket.socket, registers: dict[str, float], heard_s: dict[str, float]) -> None:
        self._link, self._registers, self._heard_s = link, registers, heard_s
        self._outputs: list[str] = []
        self._inputs: list[str] = []
        self._period_s, self._sent_s = 0.02, 0.0
        self._running = False

    def take(self, kind: int, body: bytes) -> None:
        """Take a package, and answer it."""
        if kind == REQUEST_VERSION:
            _reply(self._link, kind, b"\x01" if body == b"\x00\x02" else b"\x00")
        elif kind == GET_CONTROLLER_VERSION:
            _reply(self._link, kind, struct.pack(">4I", *VERSION))
        elif kind == SETUP_OUTPUTS:
            self._period_s = 1.0 / struct.unpack(">d", body[:8])[0]
            self._outputs = body[8:].decode().strip(",").split(",")
            _reply(self._link, kind, b"\x01" + ",".join(_kind(name) for name in self._outputs).encode())
        elif kind == SETUP_INPUTS:
            self._inputs = body.decode().strip(",").split(",")
            _reply(self._link, kind, b"\x01" + ",".join(_kind(name) for name in self._inputs).encode())
        elif kind in {START, PAUSE}:
            self._running = kind == START
            _reply(self._link, kind, b"\x01")
        elif kind == DATA:
            form = ">" + "".join(FORMATS[_kind(name)] for name in self._inputs)
            for name, value in zip(self._inputs, struct.unpack(form, body[1:]), strict=True):
                self._registers[name], self._heard_s[name] = value, time.monotonic()

    def is_due(self) -> bool:
        """Whether data are to be sent now."""
        return self._running and time.monotonic() - self._sent_s >= self._period_s

    def publish(self, value: Callable[[str], Any]) -> None:
        """Send what was asked for."""
        self._sent_s = time.monotonic()
        data = b""
        for name in self._outputs:
            form = FORMS[_kind(name)]
            count, letter = int(form[:-1] or 1), form[-1]
            numbers = np.broadcast_to(value(name), count).tolist()
            data += struct.pack(f">{form}", *(numbers if letter == "d" else map(int, numbers)))
        _reply(self._link, DATA, b"\x01" + data)


def _reply(link: socket.socket, kind: int, body: bytes) -> None:
    link.sendall(HEADER.pack(HEADER.size + len(body), kind) + body)


def _kind(name: str) -> str:
    """Return the type of a variable, by the RTDE guide."""
    if name in VARIABLES:
        return VARIABLES[name]
    if "double_register" in name:
        return "DOUBLE"
    return "INT32" if "int_register" in name else "NOT_FOUND"


def _six(pose: Pose) -> FloatArray:
    """Return x, y, z and the rotation vector."""
    return np.array([*pose.translation, *cv2.Rodrigues(pose.rotation)[0].ravel()], dtype=np.float64)
