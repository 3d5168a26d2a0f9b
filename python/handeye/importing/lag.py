"""How much later the clock of the pictures runs than that of the robot, from pictures taken on the move.

With hand-eye and target known from where the arm stood still, a picture that is stamped t shows the target
from where the flange was at t - lag. Where the chain then puts the points, and where they were found, differ
by the lag times how fast the points move through the picture (Furgale, Rehder and Siegwart, IROS 2013,
estimate it with the trajectory; here the trajectory is what the robot says).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handeye.datasets.bags import Track
from handeye.detection import Detection
from handeye.types import Pose, Target
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Calibration

# Lags beyond this belong to clocks that were never set to one another.
LARGEST_LAG_S = 0.6
_STEP_S = 0.02
_HALF_S = 1e-3
_ROUNDS = 6
MIN_PICTURES = 4


@dataclass(frozen=True)
class Lag:
    """How much later the pictures are stamped than the robot's poses.

    Attributes
    ----------
    seconds, sigma_s
        The lag, and its standard deviation from how much the pictures differ.
    pictures
        How many pictures taken on the move it rests on.
    """

    seconds: float
    sigma_s: float
    pictures: int


@dataclass(frozen=True, eq=False)
class _Seen:
    time_s: float
    points: FloatArray
    pixels: FloatArray


def estimate_lag(
    calibration: Calibration,
    target: Target,
    track: Track,
    times_s: Mapping[str, float],
    found: Mapping[str, Detection],
) -> Lag | None:
    """Return the lag; None where the pictures do not tell.

    Parameters
    ----------
    calibration
        From where the arm stood still.
    target
        The target.
    track
        Where the flange was.
    times_s
        When each picture on the move was stamped, by its name.
    found
        Where the target is in it.
    """
    seen = [
        _Seen(times_s[name], target.points[detection.point_ids], detection.pixels)
        for name, detection in found.items()
        if track.times_s[0] + LARGEST_LAG_S < times_s[name] < track.times_s[-1] - LARGEST_LAG_S
    ]
    if len(seen) < MIN_PICTURES:
        return None
    grid = np.arange(-LARGEST_LAG_S, LARGEST_LAG_S + _STEP_S / 2, _STEP_S)
    costs = [float(np.median([_rms(calibration, track, s, lag) for s in seen])) for lag in grid]
    lag = float(grid[int(np.argmin(costs))])
    each, weights = np.zeros(len(seen)), np.ones(len(seen))
    for _ in range(_ROUNDS):
        steps, weights = _steps(calibration, track, seen, lag)
        each = lag + steps
        middle = _weighted_median(each, weights)
        spread = max(1.4826 * _weighted_median(np.abs(each - middle), weights), 1e-5)
        # Tukey's biweight: a picture whose points were found wrongly is left out.
        weights *= np.square(np.clip(1 - np.square((each - middle) / (5 * spread)), 0, None))
        lag = float(np.clip(np.average(each, weights=weights), -LARGEST_LAG_S, LARGEST_LAG_S))
    share = weights / weights.sum()
    sigma = float(np.sqrt(np.sum(np.square(share * (each - lag)))))
    kept = int(np.count_nonzero(weights))
    return Lag(lag, sigma, kept) if kept >= MIN_PICTURES and abs(lag) < LARGEST_LAG_S else None


def _steps(
    calibration: Calibration, track: Track, seen: Sequence[_Seen], lag: float
) -> tuple[FloatArray, FloatArray]:
    """Return what each picture says (N,) is missing from a lag, and how much (N,) it says."""
    steps, weights = np.zeros(len(seen)), np.zeros(len(seen))
    for k, one in enumerate(seen):
        low, middle, high = (_off(calibration, track, one, lag + d) for d in (-_HALF_S, 0.0, _HALF_S))
        usable = np.isfinite(low) & np.isfinite(middle) & np.isfinite(high)
        slope = ((high - low) / (2 * _HALF_S))[usable]
        weights[k] = float(slope @ slope)
        steps[k] = 0.0 if weights[k] == 0 else -float(slope @ middle[usable]) / weights[k]
    # From far away a picture's own step is as far as the grid is wide, no more.
    return np.clip(steps, -_STEP_S, _STEP_S), weights


def _off(calibration: Calibration, track: Track, seen: _Seen, lag: float) -> FloatArray:
    """Return by how much (2 N,) points are predicted beside where they were found, NaN behind the camera."""
    pose = Pose(track.at(np.array([seen.time_s - lag]))[0])
    chain = calibration.X @ calibration.mounting.chain(pose) @ calibration.Y
    pixels, visible = calibration.camera.project(chain.act(seen.points))
    pixels[~visible] = np.nan
    return np.asarray((pixels - seen.pixels).ravel(), dtype=np.float64)


def _rms(calibration: Calibration, track: Track, seen: _Seen, lag: float) -> float:
    off = _off(calibration, track, seen, lag)
    return float("inf") if not np.isfinite(off).all() else float(np.sqrt(np.mean(np.square(off))))


def _weighted_median(values: FloatArray, weights: FloatArray) -> float:
    order = np.argsort(values)
    total: FloatArray = np.cumsum(weights[order])
    middle = int(np.searchsorted(total, 0.5 * float(total[-1])))
    return float(values[order][middle])
