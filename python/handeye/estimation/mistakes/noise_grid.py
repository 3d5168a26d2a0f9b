"""What the robot's noise may be while mistakes are looked for: a grid of sides and levels with a prior.

Wider and looser than the grid of the estimate: a gate that is off by a little does no harm, one that calls a
coarse arm mistaken does.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye.types.arrays import FloatArray

BoolArray = NDArray[np.bool_]

ROTATION_GRID_RAD = np.deg2rad(np.geomspace(1e-3, 2.0, 16))
# Translation over rotation: the length by which an error of the joints turns into one of the place.
LEVER_GRID_M = np.geomspace(0.15, 10.0, 6)
ROTATION_MEDIAN_RAD = np.deg2rad(0.02)
ROTATION_SPREAD = 2.0
LEVER_MEDIAN_M = 1.5
LEVER_SPREAD = 1.0


@dataclass(frozen=True, eq=False)
class NoiseGrid:
    """Hypotheses about the robot's noise.

    Parameters
    ----------
    left
        (H,) whether it acts on the left of A; on the right otherwise.
    translation_m, rotation_rad
        (H,) standard deviations per axis.
    log_prior
        (H,) logarithms of their prior probabilities.
    """

    left: BoolArray
    translation_m: FloatArray
    rotation_rad: FloatArray
    log_prior: FloatArray

    def __len__(self) -> int:
        return len(self.left)

    def select(self, chosen: BoolArray) -> "NoiseGrid":
        """Return some of the hypotheses, prior as it is."""
        return NoiseGrid(
            self.left[chosen], self.translation_m[chosen], self.rotation_rad[chosen], self.log_prior[chosen]
        )


def noise_grid() -> NoiseGrid:
    """Return the grid over both sides."""
    left, rotation, lever = (
        axis.ravel() for axis in np.meshgrid([True, False], ROTATION_GRID_RAD, LEVER_GRID_M, indexing="ij")
    )
    log_prior = -0.5 * (np.log(rotation / ROTATION_MEDIAN_RAD) / ROTATION_SPREAD) ** 2
    log_prior -= 0.5 * (np.log(lever / LEVER_MEDIAN_M) / LEVER_SPREAD) ** 2
    log_prior -= np.log(np.sum(np.exp(log_prior)))
    return NoiseGrid(left.astype(bool), rotation * lever, rotation, log_prior)
