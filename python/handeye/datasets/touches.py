"""Touched points on disk: a file that a person writes.

::

    sigma_mm = 0.1              # how well a tip meets a point, per axis
    notation = "ur"             # how poses are written; without it poses are T_base_flange, four rows
    unit = "mm"

    [[tip]]
    name = "tool"
    on = "flange"               # or "base": a fixed point in the cell
    at_mm = [0.0, 0.0, 150.0]   # where it is believed to be; leave both out if it is not known
    sigma_mm = 0.5              # and how well; 0 for exact

    [[touch]]
    tip = "tool"
    point = 0                   # number of the point of the board, or the name of another tip
    pose = "412.3, -105.2, 88.1, 0.0, 3.1416, 0.0"
    joints_deg = [10.0, -95.0, 110.0, -105.0, -90.0, 0.0]

Unknown fields are errors.
"""

import math
from pathlib import Path

from handeye.codes import Code
from handeye.datasets.reading import located, read_text
from handeye.datasets.toml_reading import parse_toml
from handeye.errors import InputError
from handeye.notations import Unit, notation_of
from handeye.notations.text import read_pose_text
from handeye.types.plain import Document, read_document
from handeye.types.pose import Pose
from handeye.types.probing import Probing, Tip, Touch
from handeye.types.rig import Body
from handeye.types.units import MM_PER_M

MAX_BYTES = 1024 * 1024
MAX_TOUCHES = 1000


class _TipDocument(Document):
    name: str
    on: Body = Body.FLANGE
    at_mm: tuple[float, float, float] | None = None
    sigma_mm: float | None = None


class _TouchDocument(Document):
    tip: str
    point: int | str
    pose: str | None = None
    T_base_flange: list[list[float]] | None = None
    joints_deg: list[float] | None = None
    joints_rad: list[float] | None = None


class _TouchesDocument(Document):
    sigma_mm: float
    tip: list[_TipDocument]
    touch: list[_TouchDocument]
    notation: str | None = None
    unit: Unit | None = None


def read_touches(file: Path) -> Probing:
    """Read touched points.

    Raises
    ------
    InputError
        A file that is missing or not what it should be; the message names file, touch and field.
    """
    values = parse_toml(read_text(file, MAX_BYTES), file)
    with located(str(file)):
        document = read_document(values, _TouchesDocument, "touches")
        if len(document.touch) > MAX_TOUCHES:
            raise InputError(f"{len(document.touch)} touches, at most {MAX_TOUCHES}", code=Code.TOO_LARGE)
        tips: dict[str, Tip] = {}
        for tip in document.tip:
            if tip.name in tips:
                raise InputError(f"two tips named {tip.name[:80]!r}", code=Code.DUPLICATE_VALUE)
            tips[tip.name] = _tip(tip)
        touches = tuple(_touch(touch, number, document) for number, touch in enumerate(document.touch, 1))
        return Probing(tips, touches, document.sigma_mm / MM_PER_M)


def _tip(tip: _TipDocument) -> Tip:
    if tip.at_mm is None and tip.sigma_mm is None:
        return Tip(tip.on)
    if tip.at_mm is None or tip.sigma_mm is None:
        raise InputError(
            f"tip {tip.name[:80]}: at_mm and sigma_mm go together",
            code=Code.INVALID_FIELD,
            hint="say where it is believed to be and how well (0 for exact), or leave both out",
        )
    x, y, z = (value / MM_PER_M for value in tip.at_mm)
    return Tip(tip.on, (x, y, z), tip.sigma_mm / MM_PER_M)


def _touch(touch: _TouchDocument, number: int, document: _TouchesDocument) -> Touch:
    if (touch.pose is None) == (touch.T_base_flange is None):
        raise InputError(f"touch {number}: pose or T_base_flange, one is needed", code=Code.INVALID_FIELD)
    if touch.joints_deg is not None and touch.joints_rad is not None:
        raise InputError(f"touch {number}: joints_deg and joints_rad, one is enough", code=Code.INVALID_FIELD)
    with located(f"touch {number}"):
        if touch.T_base_flange is not None:
            pose = Pose(touch.T_base_flange)
        elif document.notation is None:
            raise InputError(
                "a pose as text, and the file states no notation",
                code=Code.NOTATION_UNSTATED,
                hint='add a line such as notation = "ur" at the top',
            )
        else:
            pose = read_pose_text(touch.pose or "", notation_of(document.notation), document.unit)
        joints = touch.joints_rad
        if touch.joints_deg is not None:
            joints = [math.radians(value) for value in touch.joints_deg]
        return Touch(touch.tip, touch.point, pose, None if joints is None else tuple(joints))
