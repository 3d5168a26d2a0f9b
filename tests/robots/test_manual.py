"""A person moves the arm: units as on the pendant, checked; joints that nobody tells are not known."""

from collections.abc import Iterator

import numpy as np
import pytest

from handeye.errors import DeviceError
from handeye.notations import NOTATIONS, SHOWN, pose_text
from handeye.robots import open_arm
from handeye.robots.manual import ManualRobot, describe, joints_of_numbers
from handeye.robots.protocol import Goal
from handeye.types import Pose

ARM = open_arm("ur5e")
JOINTS = np.array([0.3, -1.2, 1.4, -1.0, -1.5, 0.2])
POSE = Pose(ARM.forward(JOINTS))
GOAL = Goal("view_01.1", POSE, tuple(JOINTS.tolist()))
DEGREES = " ".join(f"{value:.4f}" for value in np.rad2deg(JOINTS))


def pendant() -> str:
    """Return the pose as a UR's pendant shows it: millimetres and a rotation vector in radians."""
    x, y, z, rx, ry, rz = NOTATIONS["ur"].numbers(POSE)
    return f"{1e3 * x:.2f} {1e3 * y:.2f} {1e3 * z:.2f} {rx:.4f} {ry:.4f} {rz:.4f}"


def talking(*lines: str, **options: object) -> tuple[ManualRobot, list[str], list[str]]:
    answers: Iterator[str] = iter(lines)
    asked: list[str] = []
    told: list[str] = []

    def ask(question: str) -> str:
        asked.append(question)
        line = next(answers, None)
        if line is None:
            raise EOFError
        return line

    return ManualRobot(ask, told.append, arm=ARM, **options), asked, told  # type: ignore[arg-type]


@pytest.mark.parametrize("text", [pendant(), pose_text(POSE, NOTATIONS["ur"])])
def test_millimetres_as_on_the_pendant_or_metres_as_in_the_program(text: str) -> None:
    robot, asked, _ = talking(text, DEGREES)
    reading = robot.read_pose()
    assert np.abs(reading.T_base_flange.translation - POSE.translation).max() < 1e-5
    assert reading.joints_rad == pytest.approx(JOINTS, abs=1e-5)
    assert "mm and a rotation vector in rad as on the pendant" in asked[0]
    assert "6 joint positions (deg" in asked[1]


def test_other_units_are_asked_about_instead_of_believed() -> None:
    x, y, z, rx, ry, rz = NOTATIONS["ur"].numbers(POSE)
    metres = f"{x} {y} {z} {rx} {ry} {rz}"
    in_program = f"p[{1e3 * x}, {1e3 * y}, {1e3 * z}, {rx}, {ry}, {rz}]"
    radians = " ".join(map(str, JOINTS))
    robot, _, told = talking(metres, in_program, pendant(), radians, pendant(), DEGREES)
    assert robot.read_pose().joints_rad == pytest.approx(JOINTS, abs=1e-5)
    assert ["mm from the base" in text for text in told] == [True, True, False]
    assert "not that of ur5e" in told[2]
    assert "734331" not in " ".join(told)


def test_joints_that_nobody_tells_are_not_shown() -> None:
    robot, asked, told = talking(pendant(), "", pendant())
    assert robot.read_pose().joints_rad is None
    robot.move_to(GOAL)
    assert robot.read_pose().joints_rad is None
    assert "joints" not in told[-1]
    assert len(asked) == 3
    # Told once, they are shown, and asked for every time; Enter says that they are those shown.
    robot, asked, told = talking(pendant(), DEGREES, pendant(), "", pendant(), "1 2 3", pendant(), DEGREES)
    robot.read_pose()
    robot.move_to(GOAL)
    assert "joints" in told[-1]
    assert robot.read_pose().joints_rad == GOAL.joints_rad
    robot.move_to(GOAL)
    assert any("3 joint positions, expected 6" in text for text in told)


def test_joints_shown_are_not_taken_for_a_pose_that_they_do_not_reach() -> None:
    other = ARM.postures(POSE)
    elsewhere = other[int(np.argmax(np.abs(other - JOINTS).max(axis=1)))]
    goal = Goal("view_02.1", POSE @ Pose.exp([0.05, 0, 0, 0, 0, 0]), tuple(elsewhere.tolist()))
    robot, _, told = talking(pendant(), DEGREES, pendant(), "", "skip")
    robot.read_pose()
    moved = Goal("x", goal.T_base_flange, tuple((JOINTS + 0.2).tolist()))
    with pytest.raises(DeviceError) as error:
        robot.move_to(moved)
    assert error.value.code == "motion_refused"
    assert any("not that of ur5e" in text for text in told)


def test_after_a_refused_motion_it_is_asked_where_the_arm_stands() -> None:
    robot, asked, _ = talking(pendant(), DEGREES, "skip", "")
    first = robot.read_pose()
    with pytest.raises(DeviceError):
        robot.move_to(GOAL)
    assert robot.read_pose() == first
    assert "Enter if it has not moved" in asked[-1]


def test_nobody_there() -> None:
    robot, _, _ = talking()
    with pytest.raises(DeviceError) as error:
        robot.read_pose()
    assert error.value.code == "no_answer"


def test_goals_are_shown_with_their_units() -> None:
    text = describe(GOAL, SHOWN, ARM.sliding)
    for line in text.splitlines()[1:]:
        assert any(unit in line for unit in ("deg", "mm", "p[")), line
    assert joints_of_numbers(ARM, [90.0] * 6) == pytest.approx([np.pi / 2] * 6)
