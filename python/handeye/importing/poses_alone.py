"""X and Y from poses alone, where somebody else's detector has measured the target.

Without pixels there is no noise model and no covariance: a closed form (Shah 2013), then the fit of X and Y
to all poses with equal weights, and what they miss each station by. The answer says so.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.datasets import PosePairs
from handeye.errors import InputError, SolveError
from handeye.importing.readings import CLOSED_FORM, FITS_M, FITS_RAD, MIN_VIEWS, chain_errors
from handeye.types import Pose
from handeye.types.arrays import FloatArray

# Weights of the fit: a millimetre counts as much as 0.1 degrees.
SIGMA_M = 1e-3
SIGMA_RAD = np.deg2rad(0.1)


@dataclass(frozen=True, eq=False)
class PosesSolved:
    """The answer for poses alone.

    Attributes
    ----------
    pairs
        What it rests on.
    X, Y
        Of the chain ``T_camera_target = X A Y``.
    distances_m, angles_rad
        (N,) what the chain misses the target by at each station.
    """

    pairs: PosePairs
    X: Pose
    Y: Pose
    distances_m: FloatArray
    angles_rad: FloatArray

    @property
    def results(self) -> Mapping[str, Pose]:
        """What people ask for under its name, such as `T_flange_camera`."""
        return self.pairs.mounting.results(self.X, self.Y)

    @property
    def rms_m(self) -> float:
        """Root mean square of the distances."""
        return float(np.sqrt(np.mean(np.square(self.distances_m))))

    @property
    def rms_rad(self) -> float:
        """Root mean square of the angles."""
        return float(np.sqrt(np.mean(np.square(self.angles_rad))))


def solve_poses(pairs: PosePairs) -> PosesSolved:
    """Return X and Y that fit the poses of robot and target.

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
            f"{pairs.name}: {len(pairs)} samples, at least {MIN_VIEWS} are needed", code="too_few_views"
        )
    motions, seen = pairs.motions, pairs.camera_poses
    start = _core.closed_form(CLOSED_FORM, motions, seen)
    weights = np.diag([SIGMA_M**2] * 3 + [SIGMA_RAD**2] * 3)
    x, y, _, _ = _core.start_from_poses(motions, seen, np.tile(weights, (len(pairs), 1, 1)), start=start)
    angles, distances = chain_errors(x @ motions @ y, seen)
    if np.median(angles) > FITS_RAD or np.median(distances) > FITS_M:
        raise SolveError(
            f"{pairs.name}: the poses of robot and target contradict each other: half of the {len(pairs)} "
            f"samples are off by more than {1e3 * np.median(distances):.3g} mm and "
            f"{np.rad2deg(np.median(angles)):.2g} deg",
            code="inconsistent",
            hint="are both in metres, in the same order, and the poses of the target those in the camera?",
        )
    return PosesSolved(pairs, Pose(x), Pose(y), distances, angles)
