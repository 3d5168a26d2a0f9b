"""The numbers that were written, if poses were read in a notation, and what they mean in another.

Two triples of angles stand for one rotation, and whole turns are lost where degrees are taken for radians: a
pose may stand for several sets of numbers, and each for another pose in the notation that was meant. Which it
is of each view is told by the rotation angles between views, which are the camera's (Chen 1991).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from handeye import _core
from handeye.notations import NOTATIONS, Notation, Unit
from handeye.notations.forms import Euler, Rotation, RotationVector, Vector
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.pose import Pose

# Angles between views count up to so much: a bad view is as bad as any.
LARGEST_GAP_RAD = np.deg2rad(5.0)
# Of so many views each is compared with each; the others are compared with these.
MOST_COMPARED = 24
MOST_ROUNDS = 6
# Three numbers of up to half a turn in degrees are so many whole turns of radians, either way.
HALF_TURN_DEG = 180.0
TURNS = range(-44, 45)
RADIANS, DEGREES = NOTATIONS["ur"], NOTATIONS["rotation_vector_deg"]


class Numbers:
    """What was written, if poses were read in a notation; the numbers of the last poses are kept."""

    def __init__(self, given: Notation) -> None:
        self._given = given
        self._poses = b""
        self._rows: FloatArray = np.zeros((0, 6))

    def read_as(
        self,
        poses: FloatArray,
        *,
        meant: Notation,
        factors: tuple[float, ...] = (1.0, 1.0, 1.0),
        beyond: bool = False,
    ) -> FloatArray:
        """Return poses (K, 4, 4) of the same numbers in another notation, times factors.

        Of the two triples of angles of a rotation, `beyond` takes that whose second angle is larger; of its
        two vectors the longer.
        """
        if self._poses != poses.tobytes():
            self._rows = np.array([self._given.numbers(Pose(pose), Unit.M) for pose in poses])
            self._poses = poses.tobytes()
        rows = self._rows.copy()
        if beyond:
            rows[:, 3:6] = _other(rotation_of(self._given), rows[:, 3:6])
        rows[:, 3:6] *= factors
        return meant.matrices(rows, Unit.M)


def rotation_of(notation: Notation) -> Rotation | None:
    """Return how a notation writes rotations, None for matrices."""
    return notation.form.rotation if isinstance(notation.form, Vector) else None


def _other(rotation: Rotation | None, rows: FloatArray) -> FloatArray:
    """Return the other three numbers of the rotations that rows (K, 3) stand for."""
    if isinstance(rotation, Euler):
        half = 180.0 if rotation.degrees else np.pi
        first, second, third = rows.T
        proper = rotation.axes[0] == rotation.axes[2]
        second = -second if proper else half * np.where(second < 0, -1, 1) - second
        first, third = (angle - half * np.where(angle > 0, 1, -1) for angle in (first, third))
        return np.column_stack([first, second, third])
    if isinstance(rotation, RotationVector):
        turn = 360.0 if rotation.degrees else 2 * np.pi
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        return rows * (1 - turn / np.maximum(lengths, 1e-12))
    return rows


def in_degrees(meant: Notation, poses: FloatArray, seen: FloatArray) -> "Chosen":
    """Return what poses mean whose numbers, in degrees, were read as rotation vectors in radians.

    Whole turns are lost then; `seen` (K, K) tells which.
    """
    candidates = np.stack([_with_turns(poses, meant, n) for n in TURNS], axis=1)
    return choose(poses, candidates, partial(_with_turns, meant=meant, turns=0), seen)


def _with_turns(poses: FloatArray, meant: Notation, turns: int) -> FloatArray:
    vectors = _core.se3_log(poses)[:, 3:]
    lengths = np.maximum(np.linalg.norm(vectors, axis=1), 1e-12)
    vectors *= (1 + 2 * np.pi * turns / lengths)[:, np.newaxis]
    vectors[np.abs(vectors).max(axis=1) > HALF_TURN_DEG] = 0.0
    return meant.matrices(np.column_stack([poses[:, :3, 3], vectors]), Unit.M)


@dataclass(frozen=True, eq=False)
class Chosen:
    """What poses mean where each has several meanings: those that were chosen, and the first for others.

    Parameters
    ----------
    first
        What is meant by poses that had no say.
    meanings
        Pose (4, 4) by the bytes of the pose as read.
    """

    first: Callable[[FloatArray], FloatArray]
    meanings: dict[bytes, FloatArray]

    def __call__(self, poses: FloatArray) -> FloatArray:
        """Return what poses (K, 4, 4) mean."""
        meant = self.first(poses)
        for k, pose in enumerate(poses):
            meant[k] = self.meanings.get(pose.tobytes(), meant[k])
        return meant


def choose(
    poses: FloatArray, candidates: FloatArray, first: Callable[[FloatArray], FloatArray], seen: FloatArray
) -> Chosen:
    """Choose of the candidates (K, M, 4, 4) of each pose (K, 4, 4) that which agrees with the pictures.

    `seen` (K, K) are the angles between the views as the camera saw them, radians.
    """
    chosen = _consistent(candidates[..., :3, :3], seen)
    picked = candidates[np.arange(len(chosen)), chosen]
    return Chosen(first, {pose.tobytes(): meant for pose, meant in zip(poses, picked, strict=True)})


def angles_between(rotations: FloatArray, others: FloatArray) -> FloatArray:
    """(N, M) angles in radians between rotations (N, 3, 3) and others (M, 3, 3)."""
    traces = rotations.reshape(-1, 9) @ others.reshape(-1, 9).T
    return np.arccos(np.clip((traces - 1) / 2, -1, 1))


def _consistent(candidates: FloatArray, seen: FloatArray) -> IndexArray:
    """(K,) which of the candidates (K, M, 3, 3) of each view agree with each other."""
    count, kinds = candidates.shape[:2]
    compared = list(range(0, count, math.ceil(count / MOST_COMPARED)))
    few = len(compared)
    angles = angles_between(candidates, candidates[compared]).reshape(count, kinds, few, kinds)
    gaps = np.minimum(np.abs(angles - seen[:, np.newaxis, compared, np.newaxis]), LARGEST_GAP_RAD)
    # Each candidate of each compared view asks for the best of the others; of these choices the best goes on.
    among = gaps[compared]
    asked = among.argmin(axis=3)
    start = int(among.min(axis=3).sum(axis=2).argmin())
    chosen = asked[start // kinds, start % kinds]
    chosen[start // kinds] = start % kinds
    for _ in range(MOST_ROUNDS):
        better = among[:, :, np.arange(few), chosen].sum(axis=2).argmin(axis=1)
        if np.array_equal(better, chosen):
            break
        chosen = better
    return gaps[:, :, np.arange(few), chosen].sum(axis=2).argmin(axis=1)
