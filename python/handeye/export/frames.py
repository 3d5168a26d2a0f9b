"""Names that the frames have in the robot's software, and where the camera's own link lies.

Names go into command lines, XML, YAML and program text, so only names that mean the same in all of them are
accepted: nothing here needs escaping, and nothing can be smuggled in.
"""

import re
from dataclasses import dataclass

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types import Mounting, Pose

MAX_NAME_LENGTH = 100
_PART = r"[A-Za-z0-9_][A-Za-z0-9_.-]*"
_NAME = re.compile(rf"(?=[A-Za-z_]){_PART}(/{_PART})*", re.ASCII)

# ROS REP 103: a body has x forward, y left, z up; an optical frame z forward, x right, y down.
REP_103_OPTICAL = Pose([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""`T_link_camera` where camera link and optical frame share their origin."""


def check_frame(name: str, what: str) -> str:
    """Return the name of a frame if every format can hold it as it is.

    Raises
    ------
    InputError
        Not 1 to 100 letters (a-z, A-Z), digits, `_`, `-`, `.` in parts joined by `/`, beginning with a letter
        or `_`.
    """
    if len(name) > MAX_NAME_LENGTH or not _NAME.fullmatch(name):
        raise InputError(
            f"{what}: {name[:60]!r}, expected 1 to {MAX_NAME_LENGTH} letters, digits, '_', '-' and '.', in "
            "parts joined by '/', beginning with a letter or '_'",
            code=Code.INVALID_NAME,
            hint="frames of tf2 have no leading slash",
        )
    return name


@dataclass(frozen=True)
class Frames:
    """What the frames are called.

    Parameters
    ----------
    parent
        The frame that the camera is fixed to: the flange of a camera in the hand, else the base.
    camera
        The camera's optical frame: x right, y down, z forward.
    robot
        The other end of the robot: the base of a camera in the hand, else the flange.
    target
        The calibration target.
    link
        The camera's body, where the camera's driver publishes its optical frame below it; None if the optical
        frame itself hangs on the parent.
    T_link_camera
        Pose of the optical frame in the link; None to take it for `REP_103_OPTICAL`. Used only with `link`.

    Raises
    ------
    InputError
        A name that some format cannot hold, or two frames of one name.

    Examples
    --------
    >>> Frames("tool0", robot="base_link").camera
    'camera_optical_frame'
    """

    parent: str
    camera: str = "camera_optical_frame"
    robot: str = "base"
    target: str = "calibration_target"
    link: str | None = None
    T_link_camera: Pose | None = None

    def __post_init__(self) -> None:
        names = {
            "parent frame": self.parent,
            "camera frame": self.camera,
            "robot frame": self.robot,
            "target frame": self.target,
        }
        if self.link is not None:
            names["camera link"] = self.link
        seen: dict[str, str] = {}
        for what, name in names.items():
            check_frame(name, what)
            if name in seen:
                raise InputError(
                    f"{what}: {name!r} is the name of the {seen[name]} already",
                    code=Code.INVALID_NAME,
                    hint="every frame has a name of its own",
                )
            seen[name] = what

    @classmethod
    def usual(cls, mounting: Mounting) -> "Frames":
        """Return the names of ROS-Industrial: `base` and `tool0` are the frames that a controller reports."""
        if mounting is Mounting.EYE_IN_HAND:
            return cls(parent="tool0", robot="base")
        return cls(parent="base", robot="tool0")
