"""Which of the ways to read robot poses agrees with the pictures.

However camera and target are fixed, the robot's motion between two views and the target's motion seen by the
camera turn by one angle (the congruence of screws: Chen, CVPR 1991). That leaves few readings; for these X
and Y of the chain are solved in closed form, and what the chain then misses by tells them apart, units too.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.datasets import PoseRows, Reading
from handeye.errors import HandeyeError
from handeye.notations import Direction
from handeye.types import Mounting
from handeye.types.arrays import FloatArray

MIN_VIEWS = 3
CLOSED_FORM = "shah"
# An angle between two views may be off by so much, in the middle, before a reading is dropped unsolved; so
# many are solved at most.
ANGLE_SLACK_RAD = np.deg2rad(5.0)
MOST_SOLVED = 16
# An arm that is read right misses the pictures by no more, in the middle of the views.
FITS_RAD = np.deg2rad(2.0)
FITS_M = 0.03
# By so much worse must the next reading be that means something else: in units of what the best one misses
# by, floored at what no arm and camera are better than.
CLEARLY = 3.0
FLOOR_RAD = np.deg2rad(0.05)
FLOOR_M = 3e-4
# Views of which the robot or the target is wrong are few; so many take part in the second fit.
KEPT_SHARE = 0.7


@dataclass(frozen=True)
class Agreement:
    """How well one reading agrees with the pictures.

    Attributes
    ----------
    reading
        How the rows are read.
    mounting
        Where the camera then sits.
    angle_rad, distance_m
        What the chain misses the target's pose in the pictures by, in the middle of the views.
    angles_deg
        What the angles between the views miss by, in the middle.
    """

    reading: Reading
    mounting: Mounting
    angle_rad: float
    distance_m: float

    @property
    def fits(self) -> bool:
        """Whether an arm and a camera can be so far apart."""
        return self.angle_rad < FITS_RAD and self.distance_m < FITS_M

    @property
    def misfit(self) -> float:
        """One number to compare readings by: in units of the floors."""
        return float(np.hypot(max(self.angle_rad / FLOOR_RAD, 1.0), max(self.distance_m / FLOOR_M, 1.0)))

    def __str__(self) -> str:
        return f"{np.rad2deg(self.angle_rad):.2g} deg and {1e3 * self.distance_m:.3g} mm"


def compare(
    rows: PoseRows,
    readings: Sequence[Reading],
    camera_poses: FloatArray,
    mountings: Iterable[Mounting] = tuple(Mounting),
) -> list[Agreement]:
    """Return how well readings agree with the poses of the target in the pictures, the best first.

    Parameters
    ----------
    rows
        N rows of numbers.
    readings
        What they may mean.
    camera_poses
        (N, 4, 4) `T_camera_target` of each, metres.
    mountings
        Where the camera may sit.
    """
    if len(camera_poses) < MIN_VIEWS:
        return []
    seen = _turns(camera_poses[:, :3, :3])
    first: dict[object, tuple[float, Reading]] = {}
    for reading in readings:
        key = (reading.notation.form, reading.notation.leading)
        if key not in first:
            rotations = rows.matrices(reading)[:, :3, :3]
            off = float(np.median(np.abs(_turns(rotations) - seen))) if _are_rotations(rotations) else np.inf
            first[key] = (off, reading)
    promising = sorted((off for off, _ in first.values() if off < np.inf))[:MOST_SOLVED]
    limit = max(promising[-1], 0.0) if promising else -1.0
    results: list[Agreement] = []
    for reading in readings:
        off, _ = first[reading.notation.form, reading.notation.leading]
        if off > min(limit, ANGLE_SLACK_RAD) and off > _next_best(promising):
            continue
        poses = rows.matrices(reading)
        for mounting in mountings:
            missed = _missed(_chain(poses, mounting), camera_poses)
            if missed is not None:
                results.append(Agreement(reading, mounting, *missed))
    results.sort(key=lambda result: result.misfit)
    # Of equals the usual way comes first: the flange in the base.
    equals = [result for result in results if _same_chain(results[0], result)]
    usual = [r for r in equals if r.reading.direction is Direction.FLANGE_IN_BASE][:1]
    return [*usual, *(result for result in results if result not in usual)]


def distinct(best: Agreement, others: Sequence[Agreement]) -> list[Agreement]:
    """Return the others that mean something else than the best.

    The camera in the hand with poses one way round is the same chain as the camera beside the robot with
    poses the other way round: no picture can tell these two apart.
    """
    return [other for other in others if other is not best and not _same_chain(best, other)]


def _same_chain(one: Agreement, other: Agreement) -> bool:
    mine, theirs = one.reading, other.reading
    same = mine.notation.form == theirs.notation.form and mine.notation.leading == theirs.notation.leading
    return same and mine.unit is theirs.unit and _is_inverse(one) == _is_inverse(other)


def _is_inverse(result: Agreement) -> bool:
    """Tell whether the middle of the chain is what is written, not its inverse."""
    in_hand = result.mounting is Mounting.EYE_IN_HAND
    return in_hand == (result.reading.direction is Direction.BASE_IN_FLANGE)


def _next_best(offs: Sequence[float]) -> float:
    """Return the largest deviation that is solved anyway, so that there is a second to compare with."""
    return offs[min(3, len(offs) - 1)] if offs else -1.0


def _are_rotations(rotations: FloatArray) -> bool:
    if not np.isfinite(rotations).all():
        return False
    gram = rotations @ rotations.transpose(0, 2, 1) - np.eye(3)
    return bool(np.abs(gram).max() < 0.02 and np.linalg.det(rotations).min() > 0)


def _turns(rotations: FloatArray) -> FloatArray:
    """Return the angles (N (N - 1) / 2,) between all pairs of rotations (N, 3, 3)."""
    flat = rotations.reshape(len(rotations), 9)
    pairs = np.triu_indices(len(flat), 1)
    traces = (flat @ flat.T)[pairs]
    return np.arccos(np.clip((traces - 1) / 2, -1, 1))


def _chain(poses: FloatArray, mounting: Mounting) -> FloatArray:
    if mounting is Mounting.EYE_TO_HAND:
        return poses
    return np.asarray(np.linalg.inv(poses), dtype=np.float64)


def _missed(motions: FloatArray, camera_poses: FloatArray) -> tuple[float, float] | None:
    """Return angle (rad) and distance (m) that the chain misses the target by, in the middle of the views."""
    kept = np.arange(len(motions))
    errors = None
    for _ in range(2):
        try:
            x, y = _core.closed_form(CLOSED_FORM, _rigid(motions[kept]), camera_poses[kept])
        except HandeyeError:
            break
        errors = chain_errors(x @ motions @ y, camera_poses)
        order = np.argsort(np.hypot(errors[0] / FITS_RAD, errors[1] / FITS_M))
        kept = np.sort(order[: max(MIN_VIEWS, int(np.ceil(KEPT_SHARE * len(motions))))])
    return None if errors is None else (float(np.median(errors[0])), float(np.median(errors[1])))


def chain_misses(robot: FloatArray, mounting: Mounting, camera_poses: FloatArray) -> float:
    """Return by how much the chain of robot poses (N, 4, 4) misses the target; infinite for no chain."""
    missed = _missed(_chain(robot, mounting), camera_poses)
    if missed is None:
        return float("inf")
    return float(np.hypot(max(missed[0] / FLOOR_RAD, 1.0), max(missed[1] / FLOOR_M, 1.0)))


def chain_errors(predicted: FloatArray, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the angles (N,) in radians and distances (N,) in metres between transforms (N, 4, 4)."""
    traces = np.einsum("nij,nij->n", predicted[:, :3, :3], seen[:, :3, :3])
    distances = np.linalg.norm(predicted[:, :3, 3] - seen[:, :3, 3], axis=1)
    return np.arccos(np.clip((traces - 1) / 2, -1, 1)), np.asarray(distances, dtype=np.float64)


def _rigid(matrices: FloatArray) -> FloatArray:
    """Return the matrices with their rotations made exact, as rounding in a file leaves them."""
    left, _, right = np.linalg.svd(matrices[:, :3, :3])
    exact = matrices.copy()
    exact[:, :3, :3] = left @ right
    return exact
