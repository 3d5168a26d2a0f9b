"""Rotations that were written in one way and read in another."""

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from handeye.estimation.faults.kinds.base import Handling, Hypothesis, Kind, of_poses
from handeye.estimation.faults.kinds.numbers import (
    DEGREES,
    RADIANS,
    TURNS,
    Numbers,
    angles_between,
    choose,
    in_degrees,
    rotation_of,
)
from handeye.estimation.measurements import Measurements
from handeye.notations import EULER, MAKERS, Notation
from handeye.notations.forms import Euler
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
# What is written less often than poses inverted, by this logarithm: by more than chance makes of readings
# that a pan-tilt unit leaves alike. Of odd ways there are over a thousand.
USUAL, SELDOM, ODD = -8.0, -9.0, -15.0
_USUAL = (RADIANS.name, DEGREES.name, "kuka", "fanuc", "staubli", "doosan")
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
    for name, sentence, poses in _PLAIN:
        yield of_poses(KIND, name, sentence, HINT, poses, log_prior=USUAL)
    for axis in range(3):
        yield of_poses(
            KIND,
            f"left_handed_{_AXES[axis]}",
            f"the robot poses are in a left-handed frame: {_AXES[axis]} points the other way",
            HINT,
            partial(_left_handed, axis=axis),
            log_prior=SELDOM,
            is_mirror=True,
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
    robot = np.array([view.T_base_flange.matrix for view in measurements.views]).reshape(-1, 4, 4)
    cameras = measurements.camera_poses[:, :3, :3]
    seen = angles_between(cameras, cameras)
    every = forms()
    for given in every:
        numbers = Numbers(given)
        for meant in (RADIANS, *every):
            if given is meant or {given, meant} == {RADIANS, DEGREES}:
                continue
            usual = given.name in _USUAL and meant.name in _USUAL
            yield of_poses(
                KIND,
                f"{meant.name}_for_{given.name}",
                _sentence(given, meant),
                HINT,
                _either(robot, partial(numbers.read_as, meant=meant), seen),
                log_prior=USUAL if usual else ODD,
            )
        if given is DEGREES:
            continue  # With all signs turned it is the transpose.
        if given.name in _USUAL:
            yield of_poses(
                KIND,
                f"{given.name}_for_{RADIANS.name}",
                f"the robot's rotations are {words_of(given)} in degrees and were read as rotation vectors "
                "in radians",
                HINT,
                in_degrees(given, robot, seen),
                log_prior=-len(robot) * math.log(len(TURNS)),
            )
        for signs, which in _SIGNS:
            yield of_poses(
                KIND,
                f"{given.name}_sign_{which}",
                f"the robot's angles ({words_of(given)}) have the wrong sign ({which} of the three)",
                HINT,
                partial(numbers.read_as, meant=given, factors=signs),
                log_prior=SELDOM if which == "all" else ODD,
            )


def _either(robot: FloatArray, read_as: Callable[..., FloatArray], seen: FloatArray) -> Readings:
    """Return what is meant if each pose may stand for either of two sets of numbers."""
    both = np.stack([read_as(robot), read_as(robot, beyond=True)], axis=1)
    if np.allclose(both[:, 0], both[:, 1], atol=1e-9):
        return read_as
    return choose(robot, both, read_as, seen)


def _sentence(given: Notation, meant: Notation) -> str:
    """Say what was taken for what; numbers in the reverse order are so both ways."""
    one, other = rotation_of(given), rotation_of(meant)
    or_so = ""
    if isinstance(one, Euler) and isinstance(other, Euler):
        reverse = one.axes == other.axes[::-1] and one.moving != other.moving
        or_so = ", or the other way round" if reverse else ""
    units = (" in radians", " in degrees") if meant is RADIANS else ("", "")
    return (
        f"the robot's rotations are {words_of(meant)}{units[0]} and were read as {words_of(given)}{units[1]}"
        f"{or_so}"
    )


def words_of(notation: Notation) -> str:
    """Say how a notation writes rotations."""
    rotation = rotation_of(notation)
    if not isinstance(rotation, Euler):
        return "rotation vectors"
    how = "moving" if rotation.moving else "fixed"
    makers = [
        n.name.upper() if len(n.name) < 5 else n.name.capitalize() for n in MAKERS if n.form == notation.form
    ]
    named = f" ({', '.join(makers[:2])})" if makers else ""
    return f"angles about {how} {', '.join(rotation.axes)} axes{named}"


def forms() -> tuple[Notation, ...]:
    """Return the rotation vector and all angles, in degrees, those of the makers first."""
    usual = {maker.form: maker for maker in reversed(MAKERS) if maker.name in _USUAL}
    named = [n for n in usual.values() if n is not RADIANS]
    others = [n for n in EULER if n.name.endswith("_deg") and n.form not in usual]
    return (DEGREES, *reversed(named), *others)


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
