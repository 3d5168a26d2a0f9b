"""The page of a session with one camera."""

from dataclasses import replace
from typing import Any

from handeye.estimation import Estimate
from handeye.estimation.confidence import Within
from handeye.robots.protocol import Reading
from handeye.session import End, Entry, Session, SessionStore, Step
from handeye.session.entry import views_of
from handeye.session.prepared import Prepared
from handeye.types import View
from handeye.ui import documents
from handeye.ui.documents import Picture, Shown
from handeye.ui.hub import Hub
from handeye.ui.live import Curve, LiveDashboard, added, asked_of


class Dashboard(LiveDashboard[Shown, Session]):
    """Looks on while a session runs, and publishes what it sees into a hub.

    Parameters
    ----------
    hub
        Where it is published.
    """

    made_by = documents
    unit = "view"

    def __init__(self, hub: Hub) -> None:
        self._pending: tuple[int, float, float] | None = None
        super().__init__(hub)

    def prepare(self, prepared: Prepared, store: SessionStore) -> None:
        """Show a cell before anything has happened in it, or where it was left."""
        configuration, cell, entries = prepared.configuration, prepared.cell, store.entries
        standing = None
        if prepared.start is not None:
            start = prepared.start
            standing = Reading(start.T_base_flange, start.joints_rad if start.posture_known else None)
        self._title = prepared.recording.name
        shown = Shown(
            configuration.mounting,
            cell.camera,
            cell.target,
            cell.arm,
            tuple(views_of(entries)),
            standing=standing,
            known=_history(entries),
            asked=asked_of(prepared),
        )
        self._begin(prepared, store, cell.arm, shown)

    def taken(self, entry: Entry, estimate: Estimate | None) -> None:
        """Show what an attempt brought."""
        if entry.view is not None and estimate is not None and self._shown is not None:
            gain = entry.decision.get("predicted_gain")
            if isinstance(gain, float) and estimate.determined:
                self._pending = (len(self._shown.views) + 1, gain, estimate.entropy)
        super().taken(entry, estimate)

    def decided(self, step: Step | End, session: Session) -> None:
        """Show what is to be done next, or that the session has ended."""
        shown = self._shown
        if shown is None:
            return
        views = session.views
        estimate, known = step.estimate or shown.estimate, shown.known
        now = step.reach if isinstance(step, End) else _radii(step.estimate)
        if now is not None:
            known = added(known, len(views), now.translation_mm, now.rotation_deg)
        ended = isinstance(step, End)
        next_one = replace(
            shown,
            views=views,
            goal=None if ended else step.goal,
            estimate=estimate,
            considered=None if ended else step.considered,
            known=known,
            gains=self._with_gain(shown.gains, step.estimate if ended else estimate),
            rejected=session.rejected,
        )
        self._told(step, next_one, len(views))

    def _with_gain(
        self, gains: tuple[tuple[int, float, float | None], ...], estimate: Estimate | None
    ) -> tuple[tuple[int, float, float | None], ...]:
        """Return the gains with that of the last view, once it is known what it brought."""
        if self._pending is None or estimate is None:
            return gains
        number, predicted, entropy = self._pending
        self._pending = None
        return (*gains, (number, predicted, entropy - estimate.entropy))

    def _everywhere(self, shown: Shown, **values: Any) -> Shown:  # noqa: ANN401 - of Shown
        return replace(shown, **values)

    def _change(self, **values: Any) -> None:  # noqa: ANN401 - of Shown
        self._move(**values)

    def _with_picture(self, shown: Shown, names: tuple[str, str], picture: Picture) -> Shown:
        del names
        return replace(shown, picture=picture)

    def _last_picture(self, shown: Shown) -> Picture | None:
        return shown.picture

    def _views(self, shown: Shown, name: str) -> tuple[tuple[View, ...], str]:
        return shown.views, name


def _radii(estimate: Estimate | None) -> Within | None:
    return None if estimate is None or not estimate.determined else estimate.within_95


def _history(entries: tuple[Entry, ...]) -> Curve:
    """Return what was stated before each attempt of a session that goes on."""
    known: Curve = ()
    for index, entry in enumerate(entries):
        before = entry.decision.get("reach_before")
        if isinstance(before, dict) and {"translation_mm", "rotation_deg"} <= set(before):  # pyright: ignore[reportUnknownArgumentType]
            views = len(views_of(entries[:index]))
            known = added(known, views, float(before["translation_mm"]), float(before["rotation_deg"]))  # pyright: ignore[reportUnknownArgumentType]
    return known
