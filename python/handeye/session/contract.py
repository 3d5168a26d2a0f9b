"""What every driver must do, one function a rule; each returns what it found wrong, in words.

With a real arm the motions really happen: give goals that are safe. What can be checked without a motion is
checked at the start of every session. `handeye.testing` has the same rules, and those that need somebody who
pulls cables, as tests.
"""

import math
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np

from handeye.cameras.protocol import ImageSource, checked_frame
from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.robots.reading import LIMIT_TOLERANCE, checked_reading, typed_reading
from handeye.robots.replay import is_near
from handeye.session.attempt import Cell
from handeye.session.calls import Calls

# How long a method may take, and how far off a motion may end, in these checks.
SECONDS, NEAR_M, NEAR_RAD = 60.0, 0.005, 0.02
# Two readings at rest are as near.
REST_M, REST_RAD = 1e-4, 1e-3
# A motion is this long where it is to be interrupted, and has ended this soon after.
INTERRUPTED_S, ENDED_S = 3.0, 5.0
# A motion that is shorter by this share is not too fast.
SPEED_TOLERANCE = 0.05


def check_at_rest(cell: Cell) -> None:
    """Check where a robot stands that it rests, may be telling the truth, and can be stopped.

    Raises
    ------
    DeviceError
        It does not, or its readings cannot be those of the arm.
    """
    if cell.workspace is None or cell.by_hand:
        return  # nothing moves by itself
    first, second = cell.read(), cell.read()
    if not is_near(first.T_base_flange, second.T_base_flange, REST_M, REST_RAD):
        raise DeviceError("the arm moves before the session has begun", code=Code.NOT_AT_REST)
    why = cell.stop()
    if why is not None:
        raise DeviceError(
            f"the robot cannot be stopped, and so it is not moved: {why}",
            code=Code.STOP_FAILED,
            hint="stop() must work from any thread, also if nothing moves",
        )


def check_robot(robot: Robot, goals: Sequence[Goal], unreachable: Goal | None = None) -> list[str]:
    """Return what a robot's driver does wrong, in words; nothing if it keeps the contract.

    Parameters
    ----------
    robot
        The driver.
    goals
        At least two safe places that differ.
    unreachable
        A place that the robot must refuse, if that can be tried safely.
    """
    if not isinstance(robot, Robot):  # pyright: ignore[reportUnnecessaryIsInstance]
        return ["it lacks move_to, read_pose or stop"]
    wrong = [words for goal in goals for words in arrival(robot, goal)]
    if unreachable is not None:
        wrong += refusal(robot, unreachable)
    return wrong + stop_at_rest(robot)


def arrival(robot: Robot, goal: Goal, arm: Arm | None = None) -> list[str]:
    """Go there: it ends there, rests, and says so in metres and radians; of `arm`, what its joints reach."""
    calls = Calls("robot")
    try:
        calls.run(SECONDS, robot.move_to, goal)
        answers = [calls.run(SECONDS, robot.read_pose) for _ in range(2)]
        first, second = (typed_reading(answer) for answer in answers)
        if arm is not None:
            checked_reading(first, arm, expected=goal.T_base_flange)
    except DeviceError as error:
        return [f"{goal.label}: {error.message}"]
    return _reading(goal, first, second)


def speed_kept(robot: Robot, goals: Sequence[Goal]) -> list[str]:
    """Go from the first to the second goal slowly: it takes as long as that speed asks for."""
    there = slowed(goals, INTERRUPTED_S)
    if there is None:
        return ["speed: two goals with joints that differ are needed"]
    wrong = arrival(robot, goals[0])
    began = time.monotonic()
    wrong += arrival(robot, there)
    took_s = time.monotonic() - began
    if not wrong and took_s < (1 - SPEED_TOLERANCE) * INTERRUPTED_S:
        wrong.append(
            f"speed: the way took {took_s:.1f} s, at the speed of the goal {INTERRUPTED_S:.1f} s or more"
        )
    return wrong


def refusal(robot: Robot, unreachable: Goal) -> list[str]:
    """Send a goal that cannot be reached: it is refused by that name, and the arm stays where it is."""
    calls = Calls("robot")
    before = read(robot)
    try:
        calls.run(SECONDS, robot.move_to, unreachable)
    except DeviceError as error:
        if error.code != Code.MOTION_REFUSED:
            return [f"{unreachable.label}: refused with code {error.code}, expected {Code.MOTION_REFUSED}"]
    else:
        return [f"{unreachable.label}: went, or says so, where it must refuse"]
    after = read(robot)
    if (
        before is not None
        and after is not None
        and not is_near(before.T_base_flange, after.T_base_flange, REST_M, REST_RAD)
    ):
        return [f"{unreachable.label}: refused, and the arm moved all the same"]
    return []


def stop_at_rest(robot: Robot) -> list[str]:
    """Stop twice where nothing moves."""
    calls = Calls("robot")
    try:
        calls.beside(SECONDS, robot.stop)
        calls.beside(SECONDS, robot.stop)
    except DeviceError as error:
        return [f"stop at rest: {error.message}"]
    return []


def stop_in_motion(robot: Robot, goals: Sequence[Goal]) -> list[str]:
    """Stop half way from the first to the second goal: the arm rests short of it, and can go on."""
    there = slowed(goals, INTERRUPTED_S)
    if there is None:
        return ["stop in motion: two goals with joints that differ are needed"]
    wrong = arrival(robot, goals[0])
    if wrong:
        return wrong

    def stop() -> None:
        Calls("robot").beside(SECONDS, robot.stop)

    took_s, error = interrupted(robot, there, stop)
    if took_s > INTERRUPTED_S / 2 + ENDED_S:
        wrong.append(f"stop in motion: move_to came back only {took_s:.0f} s after it began")
    if error is not None and not isinstance(error, DeviceError):
        wrong.append(f"stop in motion: move_to raised {type(error).__name__}, expected DeviceError")
    first, second = read(robot), read(robot)
    if first is None or second is None:
        return [*wrong, "stop in motion: the pose cannot be read afterwards"]
    if is_near(first.T_base_flange, there.T_base_flange, NEAR_M, NEAR_RAD):
        wrong.append("stop in motion: the arm went on to its goal")
    elif error is None:
        wrong.append("stop in motion: move_to returned as if the goal had been reached, expected DeviceError")
    if not is_near(first.T_base_flange, second.T_base_flange, REST_M, REST_RAD):
        wrong.append("stop in motion: the arm still moves")
    return wrong + arrival(robot, goals[1])


def limits_stated(robot: Robot) -> list[str]:
    """Compare the limits of its joints, where it states them, with where it stands."""
    limits: object = getattr(robot, "joint_limits", None)
    reading = read(robot)
    joints = None if reading is None else reading.joints_rad
    if limits is None or joints is None:
        return []
    try:
        low, high = np.array(limits, dtype=float).reshape(len(joints), 2).T
    except (TypeError, ValueError) as error:
        return [f"joint_limits: {error}; expected the lowest and highest position of {len(joints)} joints"]
    if not np.all(low < high):
        return ["joint_limits: the lowest position of a joint is not below the highest"]
    if not np.all((low - LIMIT_TOLERANCE <= joints) & (joints <= high + LIMIT_TOLERANCE)):
        return ["joint_limits: the arm stands beyond them; radians, and in this order?"]
    return []


def closed_twice(driver: object) -> list[str]:
    """Close a driver twice, where it has `close`: the end of a session must not depend on its connection."""
    close: Callable[[], None] | None = getattr(driver, "close", None)
    for time_of in ("first", "second"):
        try:
            if close is not None:
                Calls("driver").run(SECONDS, close)
        except DeviceError as error:
            return [f"close, the {time_of} time: {error.message}"]
    return []


def interrupted(
    robot: Robot, goal: Goal, interrupt: Callable[[], None]
) -> tuple[float, BaseException | None]:
    """Interrupt a motion half way; return the seconds that it took, and what it raised."""
    raised: list[BaseException] = []

    def move() -> None:
        try:
            robot.move_to(goal)
        except BaseException as error:  # noqa: BLE001 - whatever a driver raises
            raised.append(error)

    thread = threading.Thread(target=move, daemon=True)
    began = time.monotonic()
    thread.start()
    thread.join(INTERRUPTED_S / 2)
    interrupt()
    thread.join(SECONDS)
    return time.monotonic() - began, raised[0] if raised else None


def slowed(goals: Sequence[Goal], seconds: float) -> Goal | None:
    """Return the second goal, so slow that the way from the first takes that long; None without joints."""
    here, there = goals[0].joints_rad, goals[1].joints_rad
    if here is None or there is None or here == there:
        return None
    turn = float(np.abs(np.subtract(there, here)).max())
    return Goal(goals[1].label, goals[1].T_base_flange, there, turn / seconds)


def read(robot: Robot) -> Reading | None:
    """Return where a robot says it is; None if it does not say."""
    try:
        return typed_reading(Calls("robot").run(SECONDS, robot.read_pose))
    except DeviceError:
        return None


def check_camera(source: ImageSource, size_px: tuple[int, int] | None = None) -> list[str]:
    """Return what a camera's driver does wrong, in words; nothing if it keeps the contract."""
    if not isinstance(source, ImageSource):  # pyright: ignore[reportUnnecessaryIsInstance]
        return ["it lacks grab"]
    wrong: list[str] = []
    calls = Calls("camera")
    kept: list[tuple[object, object]] = []
    last_s = -math.inf
    for label in ("view_01.1", "view_01.2"):
        try:
            frame = checked_frame(calls.run(SECONDS, source.grab, label))
        except DeviceError as error:
            wrong.append(f"{label}: {error.message}")
            continue
        if frame.image is not None and size_px is not None and frame.image.shape != size_px[::-1]:
            height, width = frame.image.shape
            wrong.append(f"{label}: {width} x {height} pixels, expected {size_px[0]} x {size_px[1]}")
        if frame.timestamp_s is not None and frame.timestamp_s < last_s:
            wrong.append(f"{label}: the time of the exposure is before that of the picture before")
        last_s = -math.inf if frame.timestamp_s is None else frame.timestamp_s
        if frame.image is not None:
            kept.append((frame.image, frame.image.copy()))
    if any(not np.array_equal(image, copy) for image, copy in kept):  # pyright: ignore[reportArgumentType]
        wrong.append("a picture changes once the next is taken: return a copy of the buffer")
    return wrong


def _reading(goal: Goal, first: Reading, second: Reading) -> list[str]:
    wrong: list[str] = []
    if not is_near(goal.T_base_flange, first.T_base_flange, NEAR_M, NEAR_RAD):
        off = 1e3 * float(np.linalg.norm(first.T_base_flange.translation - goal.T_base_flange.translation))
        wrong.append(f"{goal.label}: says that it ended {off:.1f} mm away; metres, and this flange?")
    if not is_near(first.T_base_flange, second.T_base_flange, REST_M, REST_RAD):
        wrong.append(f"{goal.label}: at rest two readings differ: move_to returns before the arm rests")
    if first.joints_rad is not None and goal.joints_rad is not None:
        if len(first.joints_rad) != len(goal.joints_rad):
            wrong.append(f"{goal.label}: {len(first.joints_rad)} joints, expected {len(goal.joints_rad)}")
        elif np.abs(np.subtract(first.joints_rad, goal.joints_rad)).max() > NEAR_RAD:
            wrong.append(f"{goal.label}: the joints read back are others; radians, and in this order?")
    return wrong
