"""The closed loop: choose, go, look, write down, until the accuracy asked for is reached.

What happens next is a function of the journal and the seed alone: after a break the same decisions follow.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from handeye.codes import Code
from handeye.errors import HandeyeError, InputError, SolveError
from handeye.estimation import Estimate, Estimator, Measurements, calibrate_examined, make_estimator
from handeye.estimation.confidence import Within
from handeye.estimation.faults import Examination, examine
from handeye.estimation.lens_confidence import lens_within_px
from handeye.session.attempt import Cell
from handeye.session.deciding import FAILED, START_VIEWS, Chooser, EndReason, Halt, Situation
from handeye.session.entry import Entry, views_of
from handeye.session.judging import all_agree
from handeye.session.stepping import Stepping
from handeye.session.store import SessionStore
from handeye.session.wish import Wish
from handeye.types import View
from handeye.types.calibration import Calibration, ModelName

# Fewer views than these cannot speak against one of them.
FEWEST_EXAMINED = 5


@dataclass(frozen=True, eq=False)
class End:
    """How a run ended: the answer if the views determine one, and how far off it may be.

    `lens_px` is within how many pixels the lens is known, where the views taught it; None otherwise. `error`
    says why the views are refused, where they are.

    Examples
    --------
    >>> end = End(EndReason.NO_START, "no view", None, None, views=0, attempts=3)
    >>> end.calibration is None
    True
    """

    reason: EndReason
    sentence: str
    calibration: Calibration | None
    reach: Within | None
    views: int
    attempts: int
    estimate: Estimate | None = None
    lens_px: float | None = None
    error: HandeyeError | None = None


class Session(Stepping[Situation, End]):
    """The loop with one camera and one target.

    Parameters
    ----------
    cell
        The world.
    store
        Open session.
    chooser
        Decides where to go.
    wish
        What is asked for.

    Examples
    --------
    >>> from handeye.session.configuration import begin, prepare
    >>> from handeye.session.settings import Configuration, Simulation
    >>> points = Simulation(points_only=0.1)
    >>> quick = Configuration("epson_c4l", accuracy_mm=20, accuracy_deg=2, simulation=points)
    >>> session, store = begin(prepare(quick), Path("session"))
    >>> session.run().reason.value
    'accuracy_reached'
    >>> store.close()
    """

    def __init__(
        self,
        cell: Cell,
        store: SessionStore,
        chooser: Chooser,
        wish: Wish,
    ) -> None:
        super().__init__(cell, store, chooser.choose)
        self._store = store
        self._wish = wish
        known = wish.joints_err and wish.model is ModelName.AUTO
        self._kinematics = chooser.kinematics if known else None
        self._by_joints = chooser.kinematics is not None
        self._estimator: Estimator = make_estimator(wish.model, self._kinematics, height=wish.height)
        # Where no camera was given there is none until the views teach one.
        self._learning = store.self_calibration
        self._measurements = self._no_measurements()

    def _situation(self) -> Situation | Halt:
        views = self._usable()
        measurements, estimate, doubtful = self._planned_from(views)
        situation = Situation(self._entries(), tuple(views), measurements, estimate, doubtful=doubtful)
        left_out = len(measurements) < len(views)
        if left_out and not situation.is_open and len(views) >= self._wish.most_views:
            return Halt(EndReason.VIEWS_TAKEN, f"{len(views)} views taken, as asked")
        return situation

    @property
    def views(self) -> tuple[View, ...]:
        """The views that count, in the order in which they were taken."""
        return tuple(self._usable())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the views that count, in the order in which they were taken."""
        return tuple(view.name for view in self._usable())

    @property
    def rejected(self) -> dict[str, str]:
        """Views whose points are no picture of the target, and why."""
        return dict(self._measurements.rejected)

    def _usable(self) -> list[View]:
        """Return the views with joints that the arm can have; older sessions may hold others."""
        arm = self._cell.arm
        views = views_of(self._store.entries)
        if arm is None:
            return views
        needed = self._kinematics is not None
        return [
            view
            for view in views
            if (len(view.joints_rad) == len(arm) if view.joints_rad is not None else not needed)
        ]

    def withdraw(self, name: str, why: str) -> Entry:
        """Take a view back: it stays in the journal, and counts no more.

        Raises
        ------
        InputError
            There is no such view.
        OutputError
            The disk does not take it.
        """
        if name not in self.names:
            raise InputError(f"view {name[:60]}: no view of this session", code=Code.UNKNOWN_VIEW)
        return self._withdraw(name, why)

    def _no_measurements(self) -> Measurements:
        return Measurements.of(self._store.begun_with.mounting, self._cell.camera, self._cell.target)

    def _with(self, views: Sequence[View], teaching: Sequence[View] | None = None) -> Measurements:
        """Return the measurements of these views; those measured before are not measured again.

        Where no camera was given, through the one that the views teach, or that of `teaching`.
        """
        if self._learning is not None:
            camera = self._learning.camera(views if teaching is None else teaching)
            empty = replace(self._measurements, views=(), poses=(), rejected={})
            return empty if camera is None else replace(empty, camera=camera).with_views(views)
        known = {view.name for view in self._measurements.views} | set(self._measurements.rejected)
        if known - {view.name for view in views}:  # withdrawn
            self._measurements, known = self._no_measurements(), set[str]()
        self._measurements = self._measurements.with_views(view for view in views if view.name not in known)
        return self._measurements

    def _planned_from(self, views: list[View]) -> tuple[Measurements, Estimate | None, bool]:
        """Return what to plan from, what it says, and whether that is in doubt.

        One wrong view would make all the others look uncertain, or draw the answer to where no right view is
        believed any more. Mistakes are looked for only where a view stands out: where all agree there are
        none to be found, and the end of the session looks for them in any case.
        """
        measurements = self._with(views)
        if len(measurements) < START_VIEWS:
            return measurements, None, False
        estimate = self._estimated(measurements)
        if estimate is not None and all_agree(measurements, estimate):
            return measurements, estimate, False
        try:
            examined = self._examined(measurements).measurements
        except InputError:
            # More views tell which of them are wrong, or that all share a mistake, as the end will say.
            return measurements, estimate, True
        if len(examined) < len(measurements) < FEWEST_EXAMINED:
            return measurements, estimate, True
        return examined, self._estimated(examined) if len(examined) >= START_VIEWS else None, False

    def _estimated(self, measurements: Measurements) -> Estimate | None:
        """Return what the views say; None where their numbers fail, and further views tell more."""
        try:
            return self._estimator(measurements)
        except SolveError:
            return None

    def _examined(self, measurements: Measurements) -> Examination:
        """Look for mistakes; a camera that the views teach is found again without those that are wrong."""
        examination = examine(measurements, by_joints=self._by_joints)
        kept = examination.measurements.views
        if self._learning is None or len(kept) == len(measurements):
            return examination
        return examine(self._with(measurements.views, kept), by_joints=self._by_joints)

    def end(self) -> End:
        """End here, because somebody says so, with the answer from the views so far."""
        return self._end(EndReason.BY_HAND, f"ended by hand after {len(self.views)} views")

    def _end(self, reason: EndReason, sentence: str) -> End:
        entries = self._store.entries
        views = self._usable()
        left_out = [view.name for view in views_of(entries) if view not in views]
        if left_out:
            sentence += f"; without {', '.join(left_out)}, whose joint positions are not those of the arm"
        calibration, radii, estimate, lens_px = None, None, None, None
        measurements = self._with(views)
        if len(measurements) >= START_VIEWS:
            try:
                examination = self._examined(measurements)
                estimate = self._estimator(examination.measurements)
            except (InputError, SolveError) as error:
                # What all views share may well be why nothing came of the attempts.
                why = reason if reason in FAILED else EndReason.REFUSED
                said = f"{sentence}; {error.message}"
                return End(why, said, None, None, len(views), len(entries), error=error)
            if estimate.determined:
                calibration = calibrate_examined(
                    examination,
                    self._wish.model,
                    kinematics=self._kinematics,
                    height=self._wish.height,
                    work=None if self._wish.touch_mm is None else self._wish.work,
                )
                radii = estimate.within_95
                lens_px = None if self._learning is None else lens_within_px(estimate)
        return End(reason, sentence, calibration, radii, len(views), len(entries), estimate, lens_px)
