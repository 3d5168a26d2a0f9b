"""The page of a session with several cameras."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from handeye.estimation import RigEstimate
from handeye.robots.protocol import Reading
from handeye.session import Entry, Step
from handeye.session.entry import stations_of
from handeye.session.rig import RigEnd, RigSession
from handeye.session.rig_prepared import RigPrepared
from handeye.session.rig_store import RigStore
from handeye.types import View
from handeye.ui import rigs
from handeye.ui.documents import Picture, Shown
from handeye.ui.live import Curve, LiveDashboard, added, asked_of
from handeye.ui.rigs import ShownRig, with_belief


class RigDashboard(LiveDashboard[ShownRig, RigSession]):
    """Looks on while a session with several cameras runs, and publishes what it sees into a hub.

    Parameters
    ----------
    hub
        Where it is published.
    """

    made_by = rigs
    unit = "station"

    def prepare(self, prepared: RigPrepared, store: RigStore) -> None:
        """Show a rig before anything has happened with it, or where it was left."""
        start, cell, entries = prepared.start, prepared.cell, store.entries
        standing = Reading(start.T_base_flange, start.joints_rad if start.posture_known else None)
        self._title = prepared.recording.name
        parts: dict[tuple[str, str], Shown] = {}
        for eye in cell.eyes:
            if eye.moves:
                one = store.recording.pair(*eye.name)
                parts[eye.name] = Shown(
                    one.mounting, eye.camera, eye.target, cell.arm, one.views, standing=standing
                )
        known = _history(entries, [camera for camera, _ in parts])
        self._begin(prepared, store, cell.arm, ShownRig(parts, known=known, asked=asked_of(prepared)))

    def decided(self, step: Step | RigEnd, session: RigSession) -> None:
        """Show what is to be done next, or that the session has ended."""
        shown = self._shown
        if shown is None:
            return
        recording, believed = session.recording, None
        values: dict[str, Any] = {"goal": None, "considered": None}
        if isinstance(step, Step):
            believed = step.believed
            values = {"goal": step.goal, "considered": step.considered}
        else:
            believed = step.estimate
        parts = {
            names: replace(part, views=recording.pair(*names).views, **values)
            for names, part in shown.parts.items()
        }
        shown = replace(shown, parts=parts)
        if believed is not None:
            shown = with_belief(shown, believed)
            shown = replace(shown, known=_grown(shown.known, believed, len(recording)))
        self._told(step, shown, len(recording))

    def _everywhere(self, shown: ShownRig, **values: Any) -> ShownRig:  # noqa: ANN401 - of Shown
        parts = {names: replace(part, **values) for names, part in shown.parts.items()}
        return replace(shown, parts=parts)

    def _change(self, **values: Any) -> None:  # noqa: ANN401 - of ShownRig
        with self._lock:
            if self._shown is not None:
                self._shown = replace(self._shown, **values)

    def _with_picture(self, shown: ShownRig, names: tuple[str, str], picture: Picture) -> ShownRig:
        if names not in shown.parts:  # both on one body: the arm does not move them against each other
            return shown
        parts = {**shown.parts, names: replace(shown.parts[names], picture=picture)}
        return replace(shown, parts=parts, looked=names)

    def _last_picture(self, shown: ShownRig) -> Picture | None:
        return None if shown.looked is None else shown.parts[shown.looked].picture

    def _views(self, shown: ShownRig, name: str) -> tuple[tuple[View, ...], str] | None:
        found = shown.find(name)
        return None if found is None else (found[0].views, found[1])


def _grown(known: Mapping[str, Curve], believed: RigEstimate, stations: int) -> dict[str, Curve]:
    """Return the curves with what is believed after so many stations."""
    grown = dict(known)
    for name in believed.fit.measurements.cameras:
        if not believed.unobservable[name]:
            now = believed.of_camera(name).within_95
            grown[name] = added(known.get(name, ()), stations, now.translation_mm, now.rotation_deg)
    return grown


def _history(entries: tuple[Entry, ...], cameras: Sequence[str]) -> dict[str, Curve]:
    """Return what was stated of each camera before each attempt of a session that goes on."""
    known: dict[str, Curve] = {}
    for index, entry in enumerate(entries):
        before = entry.decision.get("reach_before")
        if isinstance(before, dict):
            stations = len(stations_of(entries[:index]))
            for name in cameras:
                one: Any = before.get(name)  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]
                if isinstance(one, dict) and {"translation_mm", "rotation_deg"} <= set(one):  # pyright: ignore[reportUnknownArgumentType]
                    mm, deg = float(one["translation_mm"]), float(one["rotation_deg"])  # pyright: ignore[reportUnknownArgumentType]
                    known[name] = added(known.get(name, ()), stations, mm, deg)
    return known
