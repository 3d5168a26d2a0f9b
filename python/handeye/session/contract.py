"""What every driver must do, as checks that its author can run; each returns what it found wrong.

With a real arm the motions really happen: give goals that are safe. What can be checked without a motion is
checked at the start of every session.
"""

from collections.abc import Sequence

import numpy as np

from handeye.cameras.protocol import ImageSource, checked_frame
from handeye.errors import DeviceError
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.robots.reading import typed_reading
from handeye.robots.replay import is_near
from handeye.session.attempt import Cell
from handeye.session.calls import Calls

# How long a method may take, and how far off a motion may end, in these checks.
SECONDS, NEAR_M, NEAR_RAD = 60.0, 0.005, 0.02
# Two readings at rest are as near.
REST_M, REST_RAD = 1e-4, 1e-3


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
        raise DeviceError("the arm moves before the session has begun", code="not_at_rest")
    why = cell.stop()
    if why is not None:
        raise DeviceError(
            f"the robot cannot be stopped, and so it is not moved: {why}",
            code="stop_failed",
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
    wrong: list[str] = []
    calls = Calls("robot")
    for goal in goals:
        try:
            calls.run(SECONDS, robot.move_to, goal)
            first, second = (typed_reading(calls.run(SECONDS, robot.read_pose)) for _ in range(2))
        except DeviceError as error:
            wrong.append(f"{goal.label}: {error.message}")
            continue
        wrong += _reading(goal, first, second)
    if unreachable is not None:
        wrong += _refusal(calls, robot, unreachable)
    try:
        calls.beside(SECONDS, robot.stop)
        calls.beside(SECONDS, robot.stop)
    except DeviceError as error:
        wrong.append(f"stop at rest: {error.message}")
    return wrong


def check_camera(source: ImageSource, size_px: tuple[int, int] | None = None) -> list[str]:
    """Return what a camera's driver does wrong, in words; nothing if it keeps the contract."""
    if not isinstance(source, ImageSource):  # pyright: ignore[reportUnnecessaryIsInstance]
        return ["it lacks grab"]
    wrong: list[str] = []
    calls = Calls("camera")
    for label in ("view_01.1", "view_01.2"):
        try:
            frame = checked_frame(calls.run(SECONDS, source.grab, label))
        except DeviceError as error:
            wrong.append(f"{label}: {error.message}")
            continue
        if frame.image is not None and size_px is not None and frame.image.shape != size_px[::-1]:
            height, width = frame.image.shape
            wrong.append(f"{label}: {width} x {height} pixels, expected {size_px[0]} x {size_px[1]}")
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


def _refusal(calls: Calls, robot: Robot, unreachable: Goal) -> list[str]:
    try:
        calls.run(SECONDS, robot.move_to, unreachable)
    except DeviceError as error:
        if error.code != "motion_refused":
            return [f"{unreachable.label}: refused with code {error.code!r}, expected 'motion_refused'"]
        return []
    return [f"{unreachable.label}: went, or says so, where it must refuse"]
