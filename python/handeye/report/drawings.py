"""The pictures with what was found drawn over them, small enough for the page."""

import base64
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from handeye.datasets.image_header import IMAGE_SUFFIXES
from handeye.datasets.images import read_image
from handeye.detection import Detection, NotFound, Reason, drawn_over
from handeye.errors import HandeyeError
from handeye.importing import Opened

# Longer side of a drawing in pixels, its quality as JPEG, and the most of them on a page.
SIDE_PX, QUALITY, MOST = 800, 80, 60


@dataclass(frozen=True)
class Drawing:
    """A picture with what was found.

    Attributes
    ----------
    name, note
        Of the view, and what there is to say about it.
    uri
        The drawing itself, as a data URI.
    """

    name: str
    note: str
    uri: str


def drawings_of(opened: Opened) -> tuple[Drawing, ...]:
    """Return the pictures of a recording that are kept, those without the target first; at most `MOST`."""
    target = opened.recording.target
    wanted: list[tuple[str, Path, Detection | NotFound]] = []
    for name, why in opened.missed.items():
        for path in (opened.folder / name, opened.folder / "images" / name):
            if path.suffix.lower() in IMAGE_SUFFIXES and path.is_file():
                wanted.append((name, path, NotFound(Reason.NO_PATTERN, why)))
                break
    for view in opened.recording.views:
        if view.image is not None:
            found = Detection(view.point_ids, view.pixels)
            wanted.append((view.name, opened.folder / view.image, found))
    made: list[Drawing] = []
    for name, path, outcome in wanted[:MOST]:
        try:
            picture = drawn_over(read_image(path), target, outcome)
        except HandeyeError as error:
            made.append(Drawing(name, error.message, ""))
            continue
        scale = min(1.0, SIDE_PX / max(picture.shape))
        small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        content = np.asarray(cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1]).tobytes()
        note = outcome.evidence if isinstance(outcome, NotFound) else f"{len(outcome)} points"
        made.append(Drawing(name, note, f"data:image/jpeg;base64,{base64.b64encode(content).decode()}"))
    return tuple(made)
