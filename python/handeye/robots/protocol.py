"""What a robot must be able to do, however it is driven: go somewhere, say where it is, stop."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types import Pose


@dataclass(frozen=True)
class Goal:
    """Where to go.

    Parameters
    ----------
    label
        Name of the attempt, such as `view_04.2`: the second attempt at the fourth view.
    T_base_flange
        Pose to reach.
    joints_rad
        Joint positions that reach it (radians; metres for sliding joints); None where the robot has to find
        them itself. A driver that can should move in joint space to these.
    speed_rad_s
        No joint may turn faster.

    Raises
    ------
    InputError
        A speed that is not above zero.
    """

    label: str
    T_base_flange: Pose
    joints_rad: tuple[float, ...] | None = None
    speed_rad_s: float = 0.5

    def __post_init__(self) -> None:
        if not 0 < self.speed_rad_s < float("inf"):
            raise InputError(f"speed {self.speed_rad_s} rad/s, expected above zero", code=Code.OUT_OF_RANGE)


@dataclass(frozen=True)
class Reading:
    """Where the robot says it is: pose of the flange in the base, and joint positions if it knows them."""

    T_base_flange: Pose
    joints_rad: tuple[float, ...] | None = None


@runtime_checkable
class Robot(Protocol):
    """A robot as a driver presents it.

    Every method raises `handeye.errors.DeviceError` where it fails; `code="motion_refused"` says that the
    robot is well but will not go there. A driver may be asked from another thread than the one that made it,
    never from two at once, except for `stop`. A method `close`, where there is one, is called once, at the
    end of a session and after `stop`; nothing is asked of the driver then. An attribute `joint_limits`, where
    there is one, holds the lowest and highest position of each joint (radians, metres) that the robot takes:
    nothing is planned beyond them, nor beyond those of the description.
    """

    def move_to(self, goal: Goal) -> None:
        """Go there and return once the arm has come to rest."""
        ...

    def read_pose(self) -> Reading:
        """Say where the arm stands now; asked only at rest."""
        ...

    def stop(self) -> None:
        """Stop at once, from any thread, and also if nothing moves."""
        ...
