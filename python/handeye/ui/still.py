"""A page about views that are there already: an answer, or a plan."""

from functools import partial
from pathlib import Path
from typing import Any

from handeye.types.calibration import ModelName
from handeye.ui import documents
from handeye.ui.dashboard import picture_in
from handeye.ui.documents import Shown
from handeye.ui.hub import Hub
from handeye.ui.links import links_of


class Still:
    """Publishes what is known of a folder once; nothing changes afterwards.

    Parameters
    ----------
    hub
        Where it is published.
    shown
        What is shown.
    folder
        Where the pictures of the views are.
    title
        Name of the recording.
    description
        File that describes the arm, for its shapes.
    """

    def __init__(
        self, hub: Hub, shown: Shown, folder: Path, title: str, description: str | None = None
    ) -> None:
        self._shown, self._folder = shown, folder
        links = [] if shown.arm is None else links_of(shown.arm, description)
        hub.publish("model", lambda: {"links": [link.to_dict() for link in links]})
        hub.publish("status", lambda: self._status(title))
        for name in ("scene", "candidates", "knowledge", "views", "picture"):
            hub.publish(name, partial(getattr(documents, name), shown))

    def picture(self, number: int) -> bytes | None:
        """Return nothing: there is no last picture."""
        del number

    def view(self, name: str) -> dict[str, Any] | None:
        """Return what is drawn over the picture of a view."""
        return documents.picture_of_view(self._shown, name)

    def view_picture(self, name: str) -> bytes | None:
        """Return the picture of a view as JPEG, None if the folder keeps none."""
        return picture_in(self._folder, self._shown.views, name)

    def _status(self, title: str) -> dict[str, Any]:
        shown = self._shown
        model = ModelName.AUTO if shown.estimate is None else shown.estimate.model
        return {
            "kind": "still",
            "title": title,
            "state": "shown",
            "pace": "ask",
            "label": None,
            "phase": None,
            "gain": None,
            "turned_down": {},
            "views": len(shown.views),
            "most_views": None,
            "attempts": len(shown.views),
            "last": None,
            "end": None,
            "uploads": False,
            "drives": False,
            "model": model.value,
        }
