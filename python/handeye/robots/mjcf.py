"""Arms from MJCF: the kinematic part of a MuJoCo model, from the world to one body or site.

Read are bodies with `pos` and an orientation in any notation (`quat`, `axisangle`, `euler`, `xyaxes`,
`zaxis`), hinge and slide joints with axis, position and range, the compiler's `angle`, `eulerseq` and
`autolimits`, and defaults of joints by class. What makes bodies that do not stand in the file is refused.
The format: https://mujoco.readthedocs.io/en/stable/XMLreference.html
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots.model import Arm, Joint
from handeye.robots.xml_tree import Element, read_xml
from handeye.robots.xml_values import LARGEST_ANGLE_RAD, LARGEST_TURN_RAD, LONGEST_OFFSET_M, numbers_of
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose

_ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")
_DEFAULT = "main"
# Makes bodies that do not stand in the file.
# No arm has as many; the time that reading takes grows with the square of it.
MAX_JOINTS_IN_A_ROW = 100
_UNSUPPORTED = frozenset({"frame", "replicate", "attach", "composite", "flexcomp"})


@dataclass(frozen=True)
class _Compiler:
    """The settings that change the meaning of numbers."""

    degrees: bool = True
    sequence: str = "xyz"
    autolimits: bool = True

    def radians(self, value: float) -> float:
        return math.radians(value) if self.degrees else value


@dataclass(frozen=True, eq=False)
class _Place:
    """A body or site: the joints that move it, base first, and where it is in the frame of the last one."""

    name: str
    joints: tuple[Joint, ...]
    rest: Pose


@dataclass
class _Model:
    """What is gathered while the bodies are walked."""

    compiler: _Compiler
    defaults: Mapping[str, Mapping[str, str]]
    places: dict[str, _Place] = field(default_factory=dict[str, _Place])
    sites: dict[str, _Place] = field(default_factory=dict[str, _Place])


def parse_mjcf(content: bytes, *, tip: str | None = None) -> Arm:
    """Read an arm from an MJCF document.

    Parameters
    ----------
    content
        The document.
    tip
        Body or site at the end of the arm, whose base is always the world. By default the first body with
        most moving joints before it.

    Raises
    ------
    InputError
        No well-formed XML or unsafe, no MJCF, something that is not supported, a number that is none or in
        the wrong units, or no clear tip.
    """
    root = read_xml(content)
    if root.tag != "mujoco":
        raise InputError(
            f"line {root.line}: <{root.tag[:60]}>, expected <mujoco>",
            code=Code.NOT_MJCF,
            hint="give a MuJoCo model",
        )
    _refuse_includes(root)
    world = root.one("worldbody")
    if world is None:
        raise _unusable(root, "no <worldbody>")
    defaults: dict[str, Mapping[str, str]] = {}
    for element in root.all("default"):
        _gather_defaults(element, {}, defaults, outermost=True)
    model = _Model(_compiler(root), defaults)
    _walk(Element("body", {}, world.line, world.children), (), Pose.identity(), "", model)
    place = _tip(model, tip)
    if not place.joints:
        raise InputError("no joint that moves before the tip", code=Code.UNUSABLE_ARM)
    name = root.attributes.get("model", "arm")[:100] or "arm"
    return Arm(name, place.joints, place.rest, "world", place.name)


def _refuse_includes(root: Element) -> None:
    pending = [root]
    while pending:
        element = pending.pop()
        if element.tag == "include":
            raise _unusable(
                element, "<include> of another file", "save the model in one file, as MuJoCo's simulate can"
            )
        pending += element.children


def _compiler(root: Element) -> _Compiler:
    settings: dict[str, str] = {}
    for element in root.all("compiler"):
        settings |= element.attributes
    angle, sequence = settings.get("angle", "degree"), settings.get("eulerseq", "xyz")
    if angle not in {"degree", "radian"}:
        raise _unusable(root, f"compiler: angle {angle[:60]!r}, expected degree or radian")
    if len(sequence) != 3 or not set(sequence) <= set("xyzXYZ"):
        raise _unusable(root, f"compiler: eulerseq {sequence[:60]!r}, expected three of xyzXYZ")
    if settings.get("coordinate", "local") != "local":
        raise _unusable(root, "compiler: global coordinates", "MuJoCo itself no longer reads them")
    return _Compiler(angle == "degree", sequence, settings.get("autolimits", "true") != "false")


def _gather_defaults(
    element: Element, inherited: Mapping[str, str], found: dict[str, Mapping[str, str]], *, outermost: bool
) -> None:
    """Gather what joints of each class have by default; a class has what the one around it has."""
    name = element.attributes.get("class", _DEFAULT if outermost else "")
    if not name:
        raise _unusable(element, "<default> without a class")
    joint = element.one("joint")
    own = dict(inherited) | ({} if joint is None else joint.attributes)
    found[name] = own
    for child in element.all("default"):
        _gather_defaults(child, own, found, outermost=False)


def _walk(body: Element, joints: tuple[Joint, ...], pending: Pose, default: str, model: _Model) -> None:
    """Take in a body and what hangs on it; `pending` is its parent's place in the frame of the last joint."""
    for child in body.children:
        if child.tag in _UNSUPPORTED:
            raise _unusable(child, f"<{child.tag}> is not supported", "save the model as MuJoCo compiled it")
    name = body.attributes.get("name", "")
    where = f"body {name[:60]!r}" if name else "body without a name"
    default = body.attributes.get("childclass", default)
    rest = pending @ _placed(body, where, model.compiler)
    own = [child for child in body.children if child.tag in {"joint", "freejoint"}]
    if len(joints) + len(own) > MAX_JOINTS_IN_A_ROW:
        raise _unusable(body, f"{where}: more than {MAX_JOINTS_IN_A_ROW} joints one after the other")
    for element in own:
        joint, offset = _joint(element, where, default, model, f"{name or 'body'}_{len(joints) + 1}")
        joints = (
            *joints,
            Joint(joint.name, rest @ offset, joint.axis, joint.sliding, joint.lower, joint.upper),
        )
        # The body goes on from where it was: the joint's position only says where the axis is.
        rest = offset.inverse()
    if name:
        if name in model.places:
            raise _unusable(body, f"a second body {name[:60]!r}")
        model.places[name] = _Place(name, joints, rest)
    for site in body.all("site"):
        label = site.attributes.get("name", "")
        if label:
            model.sites[label] = _Place(
                label, joints, rest @ _placed(site, f"site {label[:60]!r}", model.compiler)
            )
    for child in body.all("body"):
        _walk(child, joints, rest, default, model)


def _joint(element: Element, where: str, default: str, model: _Model, unnamed: str) -> tuple[Joint, Pose]:
    """Return a joint, and where its axis is in its body."""
    if element.tag == "freejoint":
        raise _unusable(element, f"{where}: a free joint: an arm has none")
    label = element.attributes.get("class", default or _DEFAULT)
    if label not in model.defaults and label != _DEFAULT:
        raise _unusable(element, f"{where}: no default class {label[:60]!r}")
    attributes = {**model.defaults.get(label, {}), **element.attributes}
    merged = Element(element.tag, attributes, element.line)
    kind = attributes.get("type", "hinge")
    name = attributes.get("name", unnamed)[:200]
    where = f"joint {name[:60]!r}"
    if kind not in {"hinge", "slide"}:
        raise _unusable(element, f"{where}: type {kind[:60]!r}, expected hinge or slide")
    axis = numbers_of(merged, "axis", where, 3, (0.0, 0.0, 1.0))
    norm = math.hypot(*axis)
    if norm < 1e-6:
        raise _unusable(element, f"{where}: axis {axis} has no direction")
    position = numbers_of(merged, "pos", where, 3, (0.0, 0.0, 0.0))
    if numbers_of(merged, "ref", where, 1, (0.0,))[0] != 0:
        raise _unusable(element, f"{where}: a reference position other than zero is not supported")
    lower, upper = _range(merged, where, kind == "slide", model.compiler)
    unit = (axis[0] / norm, axis[1] / norm, axis[2] / norm)
    return Joint(name, Pose.identity(), unit, kind == "slide", lower, upper), Pose.exp([*position, 0, 0, 0])


def _range(element: Element, where: str, sliding: bool, compiler: _Compiler) -> tuple[float, float]:
    limited = element.attributes.get("limited", "auto")
    if limited not in {"auto", "true", "false"}:
        raise _unusable(element, f"{where}: limited {limited[:60]!r}")
    given = "range" in element.attributes
    if limited == "false" or (not given and limited == "auto"):
        return -np.inf, np.inf
    if limited == "auto" and not compiler.autolimits:
        raise _unusable(element, f"{where}: a range, but neither limited nor autolimits")
    lower, upper = numbers_of(element, "range", where, 2, (0.0, 0.0))
    if not sliding:
        lower, upper = compiler.radians(lower), compiler.radians(upper)
    largest = LONGEST_OFFSET_M if sliding else LARGEST_TURN_RAD
    if not lower < upper or max(-lower, upper) > largest:
        raise _unusable(
            element,
            f"{where}: range {lower:g} to {upper:g} is not in order, or in other units",
            'angles are degrees unless <compiler angle="radian"/> says otherwise',
        )
    return lower, upper


def _placed(element: Element, where: str, compiler: _Compiler) -> Pose:
    position = numbers_of(element, "pos", where, 3, (0.0, 0.0, 0.0))
    if max(map(abs, position)) > LONGEST_OFFSET_M:
        raise _unusable(element, f"{where}: pos {position}: more than {LONGEST_OFFSET_M:g} m")
    matrix = np.eye(4)
    matrix[:3, :3] = _rotation(element, where, compiler)
    matrix[:3, 3] = position
    return Pose(matrix)


def _rotation(element: Element, where: str, compiler: _Compiler) -> FloatArray:
    given = [name for name in _ORIENTATIONS if name in element.attributes]
    if len(given) > 1:
        raise _unusable(element, f"{where}: {' and '.join(given)} at once")
    if not given:
        return np.eye(3)
    name = given[0]
    if name == "quat":
        w, x, y, z = _unit(element, where, numbers_of(element, name, where, 4, ()))
        return Pose.from_quaternion((0, 0, 0), (x, y, z, w)).rotation
    if name == "axisangle":
        *axis, angle = numbers_of(element, name, where, 4, ())
        return _turn(_unit(element, where, axis) * _angle(element, where, angle, compiler))
    if name == "euler":
        rotation = np.eye(3)
        for letter, angle in zip(compiler.sequence, numbers_of(element, name, where, 3, ()), strict=True):
            about = np.eye(3)["xyz".index(letter.lower())] * _angle(element, where, angle, compiler)
            # Small letters turn with the frame, capitals about the axes that stay.
            rotation = rotation @ _turn(about) if letter.islower() else _turn(about) @ rotation
        return rotation
    if name == "xyaxes":
        values = numbers_of(element, name, where, 6, ())
        x = _unit(element, where, values[:3])
        y = np.array(values[3:])
        y = _unit(element, where, y - (x @ y) * x)
        return np.column_stack([x, y, np.cross(x, y)])
    z = _unit(element, where, numbers_of(element, name, where, 3, ()))
    # The smallest turn that brings z there.
    across = np.array([-z[1], z[0], 0.0])
    norm = float(np.linalg.norm(across))
    if norm < 1e-12:
        return np.eye(3) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return _turn(across / norm * math.atan2(norm, z[2]))


def _turn(vector: FloatArray) -> FloatArray:
    return Pose.exp([0, 0, 0, *vector]).rotation


def _angle(element: Element, where: str, value: float, compiler: _Compiler) -> float:
    angle = compiler.radians(value)
    if abs(angle) > LARGEST_ANGLE_RAD:
        raise _unusable(
            element, f"{where}: an angle of more than two turns", 'radians need <compiler angle="radian"/>'
        )
    return angle


def _unit(element: Element, where: str, values: "FloatArray | tuple[float, ...] | list[float]") -> FloatArray:
    vector = np.array(values, dtype=np.float64)
    norm = float(np.linalg.norm(vector))
    if norm < 1e-9:
        raise _unusable(element, f"{where}: an orientation without direction")
    return vector / norm


def _tip(model: _Model, wanted: str | None) -> _Place:
    if wanted is not None:
        place = model.places.get(wanted) or model.sites.get(wanted)
        if place is None:
            shown = ", ".join(list({**model.places, **model.sites})[:20])
            raise InputError(
                f"no body or site {wanted[:60]!r}", code=Code.UNKNOWN_LINK, hint=f"there are {shown}"
            )
        return place
    if not model.places:
        raise InputError("no body with a name", code=Code.UNUSABLE_ARM)
    most = max(len(place.joints) for place in model.places.values())
    last = [place for place in model.places.values() if len(place.joints) == most]
    chains = {tuple(joint.name for joint in place.joints) for place in last}
    if len(chains) > 1:
        raise InputError(
            f"the arm could end in any of {', '.join(place.name[:60] for place in last[:12])}",
            code=Code.AMBIGUOUS_ARM,
            hint="say which body or site is the flange whose pose the robot reports",
        )
    return last[0]


def _unusable(element: Element, what: str, hint: str | None = None) -> InputError:
    return InputError(f"line {element.line}: {what}", code=Code.UNUSABLE_MJCF, hint=hint)
