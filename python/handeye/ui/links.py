"""What an arm looks like: triangles of each link, in the frame that it moves with."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots import Arm, shipped_arms
from handeye.robots.shapes import Shape, read_shapes
from handeye.types.arrays import FloatArray

# Vertices of a mesh nearer to one another than this are drawn as one: a browser draws what is left.
MERGED_M = 0.012
_MOST_FACES = 3000
_MAX_MESH_BYTES = 64 << 20
_SIDES = 10


@dataclass(frozen=True, eq=False)
class Link:
    """Triangles: vertices (V, 3) in metres in frame number `frame` (0 the base), faces (F, 3)."""

    frame: int
    vertices: FloatArray
    faces: NDArray[np.int64]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: flat lists, to a tenth of a millimetre."""
        return {
            "frame": self.frame,
            "vertices": np.round(self.vertices, 4).ravel().tolist(),
            "faces": self.faces.ravel().tolist(),
        }


def links_of(arm: Arm, description: str | None) -> list[Link]:
    """Return the links of an arm: as its URDF shapes them, or rods from joint to joint.

    Parameters
    ----------
    description
        The file that describes it; None, a shipped arm or a file without shapes for rods.
    """
    if description is not None and description not in shipped_arms():
        try:
            links = [_link(shape) for shape in read_shapes(description, arm)]
        except (InputError, ImportError):
            links = []
        if links:
            return links
    return _rods(arm)


def _rods(arm: Arm) -> list[Link]:
    ends = [joint.placement.translation for joint in arm.joints] + [arm.T_last_flange.translation]
    thickest = 0.05 * arm.reach_m
    rods = [
        _rod(frame, end, thickest * (1.0 - 0.5 * frame / len(ends)))
        for frame, end in enumerate(ends)
        if np.linalg.norm(end) > 1e-3
    ]
    return rods or [_rod(0, np.array([0.0, 0.0, 0.1]), 0.05)]


def _rod(frame: int, end: FloatArray, radius: float) -> Link:
    """Return a rod with rounded ends from the origin of a frame to a point in it."""
    length = float(np.linalg.norm(end))
    along = end / length
    aside = np.cross(along, [1.0, 0.0, 0.0] if abs(along[0]) < 0.9 else [0.0, 1.0, 0.0])
    aside /= np.linalg.norm(aside)
    across = np.cross(along, aside)
    # Stations along the rod: how far, and how thick there.
    stations = [(-0.7, 0.6), (0.0, 1.0), (length / radius, 1.0), (length / radius + 0.7, 0.6)]
    angles = np.linspace(0, 2 * np.pi, _SIDES, endpoint=False)
    circle = np.outer(np.cos(angles), aside) + np.outer(np.sin(angles), across)
    rings = [radius * (far * along + thick * circle) for far, thick in stations]
    tips = radius * np.array([-along, (length / radius + 1.0) * along])
    vertices = np.concatenate([*rings, tips])
    faces: list[tuple[int, int, int]] = []
    for ring in range(len(stations) - 1):
        for side in range(_SIDES):
            a, b = ring * _SIDES + side, ring * _SIDES + (side + 1) % _SIDES
            faces += [(a, b, b + _SIDES), (a, b + _SIDES, a + _SIDES)]
    first, last, ring = len(vertices) - 2, len(vertices) - 1, (len(stations) - 1) * _SIDES
    for side in range(_SIDES):
        following = (side + 1) % _SIDES
        faces += [(first, following, side), (last, ring + side, ring + following)]
    return Link(frame, vertices, np.array(faces))


def _link(shape: Shape) -> Link:
    trimesh: Any = import_module("trimesh")
    if shape.kind == "box":
        mesh = trimesh.creation.box(shape.size)
    elif shape.kind == "cylinder":
        mesh = trimesh.creation.cylinder(shape.size[0], shape.size[1], sections=_SIDES * 2)
    elif shape.kind == "sphere":
        mesh = trimesh.creation.icosphere(2, shape.size[0])
    elif shape.file is None or shape.file.stat().st_size > _MAX_MESH_BYTES:
        raise InputError(f"link {shape.link}: no mesh, or one of more than {_MAX_MESH_BYTES} bytes")
    else:
        try:
            mesh = trimesh.load(shape.file, force="mesh")
        except Exception as error:
            raise InputError(f"{shape.file}: no mesh: {error}", code=Code.UNUSABLE_MESH) from error
    scale = shape.size if shape.kind == "mesh" else (1.0, 1.0, 1.0)
    vertices = np.asarray(mesh.vertices, dtype=np.float64) * scale
    faces = np.asarray(mesh.faces, dtype=np.int64)
    if not np.isfinite(vertices).all() or len(faces) == 0:
        raise InputError(f"link {shape.link}: a mesh without faces", code=Code.UNUSABLE_MESH)
    vertices, faces = coarser(vertices, faces, MERGED_M if shape.kind == "mesh" else 0.0)
    return Link(shape.frame, shape.placement.act(vertices), faces)


def coarser(
    vertices: FloatArray, faces: NDArray[np.int64], merged_m: float
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return a mesh whose vertices within cubes of an edge are one, coarser until few faces are left."""
    while merged_m > 0:
        cells = np.floor(vertices / merged_m).astype(np.int64)
        _, number = np.unique(cells, axis=0, return_inverse=True)
        number = number.ravel()
        count = int(number.max()) + 1
        middles = np.column_stack([np.bincount(number, vertices[:, i], count) for i in range(3)])
        middles /= np.bincount(number, minlength=count)[:, np.newaxis]
        merged = number[faces]
        a, b, c = merged.T
        merged = merged[(a != b) & (b != c) & (a != c)]
        if 0 < len(merged) <= _MOST_FACES:
            return middles, merged
        if len(merged) == 0:
            break
        merged_m *= 1.5
    return vertices, faces[:_MOST_FACES]
