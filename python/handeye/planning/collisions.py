"""Whether an arm runs into itself, the floor or the end of its workspace: capsules along its links.

Links are the straight lines between the frames of neighbouring joints, with one radius for all. That is
coarse on purpose: it needs no meshes, and the radius can be chosen larger than any link.
"""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm
from handeye.types.arrays import BoolArray, FloatArray, finite_array

# Frames nearer to each other than this are one point.
TOUCHES_ITSELF = "the arm would touch itself"
_SHORTEST_LINK_M = 1e-3
# No joint moves farther between two postures at which a path is looked at.
_PATH_STEP_RAD = 0.05


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
        radii = self.link_radius_m, self.tool_radius_m
        if not np.isfinite([self.floor_m, *radii]).all():
            raise InputError(
                f"workspace: floor at {self.floor_m} m, radii of {radii[0]} and {radii[1]} m",
                code=Code.NOT_FINITE,
                hint="state the height of table or floor as a number",
            )
        if (lower >= upper).any() or min(radii) < 0:
            raise InputError(
                f"workspace: from {lower} to {upper}, expected a box with an inside, radii not negative",
                code=Code.OUT_OF_RANGE,
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
    solids
        The shapes of the links: links are then judged by these instead of capsules, on single paths only, as
        that takes longer.
    """

    arm: Arm
    workspace: Workspace
    tool_points_m: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    solids: SolidLinks | None = None

    def obstacles(self, joints: FloatArray) -> list[str | None]:
        """Say for each posture (N, n) what it runs into, None for nothing."""
        frames = self.arm.frames(joints)
        tools = (
            self.tool_points_m @ frames[:, -1, :3, :3].transpose(0, 2, 1) + frames[:, -1, np.newaxis, :3, 3]
        )
        space = self.workspace
        ends = np.concatenate([frames[:, -1:, :3, 3], tools], axis=1)
        outside = np.any((ends < space.lower_m) | (ends > space.upper_m), axis=(1, 2))
        # The base itself stands on the floor.
        low = np.any(frames[:, 3:, 2, 3] - space.link_radius_m < space.floor_m, axis=1)
        low |= np.any(tools[:, :, 2] - space.tool_radius_m < space.floor_m, axis=1)
        low_limit, high_limit = self.arm.limits.T
        beyond = np.any((joints < low_limit) | (joints > high_limit), axis=1)
        # The costliest question only of postures that nothing else speaks against.
        left = np.flatnonzero(~(beyond | outside | low))
        touching = np.zeros(len(joints), dtype=bool)
        touching[left] = self._touches_itself(np.concatenate([frames[left, :, :3, 3], tools[left]], axis=1))
        return first_reasons(
            (beyond, "a joint would be beyond its limits"),
            (outside, "flange or tool would leave the workspace"),
            (low, "the arm would touch the floor"),
            (touching, TOUCHES_ITSELF),
        )

    def obstacle_on_path(self, start: ArrayLike, end: ArrayLike) -> str | None:
        """Say what is in the way of the straight motion in joint space from posture to posture (n,)."""
        why = self.obstacles_on_paths(start, np.asarray(end, dtype=np.float64)[np.newaxis])[0]
        if why is None and self.solids is not None and self.solids.touch(straight_path(start, end)[1:]):
            return TOUCHES_ITSELF
        return why

    def obstacles_on_paths(self, start: ArrayLike, ends: FloatArray) -> list[str | None]:
        """Say for each posture (N, n) what is in the way of the straight motion there from a posture (n,)."""
        paths = [straight_path(start, end) for end in ends]
        if not paths:
            return []
        # The start is where the arm stands, allowed or not: only leaving it can be judged.
        why = self.obstacles(np.concatenate([path[1:] for path in paths]))
        bounds = np.cumsum([0, *(len(path) - 1 for path in paths)])
        return [
            next((reason for reason in why[a:b] if reason is not None), None)
            for a, b in pairwise(bounds.tolist())
        ]

    @cached_property
    def _links(self) -> list[tuple[int, int]]:
        """Pairs of frames that have a link between them, base first."""
        rest = self.arm.frames(np.zeros((1, len(self.arm))))[0, :, :3, 3]
        pairs: list[tuple[int, int]] = []
        start = 0
        for end in range(1, len(self.arm) + 2):
            if np.linalg.norm(rest[end] - rest[start]) > _SHORTEST_LINK_M:
                pairs.append((start, end))
                start = end
        return pairs

    @cached_property
    def _may_touch(self) -> list[tuple[tuple[int, int], tuple[int, int]]]:
        """Pairs of links that are not near each other by construction, with little between them."""
        rest = self.arm.frames(np.zeros((1, len(self.arm))))[0, :, :3, 3]
        links = self._links
        length = np.array([np.linalg.norm(rest[b] - rest[a]) for a, b in links])
        near = 2 * self.workspace.link_radius_m + 0.02
        return [
            (links[i], links[j])
            for i in range(len(links))
            for j in range(i + 2, len(links))
            if length[i + 1 : j].sum() >= near
        ]

    @cached_property
    def _capsules(self) -> tuple[list[tuple[int, int, int, int]], list[float]]:
        """Pairs of capsules that must not overlap, by their ends, and the sum of the radii of each.

        Ends are frames; the balls of what is mounted come behind these.
        """
        space, frames = self.workspace, len(self.arm) + 2
        pairs = [(*one, *other) for one, other in self._may_touch] if self.solids is None else []
        radii = [2 * space.link_radius_m] * len(pairs)
        balls = [
            (*link, frames + ball, frames + ball)
            for ball in range(len(self.tool_points_m))
            for link in self._links[:-3]
        ]
        return pairs + balls, radii + [space.link_radius_m + space.tool_radius_m] * len(balls)

    def _touches_itself(self, points: FloatArray) -> BoolArray:
        """(N,) whether capsules overlap where frames and what is mounted are at points (N, P, 3)."""
        return _core.least_gaps(points, *self._capsules) < 0


def first_reasons(*reasons: tuple[BoolArray, str]) -> list[str | None]:
    """Return for each of N the first reason whose mask (N,) holds there, None for none."""
    answers: NDArray[np.object_] = np.full(len(reasons[0][0]), None, dtype=object)
    for holds, reason in reversed(reasons):
        answers[holds] = reason
    return answers.tolist()


def straight_path(start: ArrayLike, end: ArrayLike) -> FloatArray:
    """(M, n) postures on the straight line in joint space, both ends among them, close to one another."""
    first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    count = max(2, int(np.ceil(np.abs(last - first).max() / _PATH_STEP_RAD)) + 1)
    return first + np.linspace(0, 1, count)[:, np.newaxis] * (last - first)
