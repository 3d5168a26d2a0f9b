"""What makes a posture usable as a view: distance, tilt, sight, and room for the arm there and on the way."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.estimate import Estimate
from handeye.estimation.lens_confidence import lens_deviation_px
from handeye.planning.collisions import Body, first_reasons
from handeye.planning.prediction import Prediction, Sight
from handeye.robots import Arm
from handeye.types import Mounting, Pose, Target
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.pose import inverses

# A lens that is known this well needs no room of its own.
KNOWN_LENS_PX = 3.0
NOT_WHOLE = "the target would not be whole in the image"
NEAR_FAILURE = "near to where it failed before"


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
        if not 0 < near < far < float("inf") or not (
            0 < self.tilt_rad < np.pi / 2 and 0 <= self.margin_px < float("inf")
        ):
            raise InputError(
                f"views from {near} to {far} m, tilted up to {np.rad2deg(self.tilt_rad):.0f} deg, margin "
                f"{self.margin_px} px: expected ranges with an inside",
                code=Code.OUT_OF_RANGE,
            )


@dataclass(frozen=True, eq=False)
class ViewConstraints:
    """Everything that a posture must pass, by what is believed now.

    Parameters
    ----------
    body
        The arm with what is mounted on it.
    estimate
        What is believed.
    limits
        What makes a view usable.
    sight
        What of the target must be seen, with the margin that the estimate's own uncertainty asks for.
    taken
        (K, n) postures that showed the target, at least one.
    shunned
        (F, n) postures where it failed: what is nearer to one than half its distance to the closest of
        `taken` is left out.
    """

    body: Body
    estimate: Estimate
    limits: ViewLimits
    sight: Sight
    taken: FloatArray
    shunned: FloatArray

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.body.arm

    @cached_property
    def prediction(self) -> Prediction:
        """What the estimate predicts of views."""
        return Prediction(self.estimate, self.sight)

    def passing(
        self, joints: FloatArray, motions: FloatArray | None = None, *, body: bool = True
    ) -> tuple[IndexArray, dict[int, str]]:
        """Return which of postures (N, n) pass, in their order, and for which first reason others do not.

        `motions` (N, 4, 4) are those of `motions` at the postures, if they are known. Without `body` it is
        left to the caller whether the arm can stand there.
        """
        at = self.motions(joints) if motions is None else motions
        left = np.arange(len(joints))
        turned_down: dict[int, str] = {}
        # Each is asked only of what the ones before it let through; the costly ones come last.
        questions: list[Callable[[IndexArray], list[str | None]]] = [
            lambda left: self._bad_views(at[left]),
            lambda left: self._hidden(at[left]),
            lambda left: self.body.obstacles(joints[left]),
            lambda left: self._failed_before(joints[left]),
        ]
        if not body:
            del questions[2]
        for reasons in questions:
            why = reasons(left)
            turned_down |= {
                int(index): reason for index, reason in zip(left, why, strict=True) if reason is not None
            }
            left = left[[reason is None for reason in why]]
        return left, turned_down

    def motions(self, joints: FloatArray) -> FloatArray:
        """(N, 4, 4) A of the chain at postures (N, n)."""
        poses = self.arm.forward(joints).reshape(-1, 4, 4)
        return poses if self.estimate.mounting is Mounting.EYE_TO_HAND else inverses(poses)

    def _bad_views(self, motions: FloatArray) -> list[str | None]:
        far, oblique = out_of_limits(self.estimate, motions, self.limits)
        return first_reasons(
            (far, "too near to the target or too far from it"),
            (oblique, "the target would be seen too obliquely"),
        )

    def _hidden(self, motions: FloatArray) -> list[str | None]:
        return first_reasons((~self.prediction.in_sight(motions), NOT_WHOLE))

    def _failed_before(self, joints: FloatArray) -> list[str | None]:
        if len(self.shunned) == 0:
            return [None] * len(joints)
        to_failed = _distances(joints, self.shunned)
        radius = 0.5 * _distances(self.shunned, self.taken).min(axis=1)
        return first_reasons(((to_failed < radius).any(axis=1), NEAR_FAILURE))


def out_of_limits(
    estimate: Estimate, motions: FloatArray, limits: ViewLimits
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell for motions (N, 4, 4) where a target is too near or too far (N,), and where seen obliquely."""
    poses = estimate.X.matrix @ motions @ estimate.Y.matrix
    middle = poses[:, :3, :3] @ estimate.target.points.mean(axis=0) + poses[:, :3, 3]
    distance = np.linalg.norm(middle, axis=1)
    cosine = np.einsum("ki,ki->k", poses[:, :3, 2], middle) / np.maximum(distance, 1e-9)
    near, far = limits.distance_m
    return ~((near <= distance) & (distance <= far)), cosine < np.cos(limits.tilt_rad)


def sight_of(estimate: Estimate, limits: ViewLimits) -> Sight:
    """Return what a view must show: the margin grows with what the estimate does not know."""
    return Sight(limits.margin_px + _doubt_px(estimate, limits), limits.fewest)


def mounted_points(estimate: Estimate) -> FloatArray:
    """(P, 3) points in the flange of what is mounted there: the camera's centre, or the target's corners."""
    if estimate.mounting is Mounting.EYE_IN_HAND:
        return estimate.X.inverse().matrix[np.newaxis, :3, 3]
    return corners_at(estimate.target, estimate.Y)


def corners_at(target: Target, Y: Pose) -> FloatArray:
    """(4, 3) the corners of the box around a target, whose pose is Y."""
    low, high = target.points.min(axis=0), target.points.max(axis=0)
    corners = np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])
    return Y.act(corners)


def _doubt_px(estimate: Estimate, limits: ViewLimits) -> float:
    """Twice the deviation in px by which the estimate may misplace the target, up to a fifth of the image.

    And by how much a lens may that is still being learnt.
    """
    covariance = estimate.covariance[:12, :12]
    shift = np.sqrt(np.trace(covariance[:3, :3]) + np.trace(covariance[6:9, 6:9]))
    turn = np.sqrt(np.trace(covariance[3:6, 3:6]))
    focal = float(estimate.camera.parameters[:2].max())
    deviation = focal * (shift / float(np.mean(limits.distance_m)) + turn)
    lens = 2 * lens_deviation_px(estimate)
    doubt = 2 * deviation + (lens if lens > KNOWN_LENS_PX else 0.0)
    return float(min(doubt, 0.2 * min(estimate.camera.size_px)))


def _distances(joints: FloatArray, others: FloatArray) -> FloatArray:
    """(N, M) largest joint difference between postures (N, n) and (M, n)."""
    return np.abs(joints[:, np.newaxis] - others[np.newaxis]).max(axis=2)
