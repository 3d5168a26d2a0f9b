"""A drawing as PDF, written by matplotlib: vectors and embedded fonts, one page."""

from io import BytesIO
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Affine2D

from handeye.printing.shapes import Area, Disc, Drawing, Shape, Words, printable
from handeye.types.arrays import FloatArray

MM_PER_INCH = 25.4
POINTS_PER_INCH = 72.0
_ANCHORS: dict[str, Literal["left", "center", "right"]] = {
    "start": "left",
    "middle": "center",
    "end": "right",
}


def pdf(drawing: Drawing) -> bytes:
    """Return the file; the same drawing gives the same bytes."""
    content = BytesIO()
    settings: Any = {"path.simplify": False, "path.snap": False, "pdf.fonttype": 42, "text.usetex": False}
    with mpl.rc_context(settings):  # pyright: ignore[reportUnknownMemberType]
        size = (drawing.width_mm / MM_PER_INCH, drawing.height_mm / MM_PER_INCH)
        figure = Figure(figsize=size, frameon=False)
        # From millimetres with y down to the units of the figure, which a page of PDF turns into points.
        to_sheet = Affine2D().scale(1 / drawing.width_mm, -1 / drawing.height_mm).translate(0, 1)
        transform = to_sheet + figure.transFigure
        paths = [_path(shape) for shape in drawing.shapes if not isinstance(shape, Words)]
        if paths:
            ink = Path.make_compound_path(*paths)
            figure.add_artist(PathPatch(ink, facecolor="black", linewidth=0, transform=transform))
        for words in drawing.shapes:
            if isinstance(words, Words):
                figure.add_artist(_text(words, transform))
        metadata = {"Title": printable(drawing.title), "Creator": "handeye", "CreationDate": None}
        figure.savefig(content, format="pdf", metadata=metadata)  # pyright: ignore[reportUnknownMemberType]
    return content.getvalue()


def _text(words: Words, transform: Any) -> Text:  # noqa: ANN401 - matplotlib is typed in part
    return Text(
        words.x,
        words.y,
        printable(words.text),
        fontsize=words.size / MM_PER_INCH * POINTS_PER_INCH,
        horizontalalignment=_ANCHORS[words.anchor],
        verticalalignment="baseline",
        fontweight="bold" if words.bold else "normal",
        parse_math=False,
        transform=transform,
    )


def _path(shape: Shape) -> Path:
    if isinstance(shape, Disc):
        return Path.circle((shape.x, shape.y), shape.radius)
    if isinstance(shape, Area):
        return Path.make_compound_path(*(_closed(loop) for loop in shape.loops))
    if isinstance(shape, Words):
        raise TypeError("words have no path")
    along = np.array([shape.x2 - shape.x1, shape.y2 - shape.y1])
    across = np.array([-along[1], along[0]]) / np.linalg.norm(along) * shape.width / 2
    ends = np.array([[shape.x1, shape.y1], [shape.x2, shape.y2]])
    return _closed(np.vstack([ends + across, ends[::-1] - across]))


def _closed(loop: FloatArray) -> Path:
    return Path(np.vstack([loop, loop[:1]]), closed=True)
