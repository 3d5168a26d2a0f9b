"""A page about views that are there already: an answer, or a plan; also of a run that only tells."""

from functools import partial
from pathlib import Path
from typing import Any

from handeye.robots import Arm
from handeye.types.calibration import ModelName
from handeye.ui import documents, rigs
from handeye.ui.documents import Shown
from handeye.ui.hub import Hub
from handeye.ui.links import links_of
from handeye.ui.live import picture_in
from handeye.ui.rigs import ShownRig


class Still:
    """Publishes what is known of a folder.

    Parameters
    ----------
    hub
        Where it is published.
    shown
        What is shown, until `show` puts something else in its place.
    folder
        Where the pictures of the views are.
    title
        Name of the recording.
    description
        File that describes the arm, for its shapes.
    """

    def __init__(
        self, hub: Hub, shown: Shown | ShownRig, folder: Path, title: str, description: str | None = None
    ) -> None:
        self._hub, self._folder, self._title = hub, folder, title
        arm = _arm(shown)
        links = [] if arm is None else links_of(arm, description)
        hub.publish("model", lambda: {"links": [link.to_dict() for link in links]})
        self.show(shown)

    def show(self, shown: Shown | ShownRig) -> None:
        """Show this from now on."""
        self._shown = shown
        self._hub.publish("status", self._status)
        made_by = rigs if isinstance(shown, ShownRig) else documents
        for name in ("scene", "candidates", "knowledge", "views", "picture"):
            self._hub.publish(name, partial(getattr(made_by, name), shown))

    def picture(self, number: int) -> bytes | None:
        """Return nothing: there is no last picture."""
        del number

    def view(self, name: str) -> dict[str, Any] | None:
        """Return what is drawn over the picture of a view."""
        shown = self._shown
        if isinstance(shown, ShownRig):
            return rigs.picture_of_view(shown, name)
        return documents.picture_of_view(shown, name)

    def view_picture(self, name: str) -> bytes | None:
        """Return the picture of a view as JPEG, None if the folder keeps none."""
        shown = self._shown
        found = shown.find(name) if isinstance(shown, ShownRig) else (shown, name)
        return None if found is None else picture_in(self._folder, found[0].views, found[1])

    def _status(self) -> dict[str, Any]:
        shown = self._shown
        several = isinstance(shown, ShownRig)
        model = ModelName.AUTO if several or shown.estimate is None else shown.estimate.model
        count = shown.stations if several else len(shown.views)
        return {
            "kind": "still",
            "unit": "station" if several else "view",
            "title": self._title,
            "state": "shown",
            "pace": "ask",
            "label": None,
            "phase": None,
            "gain": None,
            "turned_down": {},
            "cameras": len({camera for camera, _ in shown.parts}) if several else 1,
            "views": count,
            "most_views": None,
            "attempts": count,
            "last": None,
            "end": None,
            "uploads": False,
            "drives": False,
            "model": model.value,
        }


def _arm(shown: Shown | ShownRig) -> Arm | None:
    if isinstance(shown, ShownRig):
        return next((part.arm for part in shown.parts.values()), None)
    return shown.arm
