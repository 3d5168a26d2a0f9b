"""Whether the links of an arm touch one another, by their shapes; needs the packages of the extra `meshes`.

The shapes are those that the description gives for collisions, a centimetre thicker all around. FCL (Pan,
Chitta and Manocha 2012) decides; meshes are read by trimesh.
"""

from collections.abc import Sequence
from importlib import import_module
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots import Arm
from handeye.robots.shapes import Shape
from handeye.types.arrays import FloatArray, finite_array

# Every shape is thicker by this all around: links keep twice as much distance.
PADDING_M = 0.01
# What touches by construction is left out: pairs that do in nearly all of random postures, and those that
# come so near to one another in more than a few of them, but never touch.
_ALWAYS, _OFTEN, _POSTURES = 0.9, 0.05, 300
_MAX_MESH_BYTES = 64 << 20


class SolidLinks:
    """The shapes of an arm's links, ready to be moved.

    Parameters
    ----------
    arm
        The arm.
    shapes
        Of its links.

    Raises
    ------
    InputError
        The extra `meshes` is not installed, no two links have shapes, or a mesh that cannot be read.
    """

    def __init__(self, arm: Arm, shapes: Sequence[Shape]) -> None:
        try:
            fcl: Any = import_module("fcl")
        except ImportError as error:
            raise InputError(
                "shapes of links need the extra meshes",
                code=Code.MISSING_PACKAGE,
                hint="pip install handeye[meshes]",
            ) from error
        self._fcl: Any = fcl
        self._arm = arm
        self._frames = [shape.frame for shape in shapes]
        self._placements = np.array([shape.placement.matrix for shape in shapes]).reshape(-1, 4, 4)
        self._objects = self._bodies(shapes, 0.0)
        frames = self._frames
        apart = [(i, j) for i, j in combinations(range(len(shapes)), 2) if abs(frames[i] - frames[j]) > 1]
        bare = self._shares(apart)
        self._objects = self._bodies(shapes, PADDING_M)
        thick = self._shares(apart)
        by_construction = (bare >= _ALWAYS) | ((bare == 0) & (thick > _OFTEN))
        self._pairs = [pair for pair, left_out in zip(apart, by_construction, strict=True) if not left_out]
        if not self._pairs:
            raise InputError("the description has no shapes of links that could touch", code=Code.NO_SHAPES)

    def touch(self, joints: ArrayLike) -> bool:
        """Tell whether links touch in any of postures (N, n)."""
        return any(
            any(self._touch(i, j) for i, j in self._pairs)
            for _ in self._moved(finite_array(joints, (None, None), "joints"))
        )

    def _moved(self, joints: FloatArray) -> Any:  # noqa: ANN401 - a generator of moments
        """Move all shapes to one posture after the other."""
        poses = self._arm.frames(joints)[:, self._frames] @ self._placements
        for posture in poses:
            for body, pose in zip(self._objects, posture, strict=True):
                body.setTransform(self._fcl.Transform(pose[:3, :3], pose[:3, 3]))
            yield

    def _touch(self, i: int, j: int) -> bool:
        request, result = self._fcl.CollisionRequest(), self._fcl.CollisionResult()
        return self._fcl.collide(self._objects[i], self._objects[j], request, result) > 0

    def _shares(self, pairs: list[tuple[int, int]]) -> FloatArray:
        """(P,) in which share of random postures pairs of shapes touch."""
        low, high = np.clip(self._arm.limits.T, -np.pi, np.pi)
        postures = np.random.default_rng(0).uniform(low, high, (_POSTURES, len(self._arm)))
        touching = np.zeros(len(pairs))
        for _ in self._moved(postures):
            touching += [self._touch(i, j) for i, j in pairs]
        return touching / _POSTURES

    def _bodies(self, shapes: Sequence[Shape], padding_m: float) -> list[Any]:
        fcl = self._fcl
        return [fcl.CollisionObject(_geometry(fcl, shape, padding_m), fcl.Transform()) for shape in shapes]


def _geometry(fcl: Any, shape: Shape, padding_m: float) -> Any:  # noqa: ANN401 - of FCL
    size = shape.size
    if shape.kind == "sphere":
        return fcl.Sphere(size[0] + padding_m)
    if shape.kind == "cylinder":
        return fcl.Cylinder(size[0] + padding_m, size[1] + 2 * padding_m)
    if shape.kind == "box":
        return fcl.Box(*(edge + 2 * padding_m for edge in size))
    vertices, faces = _mesh(shape, padding_m)
    model = fcl.BVHModel()
    model.beginModel(len(vertices), len(faces))
    model.addSubModel(vertices, faces)
    model.endModel()
    return model


def _mesh(shape: Shape, padding_m: float) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return vertices (V, 3) and faces (F, 3) of a mesh, every vertex moved outwards along its normal."""
    file = shape.file
    if file is None or file.stat().st_size > _MAX_MESH_BYTES:
        raise InputError(f"link {shape.link}: no mesh, or one of more than {_MAX_MESH_BYTES} bytes")
    try:
        trimesh: Any = import_module("trimesh")
        mesh = trimesh.load(file, force="mesh")
        vertices = finite_array(np.asarray(mesh.vertices) * shape.size, (None, 3), "vertices")
        faces = np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:
        raise InputError(f"{file}: no mesh: {error}", code=Code.UNUSABLE_MESH) from error
    if len(faces) == 0:
        raise InputError(f"{file}: a mesh without faces", code=Code.UNUSABLE_MESH)
    corners = vertices[faces]
    # As long as twice the area: larger faces weigh more in the normal of a vertex.
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], across)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return vertices + padding_m * normals, faces
