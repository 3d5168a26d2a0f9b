"""Drivers by name: those of this package, and those that other packages announce as entry points.

A package that drives a robot declares ``[project.entry-points."handeye.robots"]`` with ``name =
"module:factory"``; the factory takes the address as text and returns a `Robot`. Cameras are in the group
``handeye.cameras``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handeye.cameras.capture import Capture
from handeye.cameras.folder import WatchedFolder
from handeye.cameras.protocol import Grey, ImageSource
from handeye.cameras.replay import ReplayCamera
from handeye.codes import Code
from handeye.datasets.images import read_image
from handeye.errors import DeviceError, InputError
from handeye.extension import CAMERAS as CAMERA_GROUP
from handeye.extension import ROBOTS as ROBOT_GROUP
from handeye.extension import announced
from handeye.importing import Opened, open_folder
from handeye.notations import notation_of, unit_of
from handeye.robots import Arm
from handeye.robots.manual import ManualRobot
from handeye.robots.protocol import Robot
from handeye.robots.reading import limited_arm
from handeye.robots.replay import ReplayRobot
from handeye.session.calls import Calls, in_our_words
from handeye.types import View

REPLAY, MANUAL = "replay", "manual"
ROBOTS = ("simulated", MANUAL, REPLAY)
CAMERAS = ("simulated", "folder", "opencv", REPLAY)


@dataclass(frozen=True)
class Person:
    """How to talk to the person in front of it."""

    ask: Callable[[str], str]
    tell: Callable[[str], None]


def open_robot(
    spec: str, person: Person, arm: Arm | None = None, *, joints_told: bool | None = None
) -> Robot:
    """Return the robot of a specification: `manual:kuka`, `manual:ur/mm`, `replay:FOLDER` or `NAME:ADDRESS`.

    `arm` and `joints_told` are for a person who moves the arm, see `ManualRobot`.

    Raises
    ------
    InputError
        No such driver.
    DeviceError
        The driver cannot reach its robot.
    """
    name, _, address = spec.partition(":")
    if name == MANUAL:
        name, _, unit = address.partition("/")
        return ManualRobot(
            person.ask,
            person.tell,
            notation_of(name or "ur"),
            unit=unit_of(unit) if unit else None,
            arm=arm,
            joints_told=joints_told,
        )
    if name == REPLAY:
        return ReplayRobot(open_folder(address).recording.views)
    return _announced(ROBOT_GROUP, name, address, ROBOTS, Robot)


def limited(arm: Arm, robot: Robot, calls: Calls, patience_s: float) -> Arm:
    """Return the arm within the limits that its driver states too, once for whatever is planned or checked.

    Raises
    ------
    DeviceError
        They cannot be read, or cannot be those of the arm.
    """
    return limited_arm(arm, calls.run(patience_s, getattr, robot, "joint_limits", None))


def open_camera(spec: str, robot: Robot, person: Person, patience_s: float = 600.0) -> ImageSource:
    """Return the camera of a specification: `folder:PATH`, `opencv:0`, `replay:FOLDER` or `NAME:ADDRESS`.

    `patience_s` is how long a picture in a folder is waited for.

    Raises
    ------
    InputError
        No such driver, or a replay without a replayed robot.
    DeviceError
        The driver cannot reach its camera.
    """
    name, _, address = spec.partition(":")
    if name == "folder":
        # It gives up a little earlier than its caller, who does not know what was waited for.
        return WatchedFolder(Path(address), read_image, patience_s=0.95 * patience_s, announce=person.tell)
    if name == "opencv":
        return Capture(int(address) if address.isdecimal() else address)
    if name == REPLAY:
        if not isinstance(robot, ReplayRobot):
            raise InputError("a replayed camera needs a replayed robot", code=Code.UNKNOWN_DRIVER)
        return replayed_camera(open_folder(address), robot)
    return _announced(CAMERA_GROUP, name, address, CAMERAS, ImageSource)


def replayed_camera(opened: Opened, robot: ReplayRobot) -> ReplayCamera:
    """Return the camera of a recording: its points, and its pictures where they were kept."""

    def read(view: View) -> Grey | None:
        return None if view.image is None else read_image(opened.folder / view.image)

    return ReplayCamera(lambda: robot.view, read)


def _announced(group: str, name: str, address: str, own: tuple[str, ...], kind: type[Any]) -> Any:  # noqa: ANN401
    found = announced(group)
    if name not in found:
        raise InputError(
            f"no driver {name[:60]!r}, expected one of {', '.join([*own, *found])}",
            code=Code.UNKNOWN_DRIVER,
            hint=f"a package with a driver announces it in the entry point group {group}",
        )
    try:
        driver = found[name].load()(address)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        told = in_our_words(error)
        kind_of_error = InputError if isinstance(error, InputError) else DeviceError
        raise kind_of_error(f"driver {name}: {told.message}", code=told.code, hint=told.hint) from error
    if not isinstance(driver, kind):
        raise InputError(f"driver {name}: {type(driver).__name__} lacks a method of {kind.__name__}")
    return driver
