"""Check the poses that sessions propose by other means than those that proposed them.

pip install python-fcl
.venv/bin/python tools/check_proposals.py --proposals 10000 --output out/proposals.json

Simulated cells are driven. At every step that is planned, the poses are looked at that would be proposed one
after the other if those before were given up: joint limits as they stand in the URDF file, collisions of the
posture and of the straight path in joint space with FCL, on frames that are computed here, and whether the
target is in the image by the true camera and the true poses of camera and target. With --rendered the
reached poses are counted whose picture shows the target to the detector.
"""

import argparse
import json
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import dataclass
from importlib import resources
from itertools import combinations
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from handeye.planning.collisions import Workspace
from handeye.planning.constraints import ViewLimits, mounted_points
from handeye.planning.feasibility import Generator
from handeye.session.configuration import Prepared, begin, prepare
from handeye.session.deciding import Step
from handeye.session.entry import Failure
from handeye.session.loop import End, Session
from handeye.session.settings import Configuration, Simulation
from handeye.session.store import SessionStore
from handeye.types import Mounting

try:
    import fcl
except ImportError:
    sys.exit("python-fcl is needed: pip install python-fcl")

# A pair of links that touches in so many of random postures does so by construction.
ALWAYS, POSTURES = 0.9, 400
STEP_RAD = 0.06
PATH_EVERY = 5
TOLERANCE_M = 1e-4


@dataclass
class Checker:
    """An arm as its file says, link by link, as capsules of FCL."""

    name: str
    space: Workspace

    def __post_init__(self) -> None:
        """Read the file with no help of ours."""
        root = ET.fromstring((resources.files("handeye.robots") / "arms" / f"{self.name}.urdf").read_text())
        by_parent = {joint.find("parent").get("link"): joint for joint in root.iter("joint")}
        children = {joint.find("child").get("link") for joint in root.iter("joint")}
        link = next(parent for parent in by_parent if parent not in children)
        self.chain: list[tuple[np.ndarray, np.ndarray | None]] = []
        limits: list[tuple[float, float]] = []
        while link in by_parent:
            joint = by_parent[link]
            origin = joint.find("origin")
            placed = np.eye(4)
            if origin is not None:
                placed[:3, 3] = [float(v) for v in (origin.get("xyz") or "0 0 0").split()]
                placed[:3, :3] = rpy(*(float(v) for v in (origin.get("rpy") or "0 0 0").split()))
            axis = None
            if joint.get("type") in {"revolute", "continuous"}:
                axis = np.array([float(v) for v in joint.find("axis").get("xyz").split()])
                limit = joint.find("limit")
                limits.append((float(limit.get("lower")), float(limit.get("upper"))))
            self.chain.append((placed, axis))
            link = joint.find("child").get("link")
        self.limits = np.array(limits)
        self.moving = [i for i, (_, axis) in enumerate(self.chain) if axis is not None]
        self._links = self._long_links()
        radius = self.space.link_radius_m - TOLERANCE_M
        shapes = [fcl.Capsule(radius, length) for _, _, length in self._links]
        self._objects = [fcl.CollisionObject(shape, fcl.Transform()) for shape in shapes]
        self._pairs = self._free_pairs()

    def frames(self, q: np.ndarray) -> np.ndarray:
        """Places (n + 2, 3) of base, joints and flange, and the flange's rotation, at joints (n,)."""
        pose, places, k = np.eye(4), [np.zeros(3)], 0
        for placed, axis in self.chain:
            pose = pose @ placed
            if axis is not None:
                turned = np.eye(4)
                turned[:3, :3] = about(axis, q[k])
                pose = pose @ turned
                places.append(pose[:3, 3])
                k += 1
        places.append(pose[:3, 3])
        self.flange = pose
        return np.array(places)

    def collision(self, q: np.ndarray, tools: np.ndarray) -> str | None:
        """Say what touches at joints (n,) with things (P, 3) on the flange."""
        places = self.frames(q)
        ends = tools @ self.flange[:3, :3].T + self.flange[:3, 3]
        mounted = np.vstack([self.flange[:3, 3], ends])
        if (mounted < self.space.lower_m - TOLERANCE_M).any() or (
            mounted > self.space.upper_m + TOLERANCE_M
        ).any():
            return "outside the workspace"
        # What stands on the floor does not run into it.
        if (places[3:, 2] - self.space.link_radius_m < self.space.floor_m - TOLERANCE_M).any() or (
            ends[:, 2] - self.space.tool_radius_m < self.space.floor_m - TOLERANCE_M
        ).any():
            return "in the floor"
        self._place(places)
        for i, j in self._pairs:
            if touch(self._objects[i], self._objects[j]):
                return f"links {i} and {j} touch"
        for end in ends:
            ball = fcl.CollisionObject(fcl.Sphere(self.space.tool_radius_m - TOLERANCE_M), fcl.Transform(end))
            for i in range(max(len(self._links) - 3, 0)):
                if touch(self._objects[i], ball):
                    return f"link {i} and the tool touch"
        return None

    def _long_links(self) -> list[tuple[int, int, float]]:
        places = self.frames(np.zeros(len(self.limits)))
        links, start = [], 0
        for end in range(1, len(places)):
            length = float(np.linalg.norm(places[end] - places[start]))
            if length > 1e-3:
                links.append((start, end, length))
                start = end
        return links

    def _place(self, places: np.ndarray) -> None:
        for shape, (start, end, _) in zip(self._objects, self._links, strict=True):
            middle, along = (places[start] + places[end]) / 2, places[end] - places[start]
            shape.setTransform(fcl.Transform(towards(along), middle))

    def _free_pairs(self) -> list[tuple[int, int]]:
        random = np.random.default_rng(0)
        pairs = [(i, j) for i, j in combinations(range(len(self._links)), 2) if j - i >= 2]
        touching: Counter[tuple[int, int]] = Counter()
        for q in random.uniform(*self.limits.T, (POSTURES, len(self.limits))):
            self._place(self.frames(q))
            touching.update((i, j) for i, j in pairs if touch(self._objects[i], self._objects[j]))
        return [pair for pair in pairs if touching[pair] < ALWAYS * POSTURES]


def touch(first: Any, second: Any) -> bool:  # noqa: ANN401 - fcl has no types
    """Tell whether two objects of FCL touch."""
    return fcl.collide(first, second, fcl.CollisionRequest(), fcl.CollisionResult()) > 0


def rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Rotation (3, 3) of fixed-axis angles, as URDF has them."""
    z, y, x = (
        about(np.array(a), v) for a, v in (([0, 0, 1.0], yaw), ([0, 1.0, 0], pitch), ([1.0, 0, 0], roll))
    )
    return z @ y @ x


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation (3, 3) about an axis."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def towards(along: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) whose z axis points along a vector."""
    z = along / np.linalg.norm(along)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def main() -> int:
    """Drive cells until enough proposals are checked; return 1 if any failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--proposals", type=int, default=10_000)
    parser.add_argument("--per-step", type=int, default=45, help="proposals looked at in each step")
    parser.add_argument("--first", type=int, default=0, help="number of the first cell")
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--rendered", action="store_true", help="render, and count detections instead")
    parser.add_argument("--output", type=Path, help="JSON file; an earlier one is added to")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    found: Counter[str] = Counter()
    number = options.first
    if options.output is not None and options.output.exists():
        earlier = json.loads(options.output.read_text())
        number = earlier.pop("next_cell")
        found.update(earlier)
    began = time.monotonic()
    goal = "reached" if options.rendered else "proposals"
    while found[goal] < options.proposals and time.monotonic() - began < options.seconds:
        drive(number, options, found)
        number += 1
        found["cells"] += 1
        if options.output is not None:
            options.output.write_text(json.dumps(found | {"next_cell": number}, indent=1))
    print(json.dumps(found, indent=1))
    bad = [name for name in found if name.startswith("bad: ")]
    return 1 if bad else 0


def drive(number: int, options: argparse.Namespace, found: Counter[str]) -> None:
    """Drive one cell, and look at what is proposed on the way."""
    configuration = Configuration(
        ("epson_c4l", "ur5e")[number % 2],
        mounting=Mounting.EYE_TO_HAND if number % 4 >= 2 else Mounting.EYE_IN_HAND,
        accuracy_mm=None,
        accuracy_deg=None,
        most_views=9,
        seed=5000 + number,
        simulation=Simulation(points_only=None if options.rendered else 0.1),
    )
    prepared = prepare(configuration)
    checker = Checker(configuration.robot, prepared.cell.workspace)
    with tempfile.TemporaryDirectory() as folder:
        session, store = begin(prepared, Path(folder) / "session")
        try:
            look(session, store, prepared, checker, options, found)
        finally:
            store.close()


def look(
    session: Session,
    store: SessionStore,
    prepared: Prepared,
    checker: Checker,
    options: argparse.Namespace,
    found: Counter[str],
) -> None:
    """Run a session; before every planned step, check what it might propose."""
    while not isinstance(step := session.next(), End):
        if step.phase == "plan" and not options.rendered:
            for joints in proposed(step, store, prepared, options.per_step):
                # The way there takes most of the time: every fifth is looked at.
                whole = found["proposals"] % PATH_EVERY == 0
                found["proposals"] += 1
                found["paths"] += whole
                for fault in faults(joints, step, store, prepared, checker, whole_path=whole):
                    found[fault] += 1
        session.take(step)
        last = store.entries[-1]
        if step.phase == "plan" and last.moved:
            found["reached"] += 1
            found["detected"] += last.failure is None
            if last.failure is Failure.NOT_FOUND:
                found["not found"] += 1


def standing(store: SessionStore) -> np.ndarray:
    """Return the joints where the arm stands."""
    return np.array(next(entry.goal_joints for entry in reversed(store.entries) if entry.moved))


def proposed(step: Step, store: SessionStore, prepared: Prepared, most: int) -> list[np.ndarray]:
    """Return what would be proposed one after the other: the loop's own candidates, best first."""
    estimate = step.estimate
    if estimate is None:
        return []
    # The draw of the loop, made again.
    random = np.random.default_rng([prepared.configuration.seed, 4, len(store.entries)])
    views = [entry.view for entry in store.entries if entry.view is not None]
    generator = Generator(prepared.arm, prepared.cell.workspace, prepared.configuration.limits)
    drawn = generator.draw(estimate, [view.joints_rad or () for view in reversed(views)], random)
    gains = step.decision["candidates"]
    body, start = generator.body(estimate), standing(store)
    # Where the loop climbed to something better than what was drawn, that comes first.
    chosen = [np.array(step.goal.joints_rad)] if "refined" in step.decision else []
    for name in sorted(gains, key=lambda name: -gains[name]):
        if name in drawn.joints and body.obstacle_on_path(start, drawn.joints[name]) is None:
            chosen.append(drawn.joints[name])
            if len(chosen) == most:
                break
    if chosen and not any(np.array_equal(joints, step.goal.joints_rad) for joints in chosen):
        raise RuntimeError("the draw differs from that of the loop")
    return chosen


def faults(
    joints: np.ndarray,
    step: Step,
    store: SessionStore,
    prepared: Prepared,
    checker: Checker,
    *,
    whole_path: bool,
) -> list[str]:
    """Say what is wrong with a proposal."""
    wrong: list[str] = []
    low, high = checker.limits.T
    if (joints < low).any() or (joints > high).any():
        wrong.append("bad: beyond a joint limit")
    assert step.estimate is not None
    tools = mounted_points(step.estimate)
    why = checker.collision(joints, tools)
    if why is not None:
        wrong.append(f"bad: posture in collision ({why})")
    elif whole_path:
        start = standing(store)
        count = max(2, int(np.ceil(np.abs(joints - start).max() / STEP_RAD)))
        path = start + np.linspace(0, 1, count + 1)[1:-1, np.newaxis] * (joints - start)
        why = next((why for q in path if (why := checker.collision(q, tools)) is not None), None)
        if why is not None:
            wrong.append(f"bad: path in collision ({why})")
    lost, near = out_of_sight(joints, prepared)
    if lost:
        wrong.append("bad: target not whole in the image")
    elif near:
        wrong.append("target nearer to the border than the margin")
    return wrong


def out_of_sight(joints: np.ndarray, prepared: Prepared) -> tuple[bool, bool]:
    """Tell whether the target is lost by the truth, and whether it is nearer to the border than stated."""
    truth, cell = prepared.truth, prepared.cell
    # The lens as it is known: it is off by about a pixel at most.
    camera = cell.camera
    mounting = prepared.configuration.mounting
    A = prepared.arm.forward(joints)
    A = np.linalg.inv(A) if mounting is Mounting.EYE_IN_HAND else A
    pose = truth.X.matrix @ A @ truth.Y.matrix
    points = cell.target.points @ pose[:3, :3].T + pose[:3, 3]
    pixels, seen = camera.project(points)
    size = np.array(camera.size_px)
    inside = seen & (pixels >= 0).all(axis=1) & (pixels <= size - 1).all(axis=1)
    margin = ViewLimits().margin_px
    clear = (pixels >= margin).all(axis=1) & (pixels <= size - 1 - margin).all(axis=1)
    return not inside.all(), not clear.all()


if __name__ == "__main__":
    sys.exit(main())
