"""Shapes of an arm's links as its URDF gives them for collisions: boxes, cylinders, balls and meshes."""

import math
import os
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from handeye.errors import InputError
from handeye.robots.model import Arm
from handeye.robots.urdf import Edge, edges_of, links_of, path_of, read_file, tree_of
from handeye.robots.xml_tree import Element, read_xml
from handeye.robots.xml_values import attribute_of, number_of, placed, triple, unusable
from handeye.types.pose import Pose

MAX_SHAPES = 1000
MESH_SUFFIXES = frozenset({".stl", ".obj", ".ply"})
_LARGEST_M = 50.0


@dataclass(frozen=True)
class Shape:
    """A shape that moves with a frame of the arm.

    Parameters
    ----------
    link
        Name of its link.
    frame
        0 for the base, i for the i-th joint that moves, counted from one.
    placement
        Where it is in that frame.
    kind
        `box`, `cylinder`, `sphere` or `mesh`.
    size
        Edges; radius and length along z; radius; or factors along the axes. Metres but for the last.
    file
        Of a mesh.
    """

    link: str
    frame: int
    placement: Pose
    kind: str
    size: tuple[float, ...]
    file: Path | None = None


def read_shapes(path: str | os.PathLike[str], arm: Arm) -> tuple[Shape, ...]:
    """Return the shapes of the links between base and flange of an arm, and of what is fixed to them.

    What hangs on further joints that move, such as the fingers of a gripper, is left out.

    Raises
    ------
    InputError
        No such description, or a shape that cannot be used.
    """
    file = Path(path)
    try:
        root = read_xml(read_file(file))
        links = links_of(root)
        edges = edges_of(root, links)
        found: list[Shape] = []
        for link, (frame, pose) in _frames(edges, arm).items():
            for element in links[link].all("collision"):
                found.append(_shape(element, link, frame, pose, file.parent))
                if len(found) > MAX_SHAPES:
                    raise unusable(element, f"more than {MAX_SHAPES} shapes")
    except InputError as error:
        raise InputError(f"{file}: {error.message}", code=error.code, hint=error.hint) from error
    return tuple(found)


def _frames(edges: list[Edge], arm: Arm) -> dict[str, tuple[int, Pose]]:
    """Return for each link that moves with the arm the frame that it moves with, and where it is there."""
    on_the_way = {edge.name for edge in path_of(tree_of(edges), arm.base, arm.flange)}
    below: dict[str, list[Edge]] = {}
    for edge in edges:
        below.setdefault(edge.parent, []).append(edge)
    frames: dict[str, tuple[int, Pose]] = {arm.base: (0, Pose.identity())}
    pending = [arm.base]
    while pending:
        link = pending.pop()
        frame, pose = frames[link]
        for edge in below.get(link, []):
            if edge.kind == "fixed":
                frames[edge.child] = frame, pose @ placed(edge.element, f"joint {edge.name!r}")
            elif edge.name in on_the_way:
                frames[edge.child] = arm.joint_names.index(edge.name) + 1, Pose.identity()
            else:
                continue
            pending.append(edge.child)
    return frames


def _shape(element: Element, link: str, frame: int, pose: Pose, folder: Path) -> Shape:
    where = f"link {link!r}: collision"
    geometry = element.one("geometry")
    if geometry is None or len(geometry.children) != 1:
        raise unusable(element, f"{where}: not exactly one shape in <geometry>")
    shape = geometry.children[0]
    placement = pose @ placed(element, where)
    if shape.tag == "box":
        return Shape(link, frame, placement, "box", _sized(shape, triple(shape, "size", where), where))
    if shape.tag in {"cylinder", "sphere"}:
        names = ("radius", "length") if shape.tag == "cylinder" else ("radius",)
        size = tuple(number_of(shape, name, where, 0.0) for name in names)
        return Shape(link, frame, placement, shape.tag, _sized(shape, size, where))
    if shape.tag == "mesh":
        scale = triple(shape, "scale", where) if "scale" in shape.attributes else (1.0, 1.0, 1.0)
        file = _mesh_file(shape, where, folder)
        return Shape(link, frame, placement, "mesh", _sized(shape, scale, where), file)
    raise unusable(shape, f"{where}: <{shape.tag[:60]}>, expected box, cylinder, sphere or mesh")


def _sized(element: Element, size: tuple[float, ...], where: str) -> tuple[float, ...]:
    if not all(0 < value <= _LARGEST_M and math.isfinite(value) for value in size):
        raise unusable(element, f"{where}: size {size}, expected metres above zero")
    return size


def _mesh_file(element: Element, where: str, folder: Path) -> Path:
    """Return the file of a mesh: beside the description, or below one of the folders above for package://."""
    name = attribute_of(element, "filename", where)
    parts = PurePosixPath(name.removeprefix("package://").removeprefix("file://"))
    if parts.suffix.lower() not in MESH_SUFFIXES:
        raise unusable(
            element, f"{where}: mesh {name[:100]!r}, expected one of {', '.join(sorted(MESH_SUFFIXES))}"
        )
    if ".." in parts.parts and name.startswith("package://"):
        raise unusable(element, f"{where}: mesh {name[:100]!r} leaves its package")
    tails = [parts]
    if name.startswith("package://"):
        tails.append(PurePosixPath(*parts.parts[1:]))
    root = folder.resolve()
    places = [root, *root.parents] if name.startswith("package://") else [root]
    for place in places:
        for tail in tails:
            if (place / tail).is_file():
                return place / tail
    raise unusable(element, f"{where}: mesh {name[:100]!r} is not there")
