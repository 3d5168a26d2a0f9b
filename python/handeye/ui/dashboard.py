"""What a session tells, turned into documents for pages."""

import threading
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2

from handeye.cameras.protocol import Grey
from handeye.datasets.images import read_image
from handeye.detection import Detection
from handeye.errors import InputError
from handeye.estimation import Estimate
from handeye.robots.protocol import Goal, Reading
from handeye.session import End, Entry, Observer, SessionStore, Step
from handeye.session.entry import views_of
from handeye.session.prepared import Prepared
from handeye.types import View
from handeye.ui import documents
from handeye.ui.documents import Picture, Shown
from handeye.ui.hub import Hub
from handeye.ui.links import links_of

_QUALITY = 88


class Dashboard(Observer):
    """Looks on while a session runs, and publishes what it sees into a hub.

    Parameters
    ----------
    hub
        Where it is published.
    """

    def __init__(self, hub: Hub) -> None:
        self.hub = hub
        self._lock = threading.Lock()
        self._shown: Shown | None = None
        self._title = "session"
        self._folder: Path | None = None
        self._pace = "ask"
        self._state = "preparing"
        self._step: Step | None = None
        self._end: End | None = None
        self._last: dict[str, Any] | None = None
        self._attempts = 0
        self._most_views = 0
        self._uploads = False
        self._pending: tuple[int, float, float] | None = None
        self._publish("status")

    def prepare(self, prepared: Prepared, store: SessionStore) -> None:
        """Show a cell before anything has happened in it, or where it was left."""
        configuration, cell, entries = prepared.configuration, prepared.cell, store.entries
        asked = None
        if configuration.accuracy_mm is not None and configuration.accuracy_deg is not None:
            asked = (configuration.accuracy_mm, configuration.accuracy_deg)
        standing = None
        if prepared.start is not None:
            start = prepared.start
            standing = Reading(start.T_base_flange, start.joints_rad if start.posture_known else None)
        self._title, self._folder = prepared.recording.name, store.folder
        self._uploads = configuration.images.startswith("folder:")
        self._most_views, self._attempts = configuration.most_views, len(entries)
        self._shown = Shown(
            configuration.mounting,
            cell.camera,
            cell.target,
            cell.arm,
            tuple(views_of(entries)),
            standing=standing,
            known=_history(entries),
            asked=asked,
        )
        links = [] if cell.arm is None else links_of(cell.arm, configuration.robot)
        self.hub.publish("model", lambda: {"links": [link.to_dict() for link in links]})
        self._publish("status", "scene", "candidates", "knowledge", "views", "picture")

    def asked_for(self, accuracy_mm: float, accuracy_deg: float, most_views: int) -> None:
        """Show that something else is asked for from now on."""
        self._most_views, self._end = most_views, None
        self._change(asked=(accuracy_mm, accuracy_deg))
        self._publish("status", "knowledge")

    # What the session tells

    def stands(self, reading: Reading) -> None:
        """Show where the arm is."""
        self._change(standing=reading)
        self._publish("scene")

    def goes(self, goal: Goal) -> None:
        """Show where the arm goes."""
        self._state = "moving"
        self._change(goal=goal)
        self._publish("status", "scene")

    def looked(self, label: str, image: Grey | None, detection: Detection | None) -> None:
        """Show what the camera saw."""
        shown = self._shown
        if shown is None:
            return
        number = 1 if shown.picture is None else shown.picture.number + 1
        at = None if shown.standing is None else shown.standing.T_base_flange
        self._change(picture=Picture(number, label, image, detection, at))
        self._publish("picture")

    def taken(self, entry: Entry, estimate: Estimate | None) -> None:
        """Show what an attempt brought."""
        self._attempts += 1
        failure = None if entry.failure is None else entry.failure.value
        self._last = {"label": entry.label, "failure": failure, "detail": entry.detail}
        if entry.view is None and entry.withdraws is None:
            self.hub.say(f"{entry.label}: {failure}: {entry.detail}")
        if entry.view is not None and estimate is not None:
            gain = entry.decision.get("predicted_gain")
            if isinstance(gain, float) and estimate.determined:
                self._pending = (len(self._views) + 1, gain, estimate.entropy)
        self._state = "deciding"
        self._publish("status")

    # What the one who drives the session tells

    def decided(self, step: Step | End, views: tuple[View, ...], rejected: dict[str, str]) -> None:
        """Show what is to be done next, or that the session has ended."""
        shown = self._shown
        if shown is None:
            return
        if isinstance(step, End):
            self._end, self._step, self._state = step, None, "ended"
            known = shown.known
            if step.reach is not None:
                known = _added(known, len(views), step.reach.translation_mm, step.reach.rotation_deg)
            estimate = step.estimate or shown.estimate
            self._change(
                views=views,
                goal=None,
                estimate=estimate,
                considered=None,
                chosen=None,
                known=known,
                gains=self._with_gain(shown.gains, step.estimate),
                rejected=rejected,
            )
        else:
            self._step, self._end = step, None
            estimate, known = step.estimate, shown.known
            if estimate is not None and estimate.determined:
                now = estimate.within_95
                known = _added(known, len(views), now.translation_mm, now.rotation_deg)
            self._change(
                views=views,
                goal=step.goal,
                estimate=estimate if estimate is not None else shown.estimate,
                considered=step.considered,
                chosen=step.goal.label if step.considered is None else _chosen(step),
                known=known,
                gains=self._with_gain(shown.gains, estimate),
                rejected=rejected,
            )
        self._publish("status", "scene", "candidates", "knowledge", "views", "picture")

    def _with_gain(
        self, gains: tuple[tuple[int, float, float | None], ...], estimate: Estimate | None
    ) -> tuple[tuple[int, float, float | None], ...]:
        """Return the gains with that of the last view, once it is known what it brought."""
        if self._pending is None or estimate is None:
            return gains
        number, predicted, entropy = self._pending
        self._pending = None
        return (*gains, (number, predicted, entropy - estimate.entropy))

    def waits(self, *, waits: bool) -> None:
        """Show whether the next motion waits for a person."""
        self._pace = "ask" if waits else "on"
        if self._end is None:
            self._state = "waiting" if waits else "deciding"
        self._publish("status")

    # What pages ask for

    def picture(self, number: int) -> bytes | None:
        """Return the last picture, if it has that number, as JPEG."""
        last = None if self._shown is None else self._shown.picture
        if last is None or last.image is None or last.number != number:
            return None
        return jpeg(last.image)

    def view(self, name: str) -> dict[str, Any] | None:
        """Return what is drawn over the picture of a view."""
        return None if self._shown is None else documents.picture_of_view(self._shown, name)

    def view_picture(self, name: str) -> bytes | None:
        """Return the picture of a view as JPEG, None if there is none."""
        return picture_in(self._folder, self._views, name)

    @property
    def _views(self) -> tuple[View, ...]:
        return () if self._shown is None else self._shown.views

    def _change(self, **values: Any) -> None:  # noqa: ANN401 - of Shown
        with self._lock:
            if self._shown is not None:
                self._shown = replace(self._shown, **values)

    def _publish(self, *names: str) -> None:
        shown = self._shown
        for name in names:
            if name == "status":
                status = self._status()
                self.hub.publish(name, lambda status=status: status)
            elif shown is not None:
                self.hub.publish(name, partial(getattr(documents, name), shown))

    def _status(self) -> dict[str, Any]:
        step, end = self._step, self._end
        return {
            "kind": "session",
            "title": self._title,
            "state": self._state,
            "pace": self._pace,
            "label": None if step is None else step.goal.label,
            "phase": None if step is None else step.phase,
            "gain": None if step is None else step.decision.get("predicted_gain"),
            "turned_down": {} if step is None else step.decision.get("turned_down", {}),
            "views": len(self._views),
            "most_views": self._most_views,
            "attempts": self._attempts,
            "last": self._last,
            "end": None if end is None else {"reason": end.reason.value, "sentence": end.sentence},
            "uploads": self._uploads,
            "drives": True,
        }


def jpeg(image: Grey) -> bytes | None:
    """Return an image as JPEG."""
    good, data = cv2.imencode(".jpg", image, [int(cv2.IMWRITE_JPEG_QUALITY), _QUALITY])
    return data.tobytes() if good else None


def picture_in(folder: Path | None, views: tuple[View, ...], name: str) -> bytes | None:
    """Return the picture that a folder keeps of a view as JPEG, None if it keeps none."""
    for view in views:
        if view.name == name and view.image is not None and folder is not None:
            try:
                return jpeg(read_image(folder / view.image))
            except InputError:
                return None
    return None


def _chosen(step: Step) -> str | None:
    """Return the name of the candidate that a step goes to."""
    if step.considered is None:
        return None
    for candidate in step.considered.pool.candidates:
        if candidate.T_base_flange == step.goal.T_base_flange:
            return candidate.name
    return None


def _added(
    known: tuple[tuple[int, float, float], ...], views: int, mm: float, deg: float
) -> tuple[tuple[int, float, float], ...]:
    return (*(row for row in known if row[0] < views), (views, mm, deg))


def _history(entries: tuple[Entry, ...]) -> tuple[tuple[int, float, float], ...]:
    """Return what was stated before each attempt of a session that goes on."""
    known: tuple[tuple[int, float, float], ...] = ()
    for index, entry in enumerate(entries):
        before = entry.decision.get("reach_before")
        if isinstance(before, dict) and {"translation_mm", "rotation_deg"} <= set(before):  # pyright: ignore[reportUnknownArgumentType]
            views = len(views_of(entries[:index]))
            known = _added(known, views, float(before["translation_mm"]), float(before["rotation_deg"]))  # pyright: ignore[reportUnknownArgumentType]
    return known
