"""One way to explain all views: which labels, which views belong, and how probable that makes the data."""

from dataclasses import dataclass, replace

import numpy as np

from handeye.estimation.mistakes.consensus import find_consensus
from handeye.estimation.mistakes.noise_grid import BoolArray, NoiseGrid
from handeye.estimation.mistakes.outliers import LOG_MISTAKE, Selection, select
from handeye.estimation.mistakes.relabel import Readings
from handeye.estimation.mistakes.sightings import Sightings
from handeye.types.arrays import IndexArray

# An explanation that needs no other: all views belong, and the robot (metres, radians) is no worse. A wrong
# reading of the poses can make three of four views agree to a few millimetres.
CONVINCING_SHARE = 1.0
CONVINCING_LEVELS = (2e-3, float(np.deg2rad(0.2)))
# One that stands at all: beyond, no arm that works errs, and a wrong reading of the poses fits as well.
BEARABLE_SHARE = 0.5
BEARABLE_LEVELS = (0.015, float(np.deg2rad(1.5)))
# Few views agree by chance sooner: more is asked of them.
FEW_VIEWS = 5
FEW_LEVELS = (1e-3, float(np.deg2rad(0.1)))


@dataclass(frozen=True, eq=False)
class Explanation:
    """Labels and members.

    Parameters
    ----------
    sightings
        With the labels as explained.
    labels
        (K,) index into the readings of each view, 0 for as it is.
    selection
        The views that belong, and what they say of all.
    log_evidence
        Of everything, the labels included.
    """

    sightings: Sightings
    readings: Readings
    labels: IndexArray
    selection: Selection
    log_evidence: float

    @property
    def members(self) -> BoolArray:
        """(K,) which views belong."""
        return self.selection.members

    @property
    def levels(self) -> tuple[float, float]:
        """Translation (metres) and rotation (radians) of the robot's noise."""
        return self.selection.weighing.levels(self.selection.fit)

    @property
    def is_convincing(self) -> bool:
        """Whether there is no reason to look for another."""
        few = len(self.members) <= FEW_VIEWS
        return self._within(CONVINCING_SHARE, 4, FEW_LEVELS if few else CONVINCING_LEVELS)

    @property
    def is_bearable(self) -> bool:
        """Whether it explains the views at all."""
        # Three of four agree easily: six numbers more than unknowns.
        few = int(self.members.sum()) < min(4, len(self.members))
        return self._within(BEARABLE_SHARE, 3, FEW_LEVELS if few else BEARABLE_LEVELS)

    def _within(self, share: float, fewest: int, levels: tuple[float, float]) -> bool:
        """Tell whether so many of the views agree, and within these levels."""
        count = len(self.members)
        needed = max(share * count, min(count, fewest))
        translation, rotation = self.levels
        return int(self.members.sum()) >= needed and translation <= levels[0] and rotation <= levels[1]


def explain(sightings: Sightings, readings: Readings, grid: NoiseGrid) -> Explanation:
    """Find the best labels and the views that belong together."""
    consensus = find_consensus(sightings, readings.poses)
    labels, factor = readings.relative_to_most(consensus.labels)
    kinds = len(readings.relabelings)
    read = sightings.with_poses(readings.poses[np.arange(len(labels)), labels])
    selection = select(read, replace(consensus, Y=consensus.Y @ factor), grid)
    turned = [
        k
        for k in np.flatnonzero(labels % kinds)
        if not readings.relabelings[int(labels[k]) % kinds].looks_the_same
    ]
    return Explanation(read, readings, labels, selection, selection.log_evidence + LOG_MISTAKE * len(turned))
