"""Running a session at the pace of a person at a page."""

from dataclasses import replace

from handeye.errors import DeviceError, InputError
from handeye.robots.protocol import Goal
from handeye.session import End, Session, SessionStore, Step
from handeye.session.contract import check_at_rest
from handeye.session.prepared import Prepared
from handeye.types.plain import Document, read_document
from handeye.ui.dashboard import Dashboard
from handeye.ui.hub import Command, Hub


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


def drive(session: Session, store: SessionStore, prepared: Prepared, dashboard: Dashboard, pace: Pace) -> End:
    """Run a session as people ask for it at the page, until it has ended and somebody says so.

    Raises
    ------
    DeviceError
        The robot does not keep the contract where it stands; nothing was sent to it.
    OutputError
        The disk does not take an attempt.
    """
    hub, cell = dashboard.hub, prepared.cell
    dashboard.prepare(prepared, store)
    hub.on_stop(cell.stop)
    check_at_rest(cell)
    try:
        while True:
            step = session.next()
            dashboard.decided(step, session.views, session.rejected)
            dashboard.waits(waits=pace.waits)
            command = _awaited(hub, pace, ended=isinstance(step, End))
            if command.action == "finish":
                return step if isinstance(step, End) else session.end()
            try:
                session = _obey(command, step, session, store, prepared, dashboard, pace)
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
    command: Command,
    step: Step | End,
    session: Session,
    store: SessionStore,
    prepared: Prepared,
    dashboard: Dashboard,
    pace: Pace,
) -> Session:
    """Do what is asked for; return the session to go on with."""
    action, values = command.action, command.values
    if action == "pause":
        pace.waits = True
    elif action == "withdraw":
        session.withdraw(_view_name(values, session), "marked as bad by hand")
    elif action == "more":
        return _asked_again(values, store, prepared, dashboard)
    elif isinstance(step, End):
        if action != "run_on":
            dashboard.hub.say("The session has ended: ask for more, or finish.")
    elif action in {"go", "run_on", "skip"}:
        pace.waits = pace.waits and action != "run_on"
        if action == "skip":
            pace.skip()
        session.take(step)
    elif action == "here":
        session.take(_where_it_stands(step, prepared))
    return session


def _where_it_stands(step: Step, prepared: Prepared) -> Step:
    """Return a step that takes a view without going anywhere."""
    reading = prepared.cell.read()
    goal = replace(step.goal, T_base_flange=reading.T_base_flange, joints_rad=reading.joints_rad)
    return Step(goal, "hand", {}, step.estimate)


def _view_name(values: dict[str, object], session: Session) -> str:
    """Return the view that is meant: the one named, or the last."""
    name = values.get("view")
    if name is None and session.views:
        return session.views[-1].name
    if not isinstance(name, str):
        raise InputError("there is no view to take back", code="unknown_view")
    return name


class _More(Document):
    accuracy_mm: float
    accuracy_deg: float
    most_views: int


def _asked_again(
    values: dict[str, object], store: SessionStore, prepared: Prepared, dashboard: Dashboard
) -> Session:
    asked = read_document(values, _More, "more")
    configuration = replace(
        prepared.configuration,
        accuracy_mm=asked.accuracy_mm,
        accuracy_deg=asked.accuracy_deg,
        most_views=asked.most_views,
    )
    session = replace(prepared, configuration=configuration).session(store)
    dashboard.asked_for(asked.accuracy_mm, asked.accuracy_deg, asked.most_views)
    return session
