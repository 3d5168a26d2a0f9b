"""Whether an arm runs into itself, the floor or the end of its workspace: capsules along its links.

Links are the straight lines between the frames of neighbouring joints, with one radius for all. That is
coarse on purpose: it needs no meshes, and the radius can be chosen larger than any link.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from handeye import _core
from handeye.errors import InputError
from handeye.robots import Arm
from handeye.types.arrays import FloatArray, finite_array

# Frames nearer to each other than this are one point.
_SHORTEST_LINK_M = 1e-3


@dataclass(frozen=True, eq=False)
class Workspace:
    """Where the arm may be, in the frame of its base.

    Parameters
    ----------
    lower_m, upper_m
        (3,) corners of the box that flange and tool must not leave.
    floor_m
        Height of the table or floor: no link goes below it.
    link_radius_m
        Radius of the capsules around the links.
    tool_radius_m
        Radius of a ball around what is mounted on the flange.

    Raises
    ------
    InputError
        A box without inside, or a radius below zero.
    """

    lower_m: FloatArray
    upper_m: FloatArray
    floor_m: float = 0.0
    link_radius_m: float = 0.05
    tool_radius_m: float = 0.04

    def __post_init__(self) -> None:
        lower = finite_array(self.lower_m, (3,), "workspace: lower_m")
        upper = finite_array(self.upper_m, (3,), "workspace: upper_m")
        if (lower >= upper).any() or min(self.link_radius_m, self.tool_radius_m) < 0:
            raise InputError(
                f"workspace: from {lower} to {upper}, expected a box with an inside, radii not negative",
                code="out_of_range",
            )
        object.__setattr__(self, "lower_m", lower)
        object.__setattr__(self, "upper_m", upper)

    def contains(self, points_m: ArrayLike) -> bool:
        """Tell whether points (..., 3) are all in the box."""
        points = np.asarray(points_m, dtype=np.float64)
        return bool(np.all((points >= self.lower_m) & (points <= self.upper_m)))


@dataclass(frozen=True, eq=False)
class Body:
    """An arm with what is mounted on its flange.

    Parameters
    ----------
    arm
        The arm.
    workspace
        Where it may be.
    tool_points_m
        (P, 3) points of the mounted things, in the flange.
    """

    arm: Arm
    workspace: Workspace
    tool_points_m: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))

    def obstacles(self, joints: FloatArray) -> list[str | None]:
        """Say for each posture (N, n) what it runs into, None for nothing."""
        frames = frames_of(self.arm, joints)
        tools = (
            self.tool_points_m @ frames[:, -1, :3, :3].transpose(0, 2, 1) + frames[:, -1, np.newaxis, :3, 3]
        )
        space = self.workspace
        ends = np.concatenate([frames[:, -1:, :3, 3], tools], axis=1)
        outside = np.any((ends < space.lower_m) | (ends > space.upper_m), axis=(1, 2))
        # The base itself stands on the floor.
        low = np.any(frames[:, 3:, 2, 3] - space.link_radius_m < space.floor_m, axis=1)
        low |= np.any(tools[:, :, 2] - space.tool_radius_m < space.floor_m, axis=1)
        touching = self._touches_itself(frames, tools)
        low_limit, high_limit = self.arm.limits.T
        beyond = np.any((joints < low_limit) | (joints > high_limit), axis=1)
        answers: list[str | None] = []
        for k in range(len(joints)):
            if beyond[k]:
                answers.append("a joint would be beyond its limits")
            elif outside[k]:
                answers.append("flange or tool would leave the workspace")
            elif low[k]:
                answers.append("the arm would touch the floor")
            elif touching[k]:
                answers.append("the arm would touch itself")
            else:
                answers.append(None)
        return answers

    def obstacle_on_path(self, start: ArrayLike, end: ArrayLike, *, step_rad: float = 0.05) -> str | None:
        """Say what is in the way of the straight motion in joint space from posture to posture (n,)."""
        first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        count = max(2, int(np.ceil(np.abs(last - first).max() / step_rad)) + 1)
        path = first + np.linspace(0, 1, count)[:, np.newaxis] * (last - first)
        # The start is where the arm stands, allowed or not: only leaving it can be judged.
        return next((why for why in self.obstacles(path[1:]) if why is not None), None)

    def _touches_itself(self, frames: FloatArray, tools: FloatArray) -> FloatArray:
        links = _links(self.arm)
        touching = np.zeros(len(frames), dtype=bool)
        radius = self.workspace.link_radius_m
        length = np.array([np.inf if b <= a else _rest_length(self.arm, a, b) for a, b in links])
        for i in range(len(links)):
            for j in range(i + 2, len(links)):
                # Links with little between them are near each other by construction.
                if length[i + 1 : j].sum() < 2 * radius + 0.02:
                    continue
                (a, b), (c, d) = links[i], links[j]
                gap = _segment_distance(
                    frames[:, a, :3, 3], frames[:, b, :3, 3], frames[:, c, :3, 3], frames[:, d, :3, 3]
                )
                touching |= gap < 2 * radius
        for a, b in links[: max(len(links) - 3, 0)]:
            for t in range(tools.shape[1]):
                gap = _segment_distance(frames[:, a, :3, 3], frames[:, b, :3, 3], tools[:, t], tools[:, t])
                touching |= gap < radius + self.workspace.tool_radius_m
        return touching


def frames_of(arm: Arm, joints: ArrayLike) -> FloatArray:
    """(N, n + 2, 4, 4) poses in the base at joints (N, n): the base itself, each joint, the flange."""
    values = finite_array(joints, (None, len(arm)), "joints")
    frames = np.empty((len(values), len(arm) + 2, 4, 4))
    frames[:, 0] = np.eye(4)
    for i, joint in enumerate(arm.joints):
        twists = np.zeros((len(values), 6))
        twists[:, (0 if joint.sliding else 3) : (3 if joint.sliding else 6)] = (
            values[:, i : i + 1] * joint.axis
        )
        frames[:, i + 1] = frames[:, i] @ joint.placement.matrix @ _core.se3_exp(twists)
    frames[:, -1] = frames[:, -2] @ arm.T_last_flange.matrix
    return frames


def _links(arm: Arm) -> list[tuple[int, int]]:
    """Return pairs of frames that have a link between them, base first."""
    pairs: list[tuple[int, int]] = []
    start = 0
    for end in range(1, len(arm) + 2):
        if _rest_length(arm, start, end) > _SHORTEST_LINK_M:
            pairs.append((start, end))
            start = end
    return pairs


def _rest_length(arm: Arm, start: int, end: int) -> float:
    frames = frames_of(arm, np.zeros((1, len(arm))))[0]
    return float(np.linalg.norm(frames[end, :3, 3] - frames[start, :3, 3]))


def _segment_distance(p0: FloatArray, p1: FloatArray, q0: FloatArray, q1: FloatArray) -> FloatArray:
    """(N,) distance between segments p0 p1 and q0 q1, each (N, 3) (Ericson 2005, section 5.1.9)."""
    d1, d2, r = p1 - p0, q1 - q0, p0 - q0
    a, e = np.einsum("ni,ni->n", d1, d1), np.einsum("ni,ni->n", d2, d2)
    b, c, f = (np.einsum("ni,ni->n", x, y) for x, y in ((d1, d2), (d1, r), (d2, r)))
    tiny = 1e-12
    determinant = a * e - b * b
    s = np.clip(np.where(determinant > tiny, (b * f - c * e) / np.maximum(determinant, tiny), 0.0), 0, 1)
    t = np.where(e > tiny, (b * s + f) / np.maximum(e, tiny), 0.0)
    clamped = np.clip(t, 0, 1)
    s = np.where(a > tiny, np.clip((b * clamped - c) / np.maximum(a, tiny), 0, 1), 0.0)
    return np.linalg.norm((p0 + s[:, np.newaxis] * d1) - (q0 + clamped[:, np.newaxis] * d2), axis=1)
