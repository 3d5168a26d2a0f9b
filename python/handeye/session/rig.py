"""The closed loop with several cameras: one station at a time until all that is asked for is reached.

Journal, lock, checks before and after every motion, and going on after a break are those of one camera.
"""

from dataclasses import dataclass, replace

from handeye.codes import Code
from handeye.errors import DegenerateError, HandeyeError, InputError, SolveError
from handeye.estimation import (
    RigCalibration,
    RigEstimate,
    RigMeasurements,
    estimate_rig,
    solve_rig,
)
from handeye.estimation.rig_checks import check_tied, examine_rig
from handeye.estimation.rig_labels import agree_on_labels
from handeye.session.attempt import Cell
from handeye.session.deciding import FAILED, EndReason
from handeye.session.entry import Entry, stations_of
from handeye.session.judging import all_agree
from handeye.session.loop import FEWEST_EXAMINED
from handeye.session.rig_choosing import RigChooser, RigSituation
from handeye.session.rig_store import RigStore
from handeye.session.stepping import Stepping
from handeye.types import RigRecording


@dataclass(frozen=True, eq=False)
class RigEnd:
    """How a run ended: the answer if the stations determine one, and what is believed without it.

    `error` says why the stations are refused, where they are.
    """

    reason: EndReason
    sentence: str
    calibration: RigCalibration | None
    estimate: RigEstimate | None
    stations: int
    attempts: int
    error: HandeyeError | None = None


class RigSession(Stepping[RigSituation, RigEnd]):
    """The loop with several cameras and targets.

    Parameters
    ----------
    cell
        The world, its `several` filled.
    store
        Open session.
    chooser
        Decides where to go.
    """

    def __init__(self, cell: Cell, store: RigStore, chooser: RigChooser) -> None:
        super().__init__(cell, store, chooser.choose)
        self._store = store
        self._kinematics = chooser.kinematics
        self._measured: RigMeasurements | None = None

    @property
    def recording(self) -> RigRecording:
        """The stations that count."""
        return self._store.recording

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the stations that count, in the order in which they were taken."""
        return tuple(station.name for station in self._store.recording.stations)

    def withdraw(self, name: str, why: str) -> Entry:
        """Take a station back: it stays in the journal, and counts no more.

        Raises
        ------
        InputError
            There is no such station.
        OutputError
            The disk does not take it.
        """
        if name not in self.names:
            raise InputError(f"station {name[:60]}: no station of this session", code=Code.UNKNOWN_VIEW)
        return self._withdraw(name, why)

    def end(self) -> RigEnd:
        """End here, because somebody says so, with the answer from the stations so far."""
        stations = len(self._store.recording)
        return self._end(EndReason.BY_HAND, f"ended by hand after {stations} stations")

    def _situation(self) -> RigSituation:
        stations = tuple(stations_of(self._store.entries))
        believed, doubtful = self._believed()
        return RigSituation(self._entries(), stations, believed, doubtful=doubtful)

    def _believed(self) -> tuple[RigEstimate | None, bool]:
        """Return what is believed, None while the stations do not determine every camera, and if in doubt.

        One wrong view would make all the others look uncertain, or keep them from saying anything at all.
        Mistakes are looked for only where a view stands out or nothing is determined: the end of the session
        looks for them in any case.
        """
        recording = self._store.recording
        if not recording.stations:
            return None, False
        self._measured = RigMeasurements.of(recording, self._measured)
        measurements = agree_on_labels(self._measured)
        estimate = self._estimated(measurements)
        if all(
            estimate is not None and all_agree(measured, estimate.of_pair(*pair))
            for pair, measured in measurements.pairs.items()
            if len(measured) >= FEWEST_EXAMINED and measurements.moves(*pair)
        ):
            return estimate, False
        try:
            examined = examine_rig(
                measurements, by_joints=self._kinematics is not None, fewest=FEWEST_EXAMINED
            )
        except HandeyeError:
            return estimate, True
        kept = {pair: one.measurements for pair, one in examined.items() if len(one.measurements) > 0}
        if all(len(kept.get(pair, ())) == len(measured) for pair, measured in measurements.pairs.items()):
            return estimate, False
        return self._estimated(replace(measurements, pairs=kept)), False

    def _estimated(self, measurements: RigMeasurements) -> RigEstimate | None:
        try:
            check_tied(measurements)
            estimate = estimate_rig(measurements, self._kinematics)
        except (InputError, DegenerateError, SolveError):
            return None  # further stations tell more
        return estimate if estimate.determined else None

    def _end(self, reason: EndReason, sentence: str) -> RigEnd:
        stations, attempts = len(self._store.recording), len(self._store.entries)
        believed, _ = self._believed()
        calibration, refused = None, None
        if believed is not None:
            try:
                calibration = solve_rig(self._store.recording, kinematics=self._kinematics)
            except (InputError, SolveError, DegenerateError) as error:
                # What all views share may well be why nothing came of the attempts.
                reason = reason if reason in FAILED else EndReason.REFUSED
                sentence, refused = f"{sentence}; {error.message}", error
        return RigEnd(reason, sentence, calibration, believed, stations, attempts, refused)
