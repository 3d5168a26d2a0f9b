"""Opening what a session needs: the arm as described, its robot, the cell of open drivers, its place."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm, open_arm, shipped_arms
from handeye.robots.protocol import Goal, Robot
from handeye.robots.shapes import read_shapes
from handeye.session.attempt import Cell, Eye
from handeye.session.calls import Calls
from handeye.session.closing import close
from handeye.session.drivers import Person, limited, open_robot
from handeye.session.safety import body_of
from handeye.session.settings import Collisions, Configuration
from handeye.session.starting import Start


def _nobody(question: str) -> str:
    raise EOFError(question)


# Who is asked where there is no person.
NOBODY = Person(_nobody, lambda _: None)


def described(configuration: Configuration) -> tuple[Arm, SolidLinks | None, Configuration]:
    """Return the arm, the shapes of its links where they are known, and what is then judged by.

    Raises
    ------
    InputError
        No arm is named, or its description cannot be read.
    """
    if configuration.robot is None:
        raise InputError(
            "no arm is named",
            code=Code.MISSING_VALUE,
            hint=f"name it with --robot: {', '.join(shipped_arms())}, or its URDF or MJCF file",
        )
    arm = open_arm(configuration.robot)
    solids = _solids(configuration, arm)
    by = Collisions.CAPSULES if solids is None else Collisions.MESHES
    return arm, solids, replace(configuration, collisions=by)


def _solids(configuration: Configuration, arm: Arm) -> SolidLinks | None:
    """Return the shapes of the links as far as they are wanted and known.

    Raises
    ------
    InputError
        They are asked for and cannot be had.
    """
    wanted = Collisions(configuration.collisions)
    if configuration.robot is None or wanted is Collisions.CAPSULES:
        return None
    try:
        if configuration.robot in shipped_arms():
            raise InputError(
                f"{configuration.robot}: the shipped description has no shapes", code=Code.NO_SHAPES
            )
        return SolidLinks(arm, read_shapes(configuration.robot, arm))
    except InputError:
        if wanted is Collisions.MESHES:
            raise
        return None


def opened_robot(
    configuration: Configuration,
    arm: Arm,
    person: Person,
    calls: Calls,
    start: Start | None,
    failed: ExitStack,
) -> tuple[Arm, Robot]:
    """Open the robot, which `failed` closes again, and return the arm as it may be moved, and the robot.

    Raises
    ------
    InputError
        No such driver.
    DeviceError
        The driver fails.
    """
    told = None if start is None else start.posture_known
    robot = open_robot(configuration.driver, person, arm, joints_told=told)
    failed.callback(close, calls, robot)
    return limited(arm, robot, calls, configuration.timeouts.read_s), robot


def real_cell(
    configuration: Configuration,
    arm: Arm,
    solids: SolidLinks | None,
    robot: Robot,
    eye: Eye,
    confirm: Callable[[Goal], bool] | None,
) -> Cell:
    """Return the cell of drivers that are open, with one camera and target.

    Raises
    ------
    InputError
        No workspace is stated.
    """
    return Cell(
        robot,
        eye.source,
        arm,
        configuration.workspace(),
        eye.camera,
        eye.target,
        configuration.timeouts,
        confirm,
        solids,
        configuration.speed_rad_s,
        by_hand=configuration.by_hand,
    )


def standing(cell: Cell, arm: Arm) -> Start:
    """Return where the arm stands, if that is a place from which it may go.

    Raises
    ------
    DeviceError
        The robot does not say, or what it says cannot be true.
    InputError
        It stands where no motion may go.
    SolveError
        Nobody tells the joints, and the description does not reach the pose.
    """
    reading = cell.read()
    if reading.joints_rad is None:
        joints = arm.inverse(reading.T_base_flange)
        return safe(Start(reading.T_base_flange, tuple(joints.tolist()), posture_known=False), cell)
    low, high = arm.limits.T
    # At a limit encoders may read a little beyond it.
    joints = np.clip(reading.joints_rad, low, high)
    return safe(Start(reading.T_base_flange, tuple(joints.tolist())), cell)


def safe(start: Start, cell: Cell) -> Start:
    """Return a start if it may be a goal too.

    Raises
    ------
    InputError
        It may not.
    """
    if cell.arm is None or cell.workspace is None:
        return start
    if start.posture_known:
        body = body_of(cell.arm, cell.workspace, cell.solids, None)
        why = body.obstacles(np.array(start.joints_rad)[np.newaxis])[0]
    else:
        inside = cell.workspace.contains(start.T_base_flange.translation)
        why = None if inside else "flange or tool would leave the workspace"
    if why is not None:
        raise InputError(
            f"the arm stands where it may not go: {why}",
            code=Code.UNSAFE_START,
            hint="drive it to a free place, or state a workspace and a floor that are true",
        )
    return start
