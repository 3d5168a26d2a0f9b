"""Arms from URDF: the kinematic part of a robot description, from its base to one tip.

Lengths are metres, angles radians, `rpy` are angles about the fixed axes x, y, z (http://wiki.ros.org/urdf/XML).
Meshes, masses and controllers are not looked at.
"""

import math
import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots.model import Arm, Joint
from handeye.robots.xml_tree import MAX_BYTES, Element, read_xml
from handeye.robots.xml_values import (
    LARGEST_TURN_RAD,
    LONGEST_OFFSET_M,
    attribute_of,
    number_of,
    placed,
    triple,
    unusable,
)
from handeye.types.pose import Pose

MAX_LINKS = 10_000
# Preferred where several links could be the tip: names that end an arm in ROS-Industrial and at its makers.
TIP_NAMES = ("tool0", "flange", "tcp", "ee_link", "tool", "link_ee")
_MOVING = frozenset({"revolute", "continuous", "prismatic"})
_KNOWN = _MOVING | {"fixed", "floating", "planar"}


@dataclass(frozen=True)
class Edge:
    """A joint of a description, moving or not."""

    element: Element
    name: str
    kind: str
    parent: str
    child: str


def read_urdf(path: str | os.PathLike[str], *, base: str | None = None, tip: str | None = None) -> Arm:
    """Read an arm from a URDF file; see `parse_urdf`.

    Parameters
    ----------
    path
        The file.
    base, tip
        As in `parse_urdf`.

    Raises
    ------
    InputError
        The file cannot be read or used; the message names it and the place in it.

    Examples
    --------
    >>> from importlib.resources import files
    >>> read_urdf(str(files("handeye.robots") / "arms" / "ur5e.urdf")).name
    'ur5e'
    """
    file, content = Path(path), read_file(path)
    try:
        return parse_urdf(content, base=base, tip=tip)
    except InputError as error:
        raise InputError(f"{file}: {error.message}", code=error.code, hint=error.hint) from error


def read_file(path: str | os.PathLike[str]) -> bytes:
    """Return the content of a description, no more of it than is ever parsed.

    Raises
    ------
    InputError
        No regular file, or one that cannot be read.
    """
    file = Path(path)
    try:
        if not stat.S_ISREG(file.stat().st_mode):
            raise InputError(f"{file}: not a regular file", code=Code.UNREADABLE)
        with file.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        code = Code.MISSING_FILE if isinstance(error, FileNotFoundError) else Code.UNREADABLE
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"{str(path)[:300]}: {reason or error}", code=code) from error
    return content


def parse_urdf(content: bytes, *, base: str | None = None, tip: str | None = None) -> Arm:
    """Read an arm from a URDF document.

    Parameters
    ----------
    content
        The document.
    base, tip
        Links at the ends of the arm. By default the root of the tree, and the link with most moving joints
        before it; where several have as many, the one whose name says that it is the flange.

    Raises
    ------
    InputError
        No well-formed XML or unsafe, no URDF, a link that is missing or has two parents, a circle, a number
        that is none or in the wrong units, a joint on the way that cannot be used, or no clear tip.

    Examples
    --------
    >>> ends = '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
    >>> joint = f'<joint name="j" type="continuous">{ends}</joint>'
    >>> document = f'<robot name="one"><link name="a"/><link name="b"/>{joint}</robot>'
    >>> parse_urdf(document.encode()).joint_names
    ('j',)
    """
    root = read_xml(content)
    if root.tag != "robot":
        raise InputError(
            f"line {root.line}: <{root.tag[:60]}>, expected <robot>",
            code=Code.NOT_URDF,
            hint="give a robot description in URDF",
        )
    # What xacro writes tells in comments how it was made.
    told = re.sub(rb"<!--.*?-->", b"", content, flags=re.DOTALL)
    if b"${" in told or any(child.tag.startswith("xacro:") for child in root.children):
        raise InputError(
            "a xacro template, not a URDF",
            code=Code.NOT_URDF,
            hint="expand it first: xacro robot.urdf.xacro > robot.urdf",
        )
    links = links_of(root)
    edges = edges_of(root, links)
    by_child = tree_of(edges)
    start = base if base is not None else _root(links, by_child)
    if start not in links:
        raise _no_link(start, links)
    end = tip if tip is not None else _tip(links, by_child, start)
    if end not in links:
        raise _no_link(end, links)
    path = path_of(by_child, start, end)
    return _arm(root.attributes.get("name", "arm")[:100] or "arm", path, start, end)


def links_of(root: Element) -> dict[str, Element]:
    """Return the links by name."""
    links: dict[str, Element] = {}
    for element in root.all("link"):
        name = attribute_of(element, "name", "link")
        if name in links:
            raise unusable(element, f"a second link {name!r}")
        links[name] = element
    if not links:
        raise unusable(root, "no <link>")
    if len(links) > MAX_LINKS:
        raise InputError(f"{len(links)} links, expected at most {MAX_LINKS}", code=Code.TOO_LARGE)
    return links


def edges_of(root: Element, links: dict[str, Element]) -> list[Edge]:
    """Return the joints."""
    edges: list[Edge] = []
    names: set[str] = set()
    for element in root.all("joint"):
        name = attribute_of(element, "name", "joint")
        if name in names:
            raise unusable(element, f"a second joint {name!r}")
        names.add(name)
        kind = attribute_of(element, "type", f"joint {name!r}")
        if kind not in _KNOWN:
            raise unusable(
                element, f"joint {name!r}: type {kind!r}, expected one of {', '.join(sorted(_KNOWN))}"
            )
        ends: list[str] = []
        for role in ("parent", "child"):
            end = element.one(role)
            link = None if end is None else end.attributes.get("link")
            if link is None:
                raise unusable(element, f"joint {name!r}: no <{role} link=...>")
            if link not in links:
                raise unusable(element, f"joint {name!r}: {role} link {link[:100]!r} is not in the file")
            ends.append(link)
        edges.append(Edge(element, name, kind, *ends))
    return edges


def tree_of(edges: list[Edge]) -> dict[str, Edge]:
    """Return the joint above each link that has one."""
    by_child: dict[str, Edge] = {}
    for edge in edges:
        if edge.child in by_child:
            raise unusable(
                edge.element,
                f"link {edge.child!r} hangs on two joints, {by_child[edge.child].name!r} and {edge.name!r}",
            )
        by_child[edge.child] = edge
    clear: set[str] = set()
    for link in by_child:
        walked: set[str] = set()
        at = link
        while at in by_child and at not in clear:
            if at in walked:
                raise unusable(by_child[at].element, f"the joints go round in a circle at link {at!r}")
            walked.add(at)
            at = by_child[at].parent
        clear |= walked
    return by_child


def _root(links: dict[str, Element], by_child: dict[str, Edge]) -> str:
    roots = [name for name in links if name not in by_child]
    # A link that nothing hangs on is no arm: loose links beside one are common in hand-written files.
    parents = {edge.parent for edge in by_child.values()}
    bearing = [name for name in roots if name in parents] or roots
    if len(bearing) > 1:
        raise InputError(
            f"several links have no parent: {_names(bearing)}",
            code=Code.AMBIGUOUS_ARM,
            hint="say which one is the base of the arm",
        )
    return bearing[0]


def _tip(links: dict[str, Element], by_child: dict[str, Edge], base: str) -> str:
    moving = _moving_before(links, by_child, base)
    most = max(moving.values())
    if most == 0:
        raise InputError(f"no joint that moves hangs on {base!r}", code=Code.UNUSABLE_ARM)
    last = [name for name, count in moving.items() if count == most]
    named = [name for wanted in TIP_NAMES for name in last if name == wanted or name.endswith(f"_{wanted}")]
    if named:
        return named[0]
    parents = {edge.parent for edge in by_child.values()}
    leaves = [name for name in last if name not in parents]
    if len(leaves) > 1:
        raise InputError(
            f"the arm could end in any of {_names(leaves)}",
            code=Code.AMBIGUOUS_ARM,
            hint="say which link is the flange whose pose the robot reports",
        )
    return leaves[0] if leaves else last[-1]


def _moving_before(links: dict[str, Element], by_child: dict[str, Edge], base: str) -> dict[str, int]:
    """Return the number of moving joints between the base and each link that hangs on it."""
    count: dict[str, int | None] = {base: 0}
    for link in links:
        path: list[Edge] = []
        at = link
        while at not in count and at in by_child:
            path.append(by_child[at])
            at = by_child[at].parent
        moving = count.setdefault(at, None)
        for edge in reversed(path):
            moving = None if moving is None else moving + (edge.kind in _MOVING)
            count[edge.child] = moving
    return {link: moving for link, moving in count.items() if moving is not None}


def _upwards(by_child: dict[str, Edge], base: str, tip: str) -> list[Edge] | None:
    """Return the joints from base to tip, None if the tip does not hang on the base."""
    path: list[Edge] = []
    at = tip
    while at != base:
        edge = by_child.get(at)
        if edge is None:
            return None
        path.append(edge)
        at = edge.parent
    return path[::-1]


def path_of(by_child: dict[str, Edge], base: str, tip: str) -> list[Edge]:
    """Return the joints from base to tip."""
    path = _upwards(by_child, base, tip)
    if path is None:
        raise InputError(
            f"link {tip!r} does not hang on link {base!r}",
            code=Code.AMBIGUOUS_ARM,
            hint="name a base above the tip",
        )
    return path


def _arm(name: str, path: list[Edge], base: str, tip: str) -> Arm:
    joints: list[Joint] = []
    pending = Pose.identity()
    for edge in path:
        pending = pending @ placed(edge.element, f"joint {edge.name!r}")
        if edge.kind == "fixed":
            continue
        if edge.kind not in _MOVING:
            raise unusable(edge.element, f"joint {edge.name!r} is {edge.kind}: an arm has none on its way")
        if edge.element.one("mimic") is not None:
            raise unusable(edge.element, f"joint {edge.name!r} mimics another one")
        joints.append(_joint(edge, pending))
        pending = Pose.identity()
    return Arm(name, tuple(joints), pending, base, tip)


def _joint(edge: Edge, placement: Pose) -> Joint:
    where = f"joint {edge.name!r}"
    axis = (1.0, 0.0, 0.0)
    element = edge.element.one("axis")
    if element is not None:
        axis = triple(element, "xyz", f"{where}: axis")
        if math.hypot(*axis) < 1e-6:
            raise unusable(element, f"{where}: axis {axis} has no direction")
    norm = math.hypot(*axis)
    unit = (axis[0] / norm, axis[1] / norm, axis[2] / norm)
    lower, upper, velocity = _limits(edge, where)
    return Joint(edge.name, placement, unit, edge.kind == "prismatic", lower, upper, velocity)


def _limits(edge: Edge, where: str) -> tuple[float, float, float]:
    element = edge.element.one("limit")
    if element is None:
        if edge.kind == "continuous":
            return -np.inf, np.inf, np.inf
        raise unusable(
            edge.element,
            f"{where}: {edge.kind} without <limit>",
            "a joint without limits is of type continuous",
        )
    # Zero is URDF's default for both limits, and stands for unknown where a speed is meant.
    lower, upper, velocity = (number_of(element, name, where, 0.0) for name in ("lower", "upper", "velocity"))
    if velocity < 0:
        raise unusable(element, f"{where}: a largest speed of {velocity:g}")
    if edge.kind == "continuous":
        return -np.inf, np.inf, velocity or np.inf
    if lower > upper:
        raise unusable(element, f"{where}: limits {lower:g} to {upper:g} are not in order")
    largest = LARGEST_TURN_RAD if edge.kind == "revolute" else LONGEST_OFFSET_M
    if max(-lower, upper) > largest:
        units = "angles are radians; convert degrees" if edge.kind == "revolute" else "lengths are metres"
        raise unusable(element, f"{where}: limits {lower:g} to {upper:g}", f"URDF {units}")
    return lower, upper, velocity or np.inf


def _no_link(name: str, links: dict[str, Element]) -> InputError:
    return InputError(
        f"no link {name[:100]!r}", code=Code.UNKNOWN_LINK, hint=f"the links are {_names(list(links))}"
    )


def _names(names: list[str]) -> str:
    shown = ", ".join(repr(name[:60]) for name in names[:12])
    return shown + (", ..." if len(names) > 12 else "")
