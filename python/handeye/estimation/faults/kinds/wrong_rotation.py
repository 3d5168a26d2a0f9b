"""Rotations that were written in one way and read in another."""

import itertools
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from handeye.estimation.faults.kinds.base import Handling, Hypothesis, Kind, of_poses
from handeye.estimation.measurements import Measurements
from handeye.notations import EULER, MAKERS, NOTATIONS, Notation, Unit
from handeye.notations.forms import Euler, Rotation, Vector
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose

KIND = Kind(
    "wrong_rotation",
    "rotations read in another convention than they were written in",
    "Angles about other axes or in another order, moving for fixed axes, a rotation vector for angles, "
    "another order of the quaternion, signs turned round, a matrix by columns, axes of a left-handed system.",
    "The same numbers, read in another of the notations in the table, make all views agree.",
    Handling.REFUSED,
    "State the notation: `--notation`; docs/conventions.md has the table.",
    "writes the poses read in the convention that agrees",
)
HINT = "state how the poses are written (--notation), or write them as matrices T_base_flange in metres"
# What is written seldom, by this logarithm.
SELDOM, ODD = -4.0, -7.0
_USUAL = ("ur", "kuka", "fanuc", "staubli", "doosan")
_AXES = "xyz"
_SIGNS = (
    ((-1.0, -1.0, -1.0), "all"),
    ((-1.0, 1.0, 1.0), "first"),
    ((1.0, -1.0, 1.0), "second"),
    ((1.0, 1.0, -1.0), "third"),
)

Readings = Callable[[FloatArray], FloatArray]


def hypotheses(measurements: Measurements) -> Iterator[Hypothesis]:
    """Yield every other way to read the rotations."""
    del measurements
    for name, sentence, poses in _PLAIN:
        yield of_poses(KIND, name, sentence, HINT, poses)
    for axis in range(3):
        yield of_poses(
            KIND,
            f"left_handed_{_AXES[axis]}",
            f"the robot poses are in a left-handed frame: {_AXES[axis]} points the other way",
            HINT,
            partial(_left_handed, axis=axis),
            log_prior=SELDOM,
        )
    for signs, which in _SIGNS:
        yield of_poses(
            KIND,
            f"position_sign_{which}",
            f"the positions of the robot poses have the wrong sign ({which} of the three)",
            HINT,
            partial(_signed_positions, signs=np.array(signs)),
            log_prior=SELDOM,
        )
    every = forms()
    for given in every:
        numbers = Numbers(given)
        for meant, beyond in itertools.product(every, (False, True)):
            if given is meant or (beyond and not isinstance(numbers.rotation, Euler)):
                continue
            usual = given.name in _USUAL and meant.name in _USUAL
            yield of_poses(
                KIND,
                f"{meant.name}_for_{given.name}" + ("_beyond" if beyond else ""),
                f"the robot's rotations are {words_of(meant)} and were read as {words_of(given)}",
                HINT,
                partial(numbers.read_as, meant=meant, beyond=beyond),
                log_prior=0.0 if usual else ODD,
            )
        if given.name == "ur":
            continue  # With all signs turned it is the transpose.
        for signs, which in _SIGNS:
            yield of_poses(
                KIND,
                f"{given.name}_sign_{which}",
                f"the robot's angles ({words_of(given)}) have the wrong sign ({which} of the three)",
                HINT,
                partial(numbers.read_as, meant=given, factors=signs),
                log_prior=SELDOM if which == "all" else ODD,
            )


class Numbers:
    """What was written, if poses were read in a notation; the numbers of the last poses are kept."""

    def __init__(self, given: Notation) -> None:
        self._given = given
        self._poses: FloatArray | None = None
        self._rows: FloatArray = np.zeros((0, 6))

    @property
    def rotation(self) -> Rotation | None:
        """How rotations are written."""
        return self._given.form.rotation if isinstance(self._given.form, Vector) else None

    def read_as(
        self,
        poses: FloatArray,
        *,
        meant: Notation,
        factors: tuple[float, ...] = (1.0, 1.0, 1.0),
        beyond: bool = False,
    ) -> FloatArray:
        """Return poses (K, 4, 4) of the same numbers in another notation, times factors.

        Two triples of angles stand for one rotation; `beyond` takes that whose second angle is larger.
        """
        if self._poses is not poses:
            self._rows = np.array([self._given.numbers(Pose(pose), Unit.M) for pose in poses])
            self._poses = poses
        rows = self._rows.copy()
        if beyond and isinstance(self.rotation, Euler):
            half = 180.0 if self.rotation.degrees else np.pi
            proper = self.rotation.axes[0] == self.rotation.axes[2]
            rows[:, 3] -= half * np.where(rows[:, 3] > 0, 1, -1)
            rows[:, 5] -= half * np.where(rows[:, 5] > 0, 1, -1)
            rows[:, 4] = -rows[:, 4] if proper else half * np.where(rows[:, 4] < 0, -1, 1) - rows[:, 4]
        rows[:, 3:6] *= factors
        return meant.matrices(rows, Unit.M)


def words_of(notation: Notation) -> str:
    """Say how a notation writes rotations."""
    rotation = notation.form.rotation if isinstance(notation.form, Vector) else None
    if not isinstance(rotation, Euler):
        return "rotation vectors"
    how = "moving" if rotation.moving else "fixed"
    makers = [
        n.name.upper() if len(n.name) < 5 else n.name.capitalize() for n in MAKERS if n.form == notation.form
    ]
    named = f" ({', '.join(makers[:2])})" if makers else ""
    return f"angles about {how} {', '.join(rotation.axes)} axes{named}"


def forms() -> tuple[Notation, ...]:
    """Return the rotation vector and all angles in degrees, those of the makers first."""
    usual = {maker.form: maker for maker in reversed(MAKERS) if maker.name in _USUAL}
    named = [n for n in usual.values() if n.name != "ur"]
    others = [n for n in EULER if n.name.endswith("_deg") and n.form not in usual]
    return (NOTATIONS["ur"], *reversed(named), *others)


def _transposed(poses: FloatArray) -> FloatArray:
    return _with_rotations(poses, np.swapaxes(poses[:, :3, :3], 1, 2))


def _requaternioned(poses: FloatArray, order: tuple[int, ...]) -> FloatArray:
    rotations = [Pose.from_quaternion([0, 0, 0], Pose(pose).quaternion_xyzw[list(order)]) for pose in poses]
    return _with_rotations(poses, np.array([pose.rotation for pose in rotations]))


def _left_handed(poses: FloatArray, axis: int) -> FloatArray:
    mirror = np.ones(4)
    mirror[axis] = -1
    return poses * np.outer(mirror, mirror)


def _signed_positions(poses: FloatArray, signs: FloatArray) -> FloatArray:
    changed = poses.copy()
    changed[:, :3, 3] *= signs
    return changed


def _with_rotations(poses: FloatArray, rotations: FloatArray) -> FloatArray:
    changed = poses.copy()
    changed[:, :3, :3] = rotations
    return changed


_PLAIN: tuple[tuple[str, str, Readings], ...] = (
    ("transposed", "the rotations of the robot poses are transposed", _transposed),
    (
        "scalar_first",
        "the robot's quaternions are in the order w, x, y, z and were read as x, y, z, w",
        partial(_requaternioned, order=(1, 2, 3, 0)),
    ),
    (
        "scalar_last",
        "the robot's quaternions are in the order x, y, z, w and were read as w, x, y, z",
        partial(_requaternioned, order=(3, 0, 1, 2)),
    ),
)
