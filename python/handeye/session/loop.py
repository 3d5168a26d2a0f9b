"""The closed loop: choose, go, look, write down, until the accuracy asked for is reached.

What happens next is a function of the journal and the seed alone: after a break the same decisions follow.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from handeye.errors import InputError
from handeye.estimation import Estimate, Estimator, Measurements, calibrate_examined, make_estimator
from handeye.estimation.confidence import Within
from handeye.estimation.mistakes import examine
from handeye.session.attempt import Cell
from handeye.session.contract import check_at_rest
from handeye.session.deciding import FAILED, START_VIEWS, Chooser, EndReason, Halt, Situation, Step
from handeye.session.entry import Entry
from handeye.session.store import SessionStore
from handeye.session.taking import Taker
from handeye.session.wish import Wish
from handeye.types import View
from handeye.types.calibration import Calibration, ModelName

# Fewer views than these cannot speak against one of them.
FEWEST_EXAMINED = 5


@dataclass(frozen=True, eq=False)
class End:
    """How a run ended: the answer if the views determine one, and how far off it may be."""

    reason: EndReason
    sentence: str
    calibration: Calibration | None
    reach: Within | None
    views: int
    attempts: int


Progress = Callable[[Entry, Estimate | None], None]


class Session:
    """Runs the loop on a cell and writes every attempt into a store.

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
    progress
        Told of every attempt.
    """

    def __init__(
        self,
        cell: Cell,
        store: SessionStore,
        chooser: Chooser,
        wish: Wish,
        progress: Progress | None = None,
    ) -> None:
        self._cell = cell
        self._store = store
        self._chooser = chooser
        self._wish = wish
        self._progress = progress
        self._taker = Taker(cell, store)
        known = wish.joints_err and wish.model is ModelName.AUTO
        self._kinematics = chooser.kinematics if known else None
        self._estimator: Estimator = make_estimator(wish.model, self._kinematics)
        self._measurements = Measurements.of(store.recording.mounting, cell.camera, cell.target)
        self._forgiven_up_to: int | None = None

    def run(self) -> End:
        """Run until the end; an interruption stops the arm first and leaves the session whole.

        Raises
        ------
        DeviceError
            The robot does not keep the contract where it stands; nothing was sent to it.
        OutputError
            The disk does not take an attempt, also not when asked again.
        """
        check_at_rest(self._cell)
        try:
            while True:
                step = self.next()
                if isinstance(step, End):
                    return step
                self.take(step)
        except BaseException:
            self._cell.stop()
            raise

    def next(self) -> Step | End:
        """Decide what to do next, without doing it."""
        began = time.monotonic()
        if self._cell.robot_calls.pending:
            return self._end(
                EndReason.ROBOT_HANGS,
                "the last command to the robot has not come back, and nothing more is sent to it; "
                "the arm may still move",
            )
        views = self._usable()
        measurements = _without_mistakes(self._with(views))
        if len(measurements) < len(views) and len(views) >= self._wish.most_views:
            return self._end(EndReason.VIEWS_TAKEN, f"{len(views)} views taken, as asked")
        estimate = self._estimator(measurements) if len(measurements) >= START_VIEWS else None
        answer = self._choose(Situation(self._store.entries, tuple(views), measurements, estimate))
        if isinstance(answer, Step):
            return replace(answer, seconds=time.monotonic() - began)
        return self._end(answer.reason, answer.sentence)

    def _choose(self, situation: Situation) -> Step | Halt:
        """Choose; a session that had ended in failures when it was opened gets as many attempts again."""
        if self._forgiven_up_to is None:
            self._forgiven_up_to = 0
            if situation.missed:
                first = self._chooser.choose(situation)
                if not isinstance(first, Halt) or first.reason not in FAILED:
                    return first
                self._forgiven_up_to = len(situation.entries)
        forgiven = sum(1 for entry in situation.missed if entry.number <= self._forgiven_up_to)
        return self._chooser.choose(replace(situation, forgiven=forgiven))

    def _usable(self) -> list[View]:
        """Return the views with joints that the arm can have; older sessions may hold others."""
        arm = self._cell.arm
        views = [entry.view for entry in self._store.entries if entry.view is not None]
        if arm is None:
            return views
        needed = self._kinematics is not None
        return [
            view
            for view in views
            if (len(view.joints_rad) == len(arm) if view.joints_rad is not None else not needed)
        ]

    def take(self, step: Step) -> Entry:
        """Do a step, and write down what it brought.

        Raises
        ------
        OutputError
            The disk does not take it.
        """
        entry = self._taker.take(step)
        if self._progress is not None:
            self._progress(entry, step.estimate)
        return entry

    def _with(self, views: list[View]) -> Measurements:
        """Return the measurements of these views; those measured before are not measured again."""
        known = {view.name for view in self._measurements.views} | set(self._measurements.rejected)
        self._measurements = self._measurements.with_views(view for view in views if view.name not in known)
        return self._measurements

    def _end(self, reason: EndReason, sentence: str) -> End:
        entries = self._store.entries
        views = self._usable()
        left_out = [e.view.name for e in entries if e.view is not None and e.view not in views]
        if left_out:
            sentence += f"; without {', '.join(left_out)}, whose joint positions are not those of the arm"
        calibration, radii = None, None
        measurements = self._with(views)
        if len(measurements) >= START_VIEWS:
            try:
                examination = examine(measurements)
            except InputError as error:
                if reason not in FAILED:
                    raise
                # What all views share may well be why nothing came of the attempts.
                return End(reason, f"{sentence}; {error.message}", None, None, len(views), len(entries))
            estimate = self._estimator(examination.measurements)
            if estimate.determined:
                calibration = calibrate_examined(examination, self._wish.model, kinematics=self._kinematics)
                radii = estimate.within_95
        return End(reason, sentence, calibration, radii, len(views), len(entries))


def _without_mistakes(measurements: Measurements) -> Measurements:
    """Return what is left to plan from: one wrong view would make all the others look uncertain."""
    if len(measurements) < FEWEST_EXAMINED:
        return measurements
    try:
        return examine(measurements).measurements
    except InputError:
        return measurements  # Shared by all of them; said at the end.
