"""Running a session at the pace of a person at a page."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.robots.protocol import Goal
from handeye.session import Step
from handeye.session.attempt import Cell
from handeye.session.contract import check_at_rest
from handeye.session.stepping import Stepping
from handeye.types.plain import Document, read_document
from handeye.ui.hub import Command, Hub
from handeye.ui.live import LiveDashboard

E = TypeVar("E")


class More(Document):
    """What is asked for once a session has ended."""

    accuracy_mm: float
    accuracy_deg: float
    most_views: int


# Makes the session again that asks for more.
Again = Callable[[More], Stepping[Any, E]]


class Pace:
    """Whether each motion waits for a person; a motion that was skipped is not confirmed."""

    def __init__(self, *, waits: bool) -> None:
        self.waits = waits
        self._skipped = False

    def skip(self) -> None:
        """Do not confirm the next motion."""
        self._skipped = True

    def confirm(self, goal: Goal) -> bool:
        """Tell whether a motion is confirmed."""
        del goal
        skipped, self._skipped = self._skipped, False
        return not skipped


def drive(
    session: Stepping[Any, E],
    cell: Cell,
    dashboard: LiveDashboard[Any, Any],
    pace: Pace,
    again: Again[E],
) -> E:
    """Run a session as people ask for it at the page, until it has ended and somebody says so.

    Parameters
    ----------
    session, cell
        The session, of one camera or of several, and its world.
    dashboard
        The page, prepared.
    pace
        Whether motions wait for a person.
    again
        Makes the session again with another accuracy or more views.

    Raises
    ------
    DeviceError
        The robot does not keep the contract where it stands; nothing was sent to it.
    OutputError
        The disk does not take an attempt.
    """
    hub = dashboard.hub
    hub.on_stop(cell.stop)
    check_at_rest(cell)
    try:
        while True:
            step = session.next()
            dashboard.decided(step, session)
            dashboard.waits(waits=pace.waits)
            command = _awaited(hub, pace, ended=not isinstance(step, Step))
            if command.action == "finish":
                return session.end() if isinstance(step, Step) else step
            try:
                if command.action == "more":
                    asked = read_document(command.values, More, "more")
                    session = again(asked)
                    dashboard.asked_for(asked.accuracy_mm, asked.accuracy_deg, asked.most_views)
                else:
                    _obey(command, step, session, cell, hub, pace)
            except (DeviceError, InputError) as error:
                hub.say(error.message)
    except BaseException:
        cell.stop()
        raise


def _awaited(hub: Hub, pace: Pace, *, ended: bool) -> Command:
    """Return what to do next: what a person asked for, or to go on where nobody needs to."""
    waits = pace.waits or ended
    return hub.next_command(None if waits else 0) or Command("go")


def _obey(
    command: Command, step: object, session: Stepping[Any, E], cell: Cell, hub: Hub, pace: Pace
) -> None:
    """Do what is asked for."""
    action, values = command.action, command.values
    if action == "pause":
        pace.waits = True
    elif action == "withdraw":
        session.withdraw(_meant(values, session), "marked as bad by hand")
    elif not isinstance(step, Step):
        if action != "run_on":
            hub.say("The session has ended: ask for more, or finish.")
    elif action in {"go", "run_on", "skip"}:
        pace.waits = pace.waits and action != "run_on"
        if action == "skip":
            pace.skip()
        session.take(step)
    elif action == "here":
        session.take(_where_it_stands(step, cell))


def _where_it_stands(step: Step, cell: Cell) -> Step:
    """Return a step that takes a view without going anywhere."""
    reading = cell.read()
    goal = replace(step.goal, T_base_flange=reading.T_base_flange, joints_rad=reading.joints_rad)
    return Step(goal, "hand", {}, step.estimate, believed=step.believed)


def _meant(values: dict[str, object], session: Stepping[Any, E]) -> str:
    """Return the view or station that is meant: the one named, or the last."""
    name = values.get("view")
    if name is None and session.names:
        return session.names[-1]
    if not isinstance(name, str):
        raise InputError("there is no view to take back", code=Code.UNKNOWN_VIEW)
    return name
