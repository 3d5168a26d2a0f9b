"""Who starts where: random starts that all policies share, views held out, and a seed for each.

A start is three views drawn at random. Three views at random often do not determine the answer (in public
sets two thirds of the views have one orientation), and no policy can be blamed for that: a draw counts only
if the rotations between its views turn about two axes, that is, if the second singular value of the three
relative rotation vectors exceeds a threshold.
"""

import zlib
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DegenerateError, InputError
from handeye.types import Pose, Recording
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.pose import inverses

# What is held out may leave no start behind: then it is drawn again.
MOST_SPLITS, MOST_STARTS = 20, 300


@dataclass(frozen=True)
class Protocol:
    """How trials are drawn.

    Parameters
    ----------
    trials
        Number of random starts of each set.
    start_views, added_views
        Views in a start, and views that a policy then adds.
    held_out_share
        Share of the views that is kept apart to measure on; 0 for none.
    smallest_turn_deg
        What the second singular value of the relative rotation vectors of a start must exceed.
    seed
        Seed of all trials.

    Raises
    ------
    InputError
        A number out of its range.
    """

    trials: int = 50
    start_views: int = 3
    added_views: int = 5
    held_out_share: float = 0.0
    smallest_turn_deg: float = 5.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.trials < 1 or self.start_views < 3 or self.added_views < 0 or self.seed < 0:
            raise InputError(
                f"{self.trials} trials, {self.start_views} + {self.added_views} views, seed {self.seed}: "
                "expected at least 1, 3, 0 and 0",
                code=Code.OUT_OF_RANGE,
            )
        if not 0 <= self.held_out_share < 1:
            raise InputError(
                f"held-out share {self.held_out_share}, expected 0 to below 1", code=Code.OUT_OF_RANGE
            )


@dataclass(frozen=True)
class Trial:
    """One random start: indices of views, and the seed of whatever else is random.

    Parameters
    ----------
    start
        Views to start from.
    pool
        Views that may be added; the start is not among them.
    held_out
        Views to measure on, used by nothing else.
    """

    number: int
    start: tuple[int, ...]
    pool: tuple[int, ...]
    held_out: tuple[int, ...]
    seed: int


def trial_random(seed: int, name: str, number: int) -> np.random.Generator:
    """Return the source of chance of one trial of one set; independent of all others."""
    return np.random.default_rng([seed, zlib.crc32(name.encode()), number])


def second_turn_rad(robot_poses: FloatArray) -> float:
    """Return the second singular value of the relative rotation vectors between poses (K, 4, 4), in radians.

    Zero if all rotations share one axis. Relative rotations of the flange tell it without a calibration.
    """
    first, second = np.triu_indices(len(robot_poses), 1)
    relative = inverses(robot_poses[first]) @ robot_poses[second]
    vectors = _core.se3_log(relative)[:, 3:]
    singular = np.asarray(np.linalg.svd(vectors, compute_uv=False), np.float64)
    return float(singular[1])


def draw_trials(recording: Recording, protocol: Protocol) -> list[Trial]:
    """Draw the trials of a set; the same for the same seed, whatever the policies and models compared.

    Raises
    ------
    InputError
        Too few views for this protocol.
    DegenerateError
        No three views turn about two axes.
    """
    return [draw_trial(recording, protocol, number) for number in range(protocol.trials)]


def draw_trial(recording: Recording, protocol: Protocol, number: int) -> Trial:
    """Draw one trial; see `draw_trials`."""
    count = len(recording)
    held_out_count = int(count * protocol.held_out_share)
    if count - held_out_count < protocol.start_views + max(protocol.added_views, 1):
        raise InputError(
            f"{recording.name}: {count} views, {held_out_count} of them held out, are too few for "
            f"{protocol.start_views} + {protocol.added_views}",
            code=Code.TOO_FEW_VIEWS,
        )
    random = trial_random(protocol.seed, recording.name, number)
    poses = np.array([view.T_base_flange.matrix for view in recording.views])
    least = np.deg2rad(protocol.smallest_turn_deg)
    for _ in range(MOST_SPLITS):
        order = random.permutation(count)
        rest = np.sort(order[held_out_count:])
        for _ in range(MOST_STARTS):
            start = random.choice(rest, protocol.start_views, replace=False)
            if second_turn_rad(poses[start]) > least:
                pool = np.array([i for i in rest if i not in start])
                held_out = np.sort(order[:held_out_count])
                seed = int.from_bytes(random.bytes(4))
                return Trial(number, _indices(start), _indices(pool), _indices(held_out), seed)
    raise DegenerateError(
        f"{recording.name}: no {protocol.start_views} views turn about two axes by more than "
        f"{protocol.smallest_turn_deg:g} degrees",
        hint="record views with the camera turned about another axis",
    )


def random_halves(recording: Recording, seed: int, number: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return all views in two halves at random."""
    order = trial_random(seed, f"{recording.name} halves", number).permutation(len(recording))
    middle = len(recording) // 2
    return _indices(np.sort(order[:middle])), _indices(np.sort(order[middle:]))


def contiguous_halves(recording: Recording) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the first and the second half of the views, in the order of recording.

    Neighbours in time often are neighbours in space, so this is the harder test where the robot's error is
    smooth.
    """
    middle = len(recording) // 2
    return tuple(range(middle)), tuple(range(middle, len(recording)))


def _indices(values: IndexArray) -> tuple[int, ...]:
    return tuple(int(i) for i in values)


def true_hand_eye(recording: Recording) -> Pose:
    """Return the true X of a recording.

    Raises
    ------
    InputError
        It is not known.
    """
    if recording.truth is None or recording.truth.X is None:
        raise InputError(f"{recording.name}: no true hand-eye to compare with", code=Code.NO_TRUTH)
    return recording.truth.X
