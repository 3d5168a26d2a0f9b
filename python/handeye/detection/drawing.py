"""What was found in an image, drawn over it."""

import textwrap

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.detection.base import Detection, Image, NotFound, affine
from handeye.types import Target
from handeye.types.arrays import FloatArray

# Blue, green, red.
_POINT, _X, _Y, _TEXT = (0, 170, 255), (60, 60, 230), (60, 200, 60), (40, 40, 255)
# Sides of the image for sizes of what is drawn.
SIZE, LETTER = 1 / 400, 1 / 1600
# So many names of points are drawn; of more, those at even distances.
MOST_NAMES = 60
# Length of the axes as a share of the target.
AXIS_SHARE = 0.3
# Positions are drawn to a 16th of a pixel.
_BITS = 4


def drawn_over(image: Image, target: Target | None, outcome: Detection | NotFound) -> NDArray[np.uint8]:
    """Return an image (H, W, 3), blue first, with points, their ids and the axes of the target.

    The x axis is red and the y axis green. Where nothing was found, the image says why.

    Parameters
    ----------
    image
        (H, W) grey values.
    target
        What was looked for; None for none.
    outcome
        What came of it.

    Examples
    --------
    >>> white = np.full((480, 640), 255, np.uint8)
    >>> drawn_over(white, board, detect(white, board)).shape
    (480, 640, 3)
    """
    picture = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    size = max(2, round(SIZE * max(image.shape)))
    if isinstance(outcome, NotFound) or target is None:
        _write(picture, outcome.evidence if isinstance(outcome, NotFound) else outcome.note)
        return picture
    for pixel in outcome.pixels:
        cv2.circle(picture, _fixed(pixel), size << _BITS, _POINT, max(1, size // 3), cv2.LINE_AA, _BITS)
    step = -(-len(outcome) // MOST_NAMES)
    for name, pixel in zip(outcome.point_ids[::step].tolist(), outcome.pixels[::step], strict=True):
        at = (round(float(pixel[0]) + size), round(float(pixel[1]) - size))
        cv2.putText(
            picture,
            str(name),
            at,
            cv2.FONT_HERSHEY_SIMPLEX,
            LETTER * max(image.shape) / 2,
            _TEXT,
            1,
            cv2.LINE_AA,
        )
    for axis, colour in zip(_axes(target, outcome), (_X, _Y), strict=True):
        start, end = (tuple(np.rint(place).astype(int).tolist()) for place in axis)
        cv2.arrowedLine(picture, start, end, colour, size, cv2.LINE_AA)
    if outcome.note:
        _write(picture, outcome.note)
    return picture


def _axes(target: Target, found: Detection) -> FloatArray:
    """Return start and end (2, 2, 2) of the x and the y axis in the image."""
    plane = target.points[found.point_ids, :2]
    length = AXIS_SHARE * float(np.ptp(target.points[:, :2], axis=0).max())
    ends = np.array([[0.0, 0.0], [length, 0.0], [0.0, length]])
    if len(plane) >= 4:
        lens = _core.PlaneMap.fitted(plane, found.pixels)
        if lens is not None:
            return lens.pixels(ends)[[[0, 1], [0, 2]]]
    A, b = affine(plane, found.pixels)
    return (ends @ A + b)[[[0, 1], [0, 2]]]


def _fixed(pixel: FloatArray) -> tuple[int, int]:
    x, y = np.rint(pixel * (1 << _BITS)).astype(int).tolist()
    return x, y


def _write(picture: NDArray[np.uint8], text: str) -> None:
    """Write words over the upper edge, in lines that fit."""
    height, width = picture.shape[:2]
    scale = max(0.4, LETTER * max(width, height))
    (letter, tall), _ = cv2.getTextSize("n", cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
    per_line = max(10, int(width / max(letter, 1)) - 2)
    plain = "".join(character if " " <= character <= "~" else "?" for character in text)
    for number, line in enumerate(textwrap.wrap(plain, per_line)):
        at = (tall, (number + 1) * 2 * tall)
        for colour, thick in (((255, 255, 255), 4), (_TEXT, 1)):
            cv2.putText(picture, line, at, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, thick, cv2.LINE_AA)
