"""Robot poses that could be taken next: around the target and around the arm's own postures, then sifted."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from handeye.errors import InputError
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.collisions import Body, Workspace
from handeye.planning.visibility import obstacles
from handeye.robots import Arm
from handeye.solving.estimate import Estimate, Sight
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray


@dataclass(frozen=True)
class ViewLimits:
    """What makes a view of the target usable.

    Parameters
    ----------
    distance_m
        Nearest and farthest distance of the camera from the middle of the target.
    tilt_rad
        Largest angle between the line of sight and the normal of the target.
    margin_px
        Distance of every point from the border of the image, besides what the estimate may be off.
    fewest
        Fewest points in sight; None for all.

    Raises
    ------
    InputError
        A range without inside.
    """

    distance_m: tuple[float, float] = (0.25, 0.9)
    tilt_rad: float = float(np.deg2rad(45.0))
    margin_px: float = 20.0
    fewest: int | None = None

    def __post_init__(self) -> None:
        near, far = self.distance_m
        if not 0 < near < far < float("inf") or not 0 < self.tilt_rad < np.pi / 2 or self.margin_px < 0:
            raise InputError(
                f"views from {near} to {far} m, tilted up to {np.rad2deg(self.tilt_rad):.0f} deg, margin "
                f"{self.margin_px} px: expected ranges with an inside",
                code="out_of_range",
            )


@dataclass(frozen=True, eq=False)
class FeasiblePool:
    """Candidates with the joints that reach them, and how many were turned down for which reason."""

    pool: Pool
    joints: Mapping[str, FloatArray]
    turned_down: Mapping[str, int]
    sight: Sight


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
    """

    arm: Arm
    workspace: Workspace
    limits: ViewLimits = field(default_factory=ViewLimits)
    around_target: int = 600
    around_postures: int = 300
    spread_rad: float = 0.25

    def body(self, estimate: Estimate) -> Body:
        """Return the arm with camera or target mounted where the estimate has it."""
        return Body(self.arm, self.workspace, mounted_points(estimate))

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
        joints = np.concatenate([self._on_shell(estimate, taken, random), self._in_joints(taken, random)])
        turned_down: Counter[str] = Counter()
        turned_down["the arm does not reach the pose"] = (
            self.around_target + self.around_postures - len(joints)
        )
        sight = Sight(self.limits.margin_px + _doubt_px(estimate, self.limits), self.limits.fewest)
        for reasons in (self._bad_views, self._hidden, self._blocked, self._failed_before):
            why = reasons(estimate, joints, sight, taken, np.array(shunned, dtype=np.float64))
            turned_down.update(reason for reason in why if reason is not None)
            joints = joints[[reason is None for reason in why]]
        width = len(str(len(joints)))
        names = [f"{prefix}_{i:0{width}d}" for i in range(1, len(joints) + 1)]
        poses = self.arm.forward(joints) if len(joints) else np.zeros((0, 4, 4))
        pool = Pool(
            tuple(
                Candidate(name, Pose(pose), tuple(q.tolist()))
                for name, pose, q in zip(names, poses, joints, strict=True)
            )
        )
        found = {name: count for name, count in turned_down.items() if count > 0}
        return FeasiblePool(pool, dict(zip(names, joints, strict=True)), found, sight)

    def _on_shell(self, estimate: Estimate, taken: FloatArray, random: np.random.Generator) -> FloatArray:
        """Joints (M, n) of camera poses that look at the target from all around, rolled."""
        n = self.around_target
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
        flange = np.linalg.inv(chain) if estimate.mounting is Mounting.EYE_IN_HAND else chain
        starts = taken[random.integers(len(taken), size=n)]
        joints, reached = self.arm.inverse_all(flange, starts, attempts=4)
        return joints[np.flatnonzero(reached)]

    def _in_joints(self, taken: FloatArray, random: np.random.Generator) -> FloatArray:
        starts = taken[random.integers(len(taken), size=self.around_postures)]
        joints = starts + self.spread_rad * random.standard_normal(starts.shape)
        low, high = self.arm.limits.T
        return joints[np.all((joints >= low) & (joints <= high), axis=1)]

    def _bad_views(
        self, estimate: Estimate, joints: FloatArray, sight: Sight, taken: FloatArray, shunned: FloatArray
    ) -> list[str | None]:
        del sight, taken, shunned
        poses = estimate.X.matrix @ self._motions(estimate, joints) @ estimate.Y.matrix
        middle = poses[:, :3, :3] @ estimate.target.points.mean(axis=0) + poses[:, :3, 3]
        distance = np.linalg.norm(middle, axis=1)
        cosine = np.einsum("ki,ki->k", poses[:, :3, 2], middle) / np.maximum(distance, 1e-9)
        near, far = self.limits.distance_m
        answers: list[str | None] = []
        for length, toward in zip(distance, cosine, strict=True):
            if not near <= length <= far:
                answers.append("too near to the target or too far from it")
            elif toward < np.cos(self.limits.tilt_rad):
                answers.append("the target would be seen too obliquely")
            else:
                answers.append(None)
        return answers

    def _hidden(
        self, estimate: Estimate, joints: FloatArray, sight: Sight, taken: FloatArray, shunned: FloatArray
    ) -> list[str | None]:
        del taken, shunned
        why = obstacles(estimate, self._motions(estimate, joints), sight)
        return [None if reason is None else "the target would not be whole in the image" for reason in why]

    def _blocked(
        self, estimate: Estimate, joints: FloatArray, sight: Sight, taken: FloatArray, shunned: FloatArray
    ) -> list[str | None]:
        del sight, taken, shunned
        return self.body(estimate).obstacles(joints)

    def _failed_before(
        self, estimate: Estimate, joints: FloatArray, sight: Sight, taken: FloatArray, shunned: FloatArray
    ) -> list[str | None]:
        del estimate, sight
        if len(shunned) == 0:
            return [None] * len(joints)
        to_failed = _distances(joints, shunned)
        radius = 0.5 * _distances(shunned, taken).min(axis=1)
        return [
            "near to where it failed before" if near else None for near in (to_failed < radius).any(axis=1)
        ]

    def _motions(self, estimate: Estimate, joints: FloatArray) -> FloatArray:
        poses = self.arm.forward(joints).reshape(-1, 4, 4)
        if estimate.mounting is Mounting.EYE_TO_HAND:
            return poses
        return np.asarray(np.linalg.inv(poses), dtype=np.float64)


def mounted_points(estimate: Estimate) -> FloatArray:
    """(P, 3) points in the flange of what is mounted there: the camera's centre, or the target's corners."""
    if estimate.mounting is Mounting.EYE_IN_HAND:
        return estimate.X.inverse().matrix[np.newaxis, :3, 3]
    points = estimate.target.points
    low, high = points.min(axis=0), points.max(axis=0)
    corners = np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])
    return estimate.Y.act(corners)


def _doubt_px(estimate: Estimate, limits: ViewLimits) -> float:
    """Twice the deviation in px by which the estimate may misplace the target, up to a fifth of the image."""
    covariance = estimate.covariance[:12, :12]
    shift = np.sqrt(np.trace(covariance[:3, :3]) + np.trace(covariance[6:9, 6:9]))
    turn = np.sqrt(np.trace(covariance[3:6, 3:6]))
    focal = float(estimate.camera.parameters[:2].max())
    deviation = focal * (shift / float(np.mean(limits.distance_m)) + turn)
    return float(min(2 * deviation, 0.2 * min(estimate.camera.size_px)))


def _distances(joints: FloatArray, others: FloatArray) -> FloatArray:
    """(N, M) largest joint difference between postures (N, n) and (M, n)."""
    return np.abs(joints[:, np.newaxis] - others[np.newaxis]).max(axis=2)


def _turns(axis: int, angles: FloatArray) -> FloatArray:
    """(N, 3, 3) rotations about a coordinate axis."""
    c, s = np.cos(angles), np.sin(angles)
    turns = np.zeros((len(angles), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turns[:, axis, axis] = 1.0
    turns[:, i, i], turns[:, i, j], turns[:, j, i], turns[:, j, j] = c, -s, s, c
    return turns
