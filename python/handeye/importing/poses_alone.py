"""X and Y from poses alone, where somebody else's detector has measured the target.

Each pose of the target is a measurement of the default model as a picture is: what it lacks in pixels, the
noise of the detector (across and along its line of sight, and in rotation) is found along with the robot's.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.codes import Code
from handeye.datasets import PosePairs
from handeye.errors import HandeyeError, InputError, SolveError
from handeye.estimation.confidence import Within, within
from handeye.importing.readings import CLOSED_FORM, FITS_M, FITS_RAD, MIN_VIEWS, chain_errors
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray

# Weights of the first fit: a millimetre counts as much as 0.1 degrees.
SIGMA_M = 1e-3
SIGMA_RAD = np.deg2rad(0.1)
# No detector is better than this; all else is found.
LEAST_M, LEAST_RAD = 1e-6, np.deg2rad(1e-4)
# A sample is left out if it is this many times further off than the middle one; so many stay at least.
FAR_OUT, STAYING = 8.0, 5
DRAWS, REFITS = 60, 3
NODE_PAIRS, MOST_LINEARISATIONS = 16, 8


@dataclass(frozen=True, eq=False)
class PosesSolved:
    """The answer for poses alone.

    Attributes
    ----------
    pairs
        What it rests on.
    X, Y
        Of the chain ``T_camera_target = X A Y``.
    chain_covariance, information
        (12, 12) of the twists of X and Y, translation first: their covariance, and what that of a further
        station adds to. What comes again at every station is in the covariance only.
    degrees_of_freedom
        Of the noise levels behind it.
    levels
        What was found of detector and robot, by name: deviations in metres (`_m`) and radians (`_rad`).
    distances_m, angles_rad
        (N,) what the chain misses the target by at each station.
    left_out
        Names of samples that contradict the others, and by how much.
    """

    pairs: PosePairs
    X: Pose
    Y: Pose
    chain_covariance: FloatArray
    information: FloatArray
    degrees_of_freedom: float
    levels: Mapping[str, float]
    distances_m: FloatArray
    angles_rad: FloatArray
    left_out: Mapping[str, str]

    @property
    def results(self) -> Mapping[str, Pose]:
        """What people ask for under its name, such as `T_flange_camera`."""
        return self.pairs.mounting.results(self.X, self.Y)

    @property
    def covariance(self) -> FloatArray:
        """(6, 6) covariance of the twist of X, translation first: as that of a `Calibration`."""
        return self.chain_covariance[:6, :6]

    @property
    def within_95(self) -> Within:
        """How far off the camera's centre and its rotation may be."""
        return within(self.covariance, self.degrees_of_freedom)

    @property
    def used(self) -> NDArray[np.bool_]:
        """(N,) whether each sample counts."""
        return np.array([pair.name not in self.left_out for pair in self.pairs.pairs])

    @property
    def rms_m(self) -> float:
        """Root mean square of the distances of the samples that count."""
        return float(np.sqrt(np.mean(np.square(self.distances_m[self.used]))))

    @property
    def rms_rad(self) -> float:
        """Root mean square of the angles of the samples that count."""
        return float(np.sqrt(np.mean(np.square(self.angles_rad[self.used]))))


def solve_poses(pairs: PosePairs) -> PosesSolved:
    """Return X and Y that fit the poses of robot and target, and how far off they may be.

    Raises
    ------
    InputError
        Fewer than three stations.
    DegenerateError
        The stations do not turn about two axes.
    SolveError
        No X and Y fit: the poses contradict each other.
    """
    if len(pairs) < MIN_VIEWS:
        raise InputError(
            f"{pairs.name}: {len(pairs)} samples, at least {MIN_VIEWS} are needed", code=Code.TOO_FEW_VIEWS
        )
    kept, x, y = _first_fit(pairs)
    distance, angle = _half_within(pairs, x, y)
    if angle > FITS_RAD or distance > FITS_M:
        raise SolveError(
            f"{pairs.name}: the poses of robot and target contradict each other: half of the {len(pairs)} "
            f"samples are off by more than {1e3 * distance:.3g} mm and {np.rad2deg(angle):.2g} deg",
            code=Code.INCONSISTENT,
            hint=_other_mounting(pairs)
            or "are both in metres, in the same order, and the poses of the target those in the camera?",
        )
    return _solved(pairs, kept, x, y)


def solve_some(pairs: PosePairs, kept: list[int]) -> PosesSolved:
    """Return X and Y that fit some of the samples, which are taken to be right.

    Raises
    ------
    DegenerateError
        These stations do not turn about two axes.
    SolveError
        No X and Y fit.
    """
    return _solved(pairs, kept, *first_fit(pairs.motions[kept], pairs.camera_poses[kept]))


def _solved(pairs: PosePairs, kept: list[int], x: FloatArray, y: FloatArray) -> PosesSolved:
    motions, seen = pairs.motions, pairs.camera_poses
    posterior = _posterior(pairs, kept, x, y)
    X, Y = Pose(posterior.x[0]), Pose(posterior.y[0])
    angles, distances = chain_errors(X.matrix @ motions @ Y.matrix, seen)
    return PosesSolved(
        pairs,
        X,
        Y,
        np.asarray(posterior.covariance),
        np.asarray(posterior.information),
        posterior.degrees_of_freedom[0],
        dict(zip(posterior.level_names, posterior.mode, strict=True)),
        distances,
        angles,
        {
            pairs.pairs[k].name: f"contradicts the others: {1e3 * distances[k]:.3g} mm and "
            f"{np.rad2deg(angles[k]):.2g} deg off"
            for k in range(len(pairs))
            if k not in kept
        },
    )


def _first_fit(pairs: PosePairs) -> tuple[list[int], FloatArray, FloatArray]:
    """Return which samples agree, and X and Y (4, 4) that fit them."""
    motions, seen = pairs.motions, pairs.camera_poses
    kept = _agreeing(motions, seen, *first_fit(motions, seen))
    return kept, *first_fit(motions[kept], seen[kept])


def _half_within(pairs: PosePairs, x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return how far half of the samples are off, in metres and radians."""
    angles, distances = chain_errors(x @ pairs.motions @ y, pairs.camera_poses)
    return float(np.median(distances)), float(np.median(angles))


def _other_mounting(pairs: PosePairs) -> str | None:
    """Say that the samples agree with the camera in the other place; None if they do not."""
    other = next(mounting for mounting in Mounting if mounting is not pairs.mounting)
    turned = replace(pairs, mounting=other)
    distance, angle = _half_within(turned, *_first_fit(turned)[1:])
    if angle > FITS_RAD or distance > FITS_M:
        return None
    return f"with --mounting {other.value} half of them agree within {1e3 * distance:.2g} mm"


def first_fit(motions: FloatArray, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return X and Y (4, 4) of a closed form (Shah 2013) and the fit to all poses alike."""
    start = _core.closed_form(CLOSED_FORM, motions, seen)
    weights = np.diag([SIGMA_M**2] * 3 + [SIGMA_RAD**2] * 3)
    x, y, _, _ = _core.start_from_poses(motions, seen, np.tile(weights, (len(motions), 1, 1)), start=start)
    return x, y


def _agreeing(motions: FloatArray, seen: FloatArray, x: FloatArray, y: FloatArray) -> list[int]:
    """Return the places of the samples that agree, by the fit whose middle sample is nearest.

    Least median of squares (Rousseeuw 1984) over all samples and a fixed draw of some: the same each time.
    """
    count = len(motions)
    if count <= STAYING:
        return list(range(count))
    random = np.random.default_rng(0)
    best = _off(x, y, motions, seen)
    for _ in range(DRAWS):
        chosen = np.sort(random.permutation(count)[:STAYING])
        try:
            drawn = _core.closed_form(CLOSED_FORM, motions[chosen], seen[chosen])
        except HandeyeError:
            continue
        off = _off(*drawn, motions, seen)
        best = off if np.median(off) < np.median(best) else best
    for _ in range(REFITS):
        kept = _near(best)
        best = _off(*first_fit(motions[kept], seen[kept]), motions, seen)
    return _near(best)


def _near(off: FloatArray) -> list[int]:
    """Return the places of samples that are not far out."""
    limit = FAR_OUT * max(float(np.median(off)), LEAST_M / SIGMA_M)
    return [int(k) for k in np.flatnonzero(off <= limit)]


def _off(x: FloatArray, y: FloatArray, motions: FloatArray, seen: FloatArray) -> FloatArray:
    """Return by how much the chain misses each sample (N,), in units of the weights."""
    angles, distances = chain_errors(x @ motions @ y, seen)
    return np.asarray(np.hypot(angles / SIGMA_RAD, distances / SIGMA_M), dtype=np.float64)


def _posterior(pairs: PosePairs, kept: list[int], x: FloatArray, y: FloatArray) -> _core.Posterior:
    in_hand = pairs.mounting is Mounting.EYE_IN_HAND
    least = np.diag([LEAST_M**2] * 3 + [LEAST_RAD**2] * 3)
    stated = _core.PoseMeasurements.stated(
        pairs.motions[kept], pairs.camera_poses[kept], np.tile(least, (len(kept), 1, 1))
    )
    return _core.estimate_cell(
        np.array([pairs.pairs[k].T_base_flange.matrix for k in kept]),
        [(in_hand, 0, False, None)],
        [not in_hand],
        [(0, 0, stated, list(range(len(kept))), [1.0] * len(kept))],
        start=(x[np.newaxis], y[np.newaxis]),
        pairs=NODE_PAIRS,
        most_rounds=MOST_LINEARISATIONS,
    )
