"""Looking at drawings: what is black where, and as a picture."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.printing.shapes import Area, Disc, Drawing, Line, Shape
from handeye.types.arrays import FloatArray


def is_inside(loops: Sequence[FloatArray], places: FloatArray) -> NDArray[np.bool_]:
    """Tell which places (N, 2) closed loops wind around (the nonzero rule)."""
    winding = np.zeros(len(places), dtype=int)
    for loop in loops:
        for (x1, y1), (x2, y2) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            crosses = (y1 <= places[:, 1]) != (y2 <= places[:, 1])
            if not crosses.any():
                continue
            at = x1 + (places[:, 1] - y1) / (y2 - y1) * (x2 - x1)
            winding += np.where(crosses & (at > places[:, 0]), 1 if y2 > y1 else -1, 0)
    return winding != 0


def is_black(shapes: Sequence[Shape], places: FloatArray) -> NDArray[np.bool_]:
    """Tell which places (N, 2) in mm are black, lines and words aside."""
    black = np.zeros(len(places), dtype=bool)
    for shape in shapes:
        if isinstance(shape, Area):
            black |= is_inside(shape.loops, places)
        elif isinstance(shape, Disc):
            black |= np.hypot(*(places - [shape.x, shape.y]).T) < shape.radius
    return black


def picture(drawing: Drawing, pixels_per_mm: int, around_mm: int = 10) -> NDArray[np.uint8]:
    """Return a grey picture of a drawing on a darker table; (0, 0) mm is at `around_mm`, in pixel units of edges."""
    oversampling, shift = 4, 8
    scale = pixels_per_mm * oversampling
    width, height = (round((side + 2 * around_mm) * scale) for side in (drawing.width_mm, drawing.height_mm))
    canvas = np.full((height, width), 110, np.uint8)

    def place(points: Sequence[float] | FloatArray) -> NDArray[np.int32]:
        # From edges of pixels to their centres, which OpenCV counts from.
        return np.rint(((np.asarray(points) + around_mm) * scale - 0.5) * 2**shift).astype(np.int32)

    sheet = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [drawing.width_mm, drawing.height_mm]
    cv2.fillPoly(canvas, [place(sheet)], 215, cv2.LINE_8, shift)
    for shape in drawing.shapes:
        if isinstance(shape, Area):
            cv2.fillPoly(canvas, [place(loop) for loop in shape.loops], 25, cv2.LINE_8, shift)
        elif isinstance(shape, Disc):
            centre = place([shape.x, shape.y]).tolist()
            cv2.circle(canvas, centre, round(shape.radius * scale * 2**shift), 25, -1, cv2.LINE_8, shift)
        elif isinstance(shape, Line):
            ends = place([[shape.x1, shape.y1], [shape.x2, shape.y2]]).tolist()
            cv2.line(canvas, ends[0], ends[1], 25, max(1, round(shape.width * scale)), cv2.LINE_8, shift)
        else:
            at = (np.array([shape.x, shape.y]) + around_mm) * scale
            cv2.putText(
                canvas, shape.text, at.astype(int).tolist(), 0, shape.size * scale / 22, 25, 2 * oversampling
            )
    return cv2.resize(canvas, None, fx=1 / oversampling, fy=1 / oversampling, interpolation=cv2.INTER_AREA)
