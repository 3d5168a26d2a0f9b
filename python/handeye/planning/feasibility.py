"""Robot poses that could be taken next: around the target and around the arm's own postures, then sifted."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from handeye.estimation.estimate import Estimate
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.collisions import Body, Workspace
from handeye.planning.constraints import NOT_WHOLE, ViewConstraints, ViewLimits, mounted_points, sight_of
from handeye.planning.prediction import Sight
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.pose import inverses


@dataclass(frozen=True, eq=False)
class FeasiblePool:
    """Candidates with the joints that reach them, how many were turned down for which reason, and by what.

    `ruled_out` has the poses (M, 4, 4) of the flange that were turned down, `reasons` why, in the same order;
    those that the arm does not reach are only counted.
    """

    pool: Pool
    joints: Mapping[str, FloatArray]
    turned_down: Mapping[str, int]
    constraints: ViewConstraints
    ruled_out: FloatArray
    reasons: tuple[str, ...]

    @property
    def sight(self) -> Sight:
        """What every candidate shows of the target."""
        return self.constraints.sight


@dataclass(frozen=True, eq=False)
class Generator:
    """Draws candidates for an arm.

    Parameters
    ----------
    arm
        The arm.
    workspace
        Where it may be.
    limits
        What makes a view usable.
    around_target, around_postures
        Number of draws on a shell around the target, and in joint space around postures that showed it.
    spread_rad
        Standard deviation of the joints in the latter.
    solids
        The shapes of the links, where they are known.
    """

    arm: Arm
    workspace: Workspace
    limits: ViewLimits = field(default_factory=ViewLimits)
    around_target: int = 600
    around_postures: int = 300
    spread_rad: float = 0.25
    solids: SolidLinks | None = None

    def body(self, estimate: Estimate) -> Body:
        """Return the arm with camera or target mounted where the estimate has it."""
        return Body(self.arm, self.workspace, mounted_points(estimate), self.solids)

    def draw(
        self,
        estimate: Estimate,
        postures: Sequence[Sequence[float]],
        random: np.random.Generator,
        *,
        prefix: str = "candidate",
        shunned: Sequence[Sequence[float]] = (),
    ) -> FeasiblePool:
        """Draw candidates and keep those that the arm can take and that should show the target.

        Parameters
        ----------
        estimate
            What is believed now.
        postures
            Joint positions of views taken, the last one first where the arm starts from.
        random
            Source of chance.
        prefix
            Of the candidates' names.
        shunned
            Joint positions of attempts that failed: candidates near one are left out, nearer than half its
            distance to the closest view that worked.
        """
        taken = np.array(postures, dtype=np.float64)
        constraints = ViewConstraints(
            self.body(estimate),
            estimate,
            self.limits,
            sight_of(estimate, self.limits),
            taken,
            np.array(shunned, dtype=np.float64),
        )
        around_target, hidden = self._on_shell(constraints, random)
        joints = np.concatenate([around_target, self._in_joints(taken, random)])
        unreached = self.around_target + self.around_postures - len(hidden) - len(joints)
        passed, reason_of = constraints.passing(joints)
        ruled_out = np.concatenate([self.arm.forward(joints[list(reason_of)]), hidden])
        reasons = (*reason_of.values(), *[NOT_WHOLE] * len(hidden))
        joints = joints[passed]
        turned_down = Counter(reasons)
        turned_down["the arm does not reach the pose"] = unreached
        width = len(str(len(joints)))
        names = [f"{prefix}_{i:0{width}d}" for i in range(1, len(joints) + 1)]
        found = {name: count for name, count in turned_down.items() if count > 0}
        pool = candidates_at(self.arm, names, joints)
        by_name = dict(zip(names, joints, strict=True))
        return FeasiblePool(pool, by_name, found, constraints, ruled_out, reasons)

    def _on_shell(
        self, constraints: ViewConstraints, random: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """Joints (M, n) of camera poses that look at the target from all around, rolled.

        And poses (K, 4, 4) of the flange at which the target would not be whole in the image: whether the arm
        reaches these is not asked.
        """
        n, estimate, taken = self.around_target, constraints.estimate, constraints.taken
        (near, far), steepest = self.limits.distance_m, np.cos(self.limits.tilt_rad)
        distance = random.uniform(near, far, n)
        tilt = np.arccos(random.uniform(steepest, 1.0, n))
        azimuth, roll = random.uniform(-np.pi, np.pi, (2, n))
        off = random.uniform(-0.5, 0.5, (n, 2))
        camera = estimate.camera
        middle = estimate.target.points.mean(axis=0)
        looks = np.zeros((n, 4, 4))
        looks[:, 3, 3] = 1.0
        looks[:, :3, :3] = _turns(2, roll) @ _turns(2, azimuth) @ _turns(0, tilt) @ _turns(2, -azimuth)
        aim = np.column_stack([off * np.array(camera.size_px) / camera.parameters[:2], np.ones(n)])
        looks[:, :3, 3] = aim * distance[:, np.newaxis] - looks[:, :3, :3] @ middle
        chain = np.linalg.inv(estimate.X.matrix) @ looks @ np.linalg.inv(estimate.Y.matrix)
        flange = inverses(chain) if estimate.mounting is Mounting.EYE_IN_HAND else chain
        starts = taken[random.integers(len(taken), size=n)]
        seen = constraints.prediction.in_sight(chain)
        # One start each: of 359 poses that four starts reach, one reaches 341, in a quarter of the time.
        joints, reached = self.arm.inverse_all(flange[seen], starts[seen], attempts=1)
        return joints[np.flatnonzero(reached)], flange[~seen]

    def _in_joints(self, taken: FloatArray, random: np.random.Generator) -> FloatArray:
        starts = taken[random.integers(len(taken), size=self.around_postures)]
        joints = starts + self.spread_rad * random.standard_normal(starts.shape)
        low, high = self.arm.limits.T
        return joints[np.all((joints >= low) & (joints <= high), axis=1)]


def candidates_at(arm: Arm, names: Sequence[str], joints: FloatArray) -> Pool:
    """Return candidates of these names at postures (N, n)."""
    poses = arm.forward(joints) if len(joints) else np.zeros((0, 4, 4))
    return Pool(
        tuple(
            Candidate(name, pose, tuple(q))
            for name, pose, q in zip(names, Pose.of_matrices(poses), joints.tolist(), strict=True)
        )
    )


def _turns(axis: int, angles: FloatArray) -> FloatArray:
    """(N, 3, 3) rotations about a coordinate axis."""
    c, s = np.cos(angles), np.sin(angles)
    turns = np.zeros((len(angles), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turns[:, axis, axis] = 1.0
    turns[:, i, i], turns[:, i, j], turns[:, j, i], turns[:, j, j] = c, -s, s, c
    return turns
