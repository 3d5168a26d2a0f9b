"""A robot and a camera with one fault each, over a simulated cell that knows the truth.

`hostile:MODE` and `hostilecam:MODE` as drivers; the faults begin at the fourth motion or picture.
`mix,SEED` takes one of the faults at random in 30 % of the calls. Every motion is logged into the file
HOSTILE_LOG: whether its joints are beyond a limit, and how many motions run at once. HOSTILE_POINTS sends
points for pictures, HOSTILE_CALM leaves the faults out.
"""
# ruff: noqa: ARG005 - faults take what there is, and need not look at it

import json
import os
import threading
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, NoReturn

import numpy as np

from handeye.cameras.protocol import Frame, Points
from handeye.cameras.simulated import Optics
from handeye.errors import DeviceError
from handeye.robots import open_arm
from handeye.robots.protocol import Goal, Reading
from handeye.session.simulated import SimulationOptions, simulated_cell
from handeye.types import Pose

SEED, ARM, FIRST, SHARE = 31, "epson_c4l", 4, 0.3
POINTS = bool(os.environ.get("HOSTILE_POINTS"))
CELL = simulated_cell(
    open_arm(ARM), SimulationOptions(seed=SEED, optics=Optics(points_only=0.1) if POINTS else Optics())
)


class Unspeakable(Exception):  # noqa: N818
    """An exception that cannot be shown."""

    def __str__(self) -> NoReturn:
        raise ValueError("no text")


class Own(BaseException):
    """An exception that is none."""


class Trap:
    """Something that raises whatever is done with it."""

    def __getattr__(self, name: str) -> NoReturn:
        raise RuntimeError("trap")

    def __array__(self, *_: object, **__: object) -> NoReturn:
        raise RuntimeError("trap")

    def __len__(self) -> NoReturn:
        raise RuntimeError("trap")


class TrappedReading(Reading):
    """A reading of which nothing can be read."""

    def __getattribute__(self, name: str) -> Any:  # noqa: ANN401
        if name in {"T_base_flange", "joints_rad"}:
            raise RuntimeError("trap")
        return super().__getattribute__(name)


class TrappedArray(np.ndarray):
    """A picture whose bytes are kept."""

    def tobytes(self, *_: object) -> NoReturn:
        """Do not."""
        raise RuntimeError("trap")


def raising(error: Callable[[], BaseException]) -> Callable[..., Any]:
    """Return what raises an error."""

    def call(*_: object) -> NoReturn:
        raise error()

    return call


def deep(*_: object) -> None:
    """Never come to an end."""
    deep()


def emptied() -> Pose:
    """Return a pose without a matrix."""
    return Pose.__new__(Pose)


ERRORS: dict[str, Callable[..., Any]] = {
    "unspeakable": raising(Unspeakable),
    "own": raising(Own),
    "group": raising(lambda: BaseExceptionGroup("many", [KeyboardInterrupt(), SystemExit(1)])),
    "stop_iteration": raising(StopIteration),
    "generator_exit": raising(GeneratorExit),
    "no_message": raising(lambda: DeviceError(None)),  # type: ignore[arg-type]
    "trap_message": raising(lambda: DeviceError(Trap(), code=Trap(), hint=Trap())),  # type: ignore[arg-type]
    "code_number": raising(lambda: DeviceError("x", code=5, hint=7)),  # type: ignore[arg-type]
    "surrogates": raising(lambda: DeviceError("\ud800\x1b[2J" * 10**5, code="\x07" * 10**5)),
    "deep": deep,
    "exit_0": raising(lambda: SystemExit(0)),
    "exit_text": raising(lambda: SystemExit("bye")),
    "arm_data": raising(lambda: UnicodeDecodeError("utf-8", b"\xff", 0, 1, "x")),
}

READINGS: dict[str, Callable[[Reading], Any]] = {
    "trapped": lambda r: TrappedReading(r.T_base_flange, r.joints_rad),
    "like": lambda r: SimpleNamespace(T_base_flange=r.T_base_flange, joints_rad=r.joints_rad),
    "class": lambda r: Reading,
    "no_pose": lambda r: Reading(emptied(), r.joints_rad),
    "none_pose": lambda r: Reading(None, r.joints_rad),  # type: ignore[arg-type]
    "trap_joints": lambda r: Reading(r.T_base_flange, Trap()),  # type: ignore[arg-type]
    "deep_joints": lambda r: Reading(r.T_base_flange, ((r.joints_rad,),)),  # type: ignore[arg-type]
    "scalar_joints": lambda r: Reading(r.T_base_flange, 3.0),  # type: ignore[arg-type]
    "bool_joints": lambda r: Reading(r.T_base_flange, (True,) * 6),
    "complex_joints": lambda r: Reading(r.T_base_flange, (1j,) * 6),  # type: ignore[arg-type]
    "infinite_joints": lambda r: Reading(r.T_base_flange, (float("inf"),) * 6),
    "huge_joints": lambda r: Reading(r.T_base_flange, (1e300,) * 6),
    "huge_whole_joints": lambda r: Reading(r.T_base_flange, (10**400,) * 6),
    "endless_joints": lambda r: Reading(r.T_base_flange, np.broadcast_to(0.0, (10**12,))),  # type: ignore[arg-type]
    "texts": lambda r: Reading(r.T_base_flange, ("0.1",) * 6),  # type: ignore[arg-type]
    "dict_joints": lambda r: Reading(r.T_base_flange, dict(enumerate(r.joints_rad or ()))),  # type: ignore[arg-type]
    "turned_joints": lambda r: Reading(r.T_base_flange, tuple(q + 2 * np.pi for q in r.joints_rad or ())),
    "negative_joints": lambda r: Reading(r.T_base_flange, tuple(-q for q in r.joints_rad or ())),
    "other_order": lambda r: Reading(r.T_base_flange, (r.joints_rad or ())[::-1]),
    "far": lambda r: Reading(Pose.exp([1e8, 0, 0, 0, 0, 0]) @ r.T_base_flange, r.joints_rad),
    "tool": lambda r: Reading(r.T_base_flange @ Pose.exp([0, 0, 0.05, 0, 0, 0.3]), r.joints_rad),
    "base_turned": lambda r: Reading(Pose.exp([0, 0, 0, 0, 0, np.pi]) @ r.T_base_flange, r.joints_rad),
    "restless": lambda r: Reading(
        Pose.exp([0.01 * np.sin(time.monotonic_ns() / 7e5), 0, 0, 0, 0, 0]) @ r.T_base_flange, r.joints_rad
    ),
}


class Robot:
    """A robot with one fault."""

    def __init__(self, address: str) -> None:
        self._arm = CELL.hidden_arm
        self._limits = open_arm(ARM).limits
        self._mode, _, number = address.partition(",")
        self._random = np.random.default_rng(int(number or 0))
        self._claimed: Reading | None = None
        self._moves = self._at_once = 0
        if self._mode == "exit_at_start":
            raise SystemExit(1)
        if self._mode == "unspeakable_at_start":
            raise Unspeakable

    def _fault(self, among: tuple[str, ...]) -> str:
        """Return the fault that is due now, or nothing."""
        if os.environ.get("HOSTILE_CALM"):
            return ""
        if self._mode == "mix":
            return str(self._random.choice(among)) if self._random.uniform() < SHARE else ""
        return self._mode if self._moves >= FIRST else ""

    def move_to(self, goal: Goal) -> None:
        """Go there, or do otherwise."""
        self._moves += 1
        self._at_once += 1
        joints = np.array(goal.joints_rad)
        outside = (joints < self._limits[:, 0] - 1e-12) | (joints > self._limits[:, 1] + 1e-12)
        log(
            event="move",
            beyond=bool(outside.any() or not np.isfinite(joints).all()),
            concurrent=self._at_once,
        )
        if self._mode == "stuck":
            time.sleep(1e6)
        fault = self._fault((*ERRORS, "lie", "lie_half", "half", "overshoot", "ignore", "refuse"))
        try:
            if fault in ERRORS:
                ERRORS[fault]()
            self._go(goal, joints, fault)
        finally:
            self._at_once -= 1

    def _go(self, goal: Goal, joints: np.ndarray, fault: str) -> None:
        here = np.array(self._arm.read_pose().joints_rad)
        share = {"lie": 0.0, "lie_half": 0.5, "half": 0.5, "overshoot": 1.05, "ignore": 0.0, "refuse": 0.0}
        to = np.clip(here + share.get(fault, 1.0) * (joints - here), self._limits[:, 0], self._limits[:, 1])
        if fault == "beyond":
            to = joints + 0.0
            to[-1] = self._limits[-1, 1] + 0.3
        if fault == "rewrite":
            object.__setattr__(goal, "joints_rad", (0.0,) * 6)
            object.__setattr__(goal, "T_base_flange", Pose.identity())
        if fault == "away":
            os.chdir("/")
        if fault == "much":
            print("x" * 10**6)
        if fault == "background":
            threading.Timer(0.3, self._arm.place, [to.tolist()]).start()
            return
        claim = Reading(goal.T_base_flange, goal.joints_rad)
        self._arm.move_to(Goal(goal.label, goal.T_base_flange, tuple(to.tolist()), goal.speed_rad_s))
        self._claimed = claim if fault in {"lie", "lie_half"} else None
        if fault == "refuse":
            raise DeviceError("no", code="motion_refused")

    def read_pose(self) -> Any:  # noqa: ANN401
        """Say where it stands, or something else."""
        reading = self._claimed or self._arm.read_pose()
        fault = self._fault((*READINGS, *("" for _ in range(3 * len(READINGS)))))
        if fault.startswith("read_") and fault[5:] in ERRORS:
            ERRORS[fault[5:]]()
        return READINGS[fault](reading) if fault in READINGS else reading

    def stop(self) -> None:
        """Stop, or do not."""
        fault = self._fault(("",))
        if fault.startswith("stop_") and fault[5:] in ERRORS:
            ERRORS[fault[5:]]()

    def close(self) -> None:
        """Let go, or do not."""
        log(event="close", concurrent=self._at_once)
        closed(self._mode)


def pointed(frame: Frame, change: Callable[[Any, Any], tuple[Any, Any]]) -> Frame:
    """Return a frame of points that are changed."""
    points = frame.points or Points(np.arange(70), np.random.default_rng(1).uniform(100, 900, (70, 2)))
    return Frame(None, Points(*change(points.point_ids, points.pixels)))


def bent(frame: Frame, change: Callable[[Any], Any]) -> Any:  # noqa: ANN401
    """Return a frame whose picture was changed past its checks."""
    image = np.zeros((1024, 1280), np.uint8) if frame.image is None else frame.image
    changed = Frame(image)
    object.__setattr__(changed, "image", change(image))
    return changed


def timed(frame: Frame, time_s: Any) -> Frame:  # noqa: ANN401
    """Return a frame with another time."""
    return Frame(frame.image, frame.points, time_s)


FRAMES: dict[str, Callable[[Frame], Any]] = {
    "like": lambda f: SimpleNamespace(image=f.image, points=f.points, timestamp_s=None),
    "class": lambda f: Frame,
    "list_image": lambda f: bent(f, lambda image: image[:2].tolist()),
    "trap_image": lambda f: bent(f, lambda image: Trap()),
    "trapped_array": lambda f: bent(f, lambda image: image.view(TrappedArray)),
    "masked": lambda f: bent(f, lambda image: np.ma.masked_array(image, image > 9)),
    "like_image": lambda f: bent(
        f, lambda image: SimpleNamespace(ndim=2, dtype=np.dtype(np.uint8), shape=image.shape)
    ),
    "sixteen": lambda f: bent(f, lambda image: image.astype(np.uint16)),
    "objects": lambda f: bent(f, lambda image: image[:4].astype(object)),
    "bools": lambda f: bent(f, lambda image: image > 9),
    "huge_image": lambda f: bent(f, lambda image: np.broadcast_to(np.uint8(1), (10**6, 10**6))),
    "huge_image_of_points": lambda f: Frame(
        np.broadcast_to(np.uint8(1), (10**6, 10**6)), pointed(f, lambda ids, xy: (ids, xy)).points
    ),
    "endless_points": lambda f: pointed(
        f, lambda ids, xy: (np.broadcast_to(1, (10**12,)), np.broadcast_to(1.0, (10**12, 2)))
    ),
    "no_pixels": lambda f: bent(f, lambda image: image[:0]),
    "one_more_axis": lambda f: bent(f, lambda image: image[:, :, np.newaxis]),
    "turned": lambda f: bent(f, lambda image: np.ascontiguousarray(np.rot90(image))),
    "backwards": lambda f: bent(f, lambda image: image[::-1][::-1]),
    "mirrored": lambda f: pointed(f, lambda ids, xy: (ids, np.array([1280, 0]) - xy * [1, -1])),
    "shifted": lambda f: pointed(f, lambda ids, xy: (ids, np.add(xy, [40, 0]))),
    "shuffled": lambda f: pointed(f, lambda ids, xy: (ids[::-1], xy)),
    "unordered": lambda f: pointed(f, lambda ids, xy: (ids[::-1], xy[::-1])),
    "negative_ids": lambda f: pointed(f, lambda ids, xy: (np.asarray(ids) - 5, xy)),
    "large_ids": lambda f: pointed(f, lambda ids, xy: (np.asarray(ids) + 10**12, xy)),
    "next_ids": lambda f: pointed(f, lambda ids, xy: (np.asarray(ids) + 30, xy)),
    "float_ids": lambda f: pointed(f, lambda ids, xy: (np.asarray(ids) + 0.5, xy)),
    "text_ids": lambda f: pointed(f, lambda ids, xy: (["a"] * len(ids), xy)),
    "trap_ids": lambda f: pointed(f, lambda ids, xy: (Trap(), xy)),
    "trap_pixels": lambda f: pointed(f, lambda ids, xy: (ids, Trap())),
    "flat_pixels": lambda f: pointed(f, lambda ids, xy: (ids, np.ravel(xy))),
    "huge_pixels": lambda f: pointed(f, lambda ids, xy: (ids, np.asarray(xy) * 1e300)),
    "one_place": lambda f: pointed(f, lambda ids, xy: (ids, np.full_like(xy, 500.0))),
    "on_a_line": lambda f: pointed(f, lambda ids, xy: (ids, np.asarray(xy) * [1, 0] + [0, 300])),
    "like_points": lambda f: Frame(
        None,
        SimpleNamespace(point_ids=np.arange(9), pixels=np.eye(9, 2), labels_known=False),  # type: ignore[arg-type]
    ),
    "known_text": lambda f: Frame(f.image, Points(np.arange(9), np.eye(9, 2), "yes")),  # type: ignore[arg-type]
    "time_infinite": lambda f: timed(f, float("inf")),
    "time_huge": lambda f: timed(f, 10**400),
    "time_before": lambda f: timed(f, -1e300),
    "time_trap": lambda f: timed(f, Trap()),
    "time_numpy": lambda f: timed(f, np.float32(1)),
    "time_list": lambda f: timed(f, [1.0]),
}


class Camera:
    """A camera with one fault."""

    def __init__(self, address: str) -> None:
        self._source = CELL.cell.source
        self._mode, _, number = address.partition(",")
        self._random = np.random.default_rng([1, int(number or 0)])
        self._count = 0
        self._last: Frame | None = None

    def grab(self, label: str) -> Any:  # noqa: ANN401
        """Take a picture, or bring something else."""
        self._count += 1
        if self._mode == "stuck":
            time.sleep(1e6)
        before, self._last = self._last, self._source.grab(label)
        calm = self._count < FIRST or bool(os.environ.get("HOSTILE_CALM"))
        fault = "" if calm else self._mode
        if self._mode == "mix" and not os.environ.get("HOSTILE_CALM"):
            among = (*FRAMES, *ERRORS, "late", "again")
            fault = str(self._random.choice(among)) if self._random.uniform() < SHARE else ""
        if fault == "late" and before is not None:
            return before
        if fault == "again" and before is not None:
            self._last = before
            return before
        if fault == "overwritten" and self._last.image is not None:
            threading.Timer(0.02, self._last.image.fill, [7]).start()
        if fault in ERRORS:
            ERRORS[fault]()
        return FRAMES[fault](self._last) if fault in FRAMES else self._last

    def close(self) -> None:
        """Let go, or do not."""
        log(event="close camera")
        closed(self._mode)


def closed(mode: str) -> None:
    """Fail as the mode has it."""
    if mode.startswith("close_") and not os.environ.get("HOSTILE_CALM"):
        ERRORS.get(mode[6:], lambda: time.sleep(1e6))()


CLOSING = ("close_stuck", *(f"close_{name}" for name in ("unspeakable", "own", "exit_0", "deep")))
ROBOT_MODES = (
    *("ok", "exit_at_start", "unspeakable_at_start", "mix,1", "mix,2"),
    *("lie", "lie_half", "half", "overshoot", "ignore", "refuse", "beyond", "rewrite", "away", "much"),
    "background",
    *ERRORS,
    *READINGS,
    *(f"read_{name}" for name in ERRORS),
    *(f"stop_{name}" for name in ERRORS),
    *CLOSING,
)
CAMERA_MODES = ("late", "again", "overwritten", "mix,1", "mix,2", *ERRORS, *FRAMES, *CLOSING)


def log(**event: object) -> None:
    """Write down what happened."""
    with open(os.environ["HOSTILE_LOG"], "a") as file:  # noqa: PTH123
        file.write(json.dumps(event) + "\n")
