"""Pairs of poses out of two streams: which clock, which way round, and a choice of moments.

However camera and target are fixed, hand and target turn by one angle between two moments (the congruence of
screws: Chen, CVPR 1991): the lag between the clocks is where these angles agree best, before anything is
known of X and Y.
"""

from dataclasses import dataclass

import numpy as np

from handeye.codes import Code
from handeye.datasets import DataWarning, PosePairs
from handeye.datasets.bags.tracks import Track
from handeye.datasets.pose_pairs import PoseStreams, numbered
from handeye.errors import InputError
from handeye.importing.readings import chain_misses
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray

LARGEST_LAG_S, STEP_S = 1.0, 0.01
MOST_PAIRS, FEWEST_PAIRS = 80, 4
# Beyond this a lag is said.
NOTABLE_S = 0.5e-3
# By so much better must one way round fit than the other.
CLEARLY = 2.0


@dataclass(frozen=True, eq=False)
class _Moments:
    times_s: FloatArray
    seen: FloatArray


def pairs_of(streams: PoseStreams) -> PosePairs:
    """Return pairs of poses at moments spread over the streams.

    Raises
    ------
    InputError
        Streams that do not overlap, nothing that says where the camera sits, or poses of the target that fit
        both ways round.
    """
    if streams.mounting is None:
        raise InputError(
            f"{streams.name}: the poses do not say where the camera sits",
            code=Code.MOUNTING_UNSTATED,
            hint="state --mounting eye_in_hand or eye_to_hand",
        )
    moments = _moments(streams)
    lag = _lag(streams.robot, moments)
    robot = streams.robot.at(moments.times_s - lag)
    seen, notes = _way_round(streams, robot, moments.seen, streams.mounting)
    if abs(lag) > NOTABLE_S:
        order = "later" if lag > 0 else "earlier"
        message = (
            f"the target's poses are stamped {1e3 * abs(lag):.1f} ms {order} than the robot's: put right"
        )
        notes.append(DataWarning("lag", message))
    poses = [(Pose(a), Pose(b)) for a, b in zip(robot, seen, strict=True)]
    return PosePairs(
        streams.name, streams.layout, streams.mounting, numbered(poses), streams.source, tuple(notes)
    )


def clock_lag(streams: PoseStreams) -> float:
    """Return how much later the target's poses are stamped than the robot's, in seconds.

    Raises
    ------
    InputError
        Streams that do not overlap.
    """
    return _lag(streams.robot, _moments(streams))


def _moments(streams: PoseStreams) -> _Moments:
    robot, seen = streams.robot, streams.seen
    inside = np.flatnonzero((seen.times_s >= robot.times_s[0]) & (seen.times_s <= robot.times_s[-1]))
    if len(inside) < FEWEST_PAIRS:
        raise InputError(
            f"{streams.name}: {len(inside)} poses of the target while the robot's are known, at least "
            f"{FEWEST_PAIRS} are needed",
            code=Code.TOO_FEW_VIEWS,
            hint="both files must be of one clock, up to a second",
        )
    chosen = inside[np.linspace(0, len(inside) - 1, min(len(inside), MOST_PAIRS)).round().astype(int)]
    return _Moments(seen.times_s[chosen], seen.poses[chosen])


def _lag(robot: Track, moments: _Moments) -> float:
    """Return how much later the target's poses are stamped, in seconds; zero where they do not tell."""
    wanted = _angles(moments.seen)

    def off(lag: float) -> float:
        return float(np.mean(np.abs(_angles(robot.at(moments.times_s - lag)) - wanted)))

    # Synchronous streams agree at zero to begin with, and sparse ones say nothing about anything else.
    if float(np.median(np.diff(robot.times_s))) > 0.1:
        return 0.0
    grid = np.arange(-LARGEST_LAG_S, LARGEST_LAG_S + STEP_S / 2, STEP_S)
    costs = np.array([off(float(lag)) for lag in grid])
    best = int(np.argmin(costs))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    ratio = (np.sqrt(5) - 1) / 2
    for _ in range(24):  # golden section: Kiefer 1953
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        low, high = (low, b) if off(float(a)) < off(float(b)) else (a, high)
    found = float(0.5 * (low + high))
    return found if off(found) < 0.98 * off(0.0) else 0.0


def _angles(poses: FloatArray) -> FloatArray:
    """Return the angles between all pairs of rotations of poses (N, 4, 4)."""
    flat = poses[:, :3, :3].reshape(len(poses), 9)
    upper = np.triu_indices(len(flat), 1)
    return np.asarray(np.arccos(np.clip(((flat @ flat.T)[upper] - 1) / 2, -1, 1)), dtype=np.float64)


def _way_round(
    streams: PoseStreams, robot: FloatArray, seen: FloatArray, mounting: Mounting
) -> tuple[FloatArray, list[DataWarning]]:
    """Return the target in the camera, whichever of the two the file has."""
    if not streams.may_be_inverse:
        return seen, []
    turned = np.asarray(np.linalg.inv(seen), dtype=np.float64)
    as_they_are, inverse = (chain_misses(robot, mounting, poses) for poses in (seen, turned))
    if as_they_are * CLEARLY < inverse:
        return seen, []
    if inverse * CLEARLY < as_they_are:
        message = "the file has the camera in the target, not the target in the camera: turned round"
        return turned, [DataWarning("poses_inverted", message)]
    raise InputError(
        f"{streams.name}: the poses of the target fit as they are and turned round",
        code=Code.INCONSISTENT,
        hint="record turns about different axes, or name the files as poses_B_H.csv and poses_W_E.csv",
    )
