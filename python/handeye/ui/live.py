"""What every session tells, of one camera or of several, turned into documents for pages."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, TypeVar

import cv2

from handeye.cameras.protocol import Grey
from handeye.datasets.images import read_image
from handeye.detection import Detection
from handeye.errors import InputError
from handeye.estimation import Estimate
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Reading
from handeye.session import End, Entry, Observer, Step
from handeye.session.prepared import Prepared
from handeye.session.rig import RigEnd
from handeye.session.rig_prepared import RigPrepared
from handeye.session.store import Store
from handeye.types import View
from handeye.types.rig import CAMERA, TARGET
from handeye.ui.documents import Picture, Shown
from handeye.ui.hub import Hub
from handeye.ui.links import links_of
from handeye.ui.rigs import ShownRig

_QUALITY = 88
# Views or stations, and the radii in mm and deg that were stated after so many.
Curve = tuple[tuple[int, float, float], ...]

T = TypeVar("T", Shown, ShownRig)
S = TypeVar("S")


class LiveDashboard(Observer, ABC, Generic[T, S]):
    """Looks on while a session runs, and publishes what it sees into a hub.

    Parameters
    ----------
    hub
        Where it is published.
    """

    # Makes the documents out of what is shown, and what one attempt brings.
    made_by: ModuleType
    unit: str

    def __init__(self, hub: Hub) -> None:
        self.hub = hub
        self._lock = threading.Lock()
        self._shown: T | None = None
        self._title = "session"
        self._folder: Path | None = None
        self._pace = "ask"
        self._state = "preparing"
        self._step: Step | None = None
        self._end: End | RigEnd | None = None
        self._last: dict[str, Any] | None = None
        self._attempts = self._count = self._pictures = 0
        self._most_views = 0
        self._uploads = False
        self._publish("status")

    @abstractmethod
    def prepare(self, prepared: Any, store: Any) -> None:  # noqa: ANN401 - of one camera or of several
        """Show a cell before anything has happened in it, or where it was left."""

    @abstractmethod
    def decided(self, step: Any, session: S) -> None:  # noqa: ANN401 - of one camera or of several
        """Show what is to be done next, or that the session has ended."""

    @abstractmethod
    def _everywhere(self, shown: T, **values: Any) -> T:  # noqa: ANN401 - of Shown
        """Return what is shown with other values, of every camera."""

    @abstractmethod
    def _with_picture(self, shown: T, names: tuple[str, str], picture: Picture) -> T:
        """Return what is shown with the last picture of a camera and a target."""

    @abstractmethod
    def _last_picture(self, shown: T) -> Picture | None:
        """Return the last picture of all."""

    @abstractmethod
    def _views(self, shown: T, name: str) -> tuple[tuple[View, ...], str] | None:
        """Return the views among which one is by its name on the page, and its name there."""

    def _begin(self, prepared: Prepared | RigPrepared, store: Store, arm: Arm | None, shown: T) -> None:
        """Show this from now on."""
        configuration = prepared.configuration
        self._folder = store.folder
        self._uploads = configuration.images.startswith("folder:")
        self._most_views, self._attempts = configuration.most_views, len(store.entries)
        self._count = sum(entry.brought is not None for entry in store.entries)
        self._shown = shown
        links = [] if arm is None else links_of(arm, configuration.robot)
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
        self._move(standing=reading)
        self._publish("scene")

    def goes(self, goal: Goal) -> None:
        """Show where the arm goes."""
        self._state = "moving"
        self._move(goal=goal)
        self._publish("status", "scene")

    def looked(
        self,
        label: str,
        image: Grey | None,
        detection: Detection | None,
        names: tuple[str, str] = (CAMERA, TARGET),
    ) -> None:
        """Show what a camera saw; a picture without the target only where no other shows one."""
        shown = self._shown
        if shown is None:
            return
        last = self._last_picture(shown)
        if detection is None and last is not None and last.label == label and last.detection is not None:
            return
        self._pictures += 1
        with self._lock:
            standing = self._standing(self._shown or shown)
            picture = Picture(self._pictures, label, image, detection, standing)
            self._shown = self._with_picture(self._shown or shown, names, picture)
        self._publish("picture")

    def taken(self, entry: Entry, estimate: Estimate | None) -> None:
        """Show what an attempt brought."""
        del estimate
        self._attempts += 1
        failure = None if entry.failure is None else entry.failure.value
        self._last = {"label": entry.label, "failure": failure, "detail": entry.detail}
        if entry.brought is None and entry.withdraws is None:
            self.hub.say(f"{entry.label}: {failure}: {entry.detail}")
        self._state = "deciding"
        self._publish("status")

    # What the one who drives the session tells

    def waits(self, *, waits: bool) -> None:
        """Show whether the next motion waits for a person."""
        self._pace = "ask" if waits else "on"
        if self._end is None:
            self._state = "waiting" if waits else "deciding"
        self._publish("status")

    def _told(self, step: Step | End | RigEnd, shown: T, count: int) -> None:
        """Publish what was decided, and what is shown with it."""
        self._count = count
        if isinstance(step, Step):
            self._step, self._end = step, None
        else:
            self._step, self._end, self._state = None, step, "ended"
        with self._lock:
            self._shown = shown
        self._publish("status", "scene", "candidates", "knowledge", "views", "picture")

    # What pages ask for

    def picture(self, number: int) -> bytes | None:
        """Return the last picture, if it has that number, as JPEG."""
        last = None if self._shown is None else self._last_picture(self._shown)
        if last is None or last.image is None or last.number != number:
            return None
        return jpeg(last.image)

    def view(self, name: str) -> dict[str, Any] | None:
        """Return what is drawn over the picture of a view."""
        return None if self._shown is None else self.made_by.picture_of_view(self._shown, name)

    def view_picture(self, name: str) -> bytes | None:
        """Return the picture of a view as JPEG, None if there is none."""
        found = None if self._shown is None else self._views(self._shown, name)
        return None if found is None else picture_in(self._folder, *found)

    def _standing(self, shown: T) -> Any:  # noqa: ANN401 - a pose, or None
        part = shown if isinstance(shown, Shown) else next(iter(shown.parts.values()), None)
        return None if part is None or part.standing is None else part.standing.T_base_flange

    def _move(self, **values: Any) -> None:  # noqa: ANN401 - of Shown
        with self._lock:
            if self._shown is not None:
                self._shown = self._everywhere(self._shown, **values)

    @abstractmethod
    def _change(self, **values: Any) -> None:  # noqa: ANN401 - of T
        """Show other values."""

    def _publish(self, *names: str) -> None:
        shown = self._shown
        for name in names:
            if name == "status":
                status = self._status()
                self.hub.publish(name, lambda status=status: status)
            elif shown is not None:
                self.hub.publish(name, partial(getattr(self.made_by, name), shown))

    def _status(self) -> dict[str, Any]:
        step, end = self._step, self._end
        return {
            "kind": "session",
            "unit": self.unit,
            "title": self._title,
            "state": self._state,
            "pace": self._pace,
            "label": None if step is None else step.goal.label,
            "phase": None if step is None else step.phase,
            "gain": None if step is None else step.decision.get("predicted_gain"),
            "turned_down": {} if step is None else step.decision.get("turned_down", {}),
            "views": self._count,
            "most_views": self._most_views,
            "asked": None if self._shown is None else self._shown.asked,
            "attempts": self._attempts,
            "last": self._last,
            "end": None if end is None else {"reason": end.reason.value, "sentence": end.sentence},
            "uploads": self._uploads,
            "drives": True,
        }


def asked_of(prepared: Prepared | RigPrepared) -> tuple[float, float] | None:
    """Return the radii in mm and deg that are asked for, None without."""
    asked = prepared.configuration
    if asked.accuracy_mm is None or asked.accuracy_deg is None:
        return None
    return asked.accuracy_mm, asked.accuracy_deg


def added(known: Curve, count: int, mm: float, deg: float) -> Curve:
    """Return a curve with one more point, in place of those from there on."""
    return (*(row for row in known if row[0] < count), (count, mm, deg))


def jpeg(image: Grey) -> bytes | None:
    """Return an image as JPEG."""
    good, data = cv2.imencode(".jpg", image, [int(cv2.IMWRITE_JPEG_QUALITY), _QUALITY])
    return data.tobytes() if good else None


def picture_in(folder: Path | None, views: Sequence[View], name: str) -> bytes | None:
    """Return the picture that a folder keeps of a view as JPEG, None if it keeps none."""
    for view in views:
        if view.name == name and view.image is not None and folder is not None:
            try:
                return jpeg(read_image(folder / view.image))
            except InputError:
                return None
    return None
