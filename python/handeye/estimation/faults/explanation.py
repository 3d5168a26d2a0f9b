"""One way to explain all views: which labels, which views belong, and how probable that makes the data."""

from dataclasses import dataclass, replace

import numpy as np

from handeye.errors import HandeyeError
from handeye.estimation.camera_prior import CameraPrior
from handeye.estimation.faults.agreement import BoolArray
from handeye.estimation.faults.consensus import consensus_as_labelled, find_consensus
from handeye.estimation.faults.relabel import Readings
from handeye.estimation.faults.selection import LOG_MISTAKE, Selection, select
from handeye.estimation.faults.stations import Stations
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray, IndexArray

# An explanation that needs no other: all views belong, and the robot (metres, radians) is no worse. A wrong
# reading of the poses can make three of four views agree to a few millimetres.
CONVINCING_SHARE = 1.0
CONVINCING_LEVELS = (2e-3, float(np.deg2rad(0.2)))
# One that stands at all: beyond, no arm that works errs, and a wrong reading of the poses fits as well.
BEARABLE_SHARE = 0.5
BEARABLE_LEVELS = (0.015, float(np.deg2rad(1.5)))
# Focal lengths and centre come first.
PINHOLE_PARAMETERS = 4
# No healthy cell has a board whose size is off by more, or a camera off by such a share of its focal length.
BEARABLE_SCALE = 0.03
BEARABLE_CAMERA = 0.03
# Where no other reading explains the views at all, both may be off by so many times as much: a coarse arm
# says no better how large its board is.
BEARABLE_ALONE = 2.0
# Beyond such a level of the robot's noise the evidence is rounding.
LARGEST_LEVEL_M = 10.0
# Few views agree by chance sooner: more is asked of them.
FEW_VIEWS = 5
FEW_LEVELS = (1e-3, float(np.deg2rad(0.1)))


@dataclass(frozen=True, eq=False)
class Explanation:
    """Labels and members.

    Parameters
    ----------
    stations
        With the labels as explained.
    labels
        (K,) index into the readings of each view, 0 for as it is.
    selection
        The views that belong, and what they say of all.
    log_evidence
        Of everything, the labels included.
    """

    stations: Stations
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
        return self.selection.agreement.robot_levels(self.selection.fit)

    @property
    def is_convincing(self) -> bool:
        """Whether there is no reason to look for another."""
        few = len(self.members) <= FEW_VIEWS
        levels = FEW_LEVELS if few else CONVINCING_LEVELS
        return self.constants_are_bearable() and self._within(CONVINCING_SHARE, 4, levels)

    @property
    def is_bearable(self) -> bool:
        """Whether it explains the views at all."""
        return self.constants_are_bearable() and self._stands

    @property
    def is_bearable_alone(self) -> bool:
        """Whether it explains the views where nothing else does."""
        return self.constants_are_bearable(BEARABLE_ALONE) and self._stands

    @property
    def has_evidence(self) -> bool:
        """Whether its evidence is more than rounding and may be compared."""
        return self.constants_are_bearable() and self.levels[0] < LARGEST_LEVEL_M

    @property
    def _stands(self) -> bool:
        # Three of four agree easily: six numbers more than unknowns.
        few = int(self.members.sum()) < min(4, len(self.members))
        return self._within(BEARABLE_SHARE, 3, FEW_LEVELS if few else BEARABLE_LEVELS)

    def constants_are_bearable(self, times: float = 1.0) -> bool:
        """Tell whether board and camera are about as they are stated, or within so many times of that."""
        fit, camera = self.selection.fit, self.stations.camera
        return scale_is_bearable(fit.board_scale, times) and camera_is_bearable(
            fit.camera_shift, camera, times
        )

    def _within(self, share: float, fewest: int, levels: tuple[float, float]) -> bool:
        """Tell whether so many of the views agree, and within these levels."""
        count = len(self.members)
        needed = max(share * count, min(count, fewest))
        translation, rotation = self.levels
        return int(self.members.sum()) >= needed and translation <= levels[0] and rotation <= levels[1]


def scale_is_bearable(scale: float, times: float = 1.0) -> bool:
    """Tell whether a healthy board is off its size by such a share."""
    return abs(scale) < times * BEARABLE_SCALE


def camera_is_bearable(shift: FloatArray, prior: CameraPrior, times: float = 1.0) -> bool:
    """Tell whether a healthy camera is off by so much in its free parameters."""
    shift = shift[np.array(prior.free, dtype=int) < PINHOLE_PARAMETERS]
    return bool((np.abs(shift) < times * BEARABLE_CAMERA * prior.camera.parameters[0]).all())


def explain(measurements: Measurements) -> Explanation:
    """Find the best labels and the views that belong together.

    Raises
    ------
    SolveError
        The views are as far apart as no noise explains.
    """
    stations, readings = Stations.of(measurements), Readings.of(measurements)
    if len(stations) > FEW_VIEWS:
        quick = _as_labelled(stations, readings)
        if quick is not None:
            return quick
    consensus = find_consensus(stations, readings.poses)
    labels, factor = readings.relative_to_most(consensus.labels)
    kinds = len(readings.relabelings)
    read = stations.with_poses(readings.poses[np.arange(len(labels)), labels])
    selection = select(read, replace(consensus, Y=consensus.Y @ factor))
    turned = [
        k
        for k in np.flatnonzero(labels % kinds)
        if not readings.relabelings[int(labels[k]) % kinds].looks_the_same
    ]
    return Explanation(read, readings, labels, selection, selection.log_evidence + LOG_MISTAKE * len(turned))


def _as_labelled(stations: Stations, readings: Readings) -> Explanation | None:
    """Return the explanation of healthy views, None where they are not: nothing turned, all belong."""
    try:
        selection = select(stations, consensus_as_labelled(stations))
    except HandeyeError:
        return None
    labels = np.zeros(len(stations), dtype=np.int64)
    explanation = Explanation(stations, readings, labels, selection, selection.log_evidence)
    return explanation if explanation.is_convincing else None
