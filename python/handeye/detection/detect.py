"""Find a target of any family in an image."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from handeye.codes import Code
from handeye.detection import charuco, chessboard, circle_grid, tags
from handeye.detection.base import Detection, Image, NotFound, Reason, upright
from handeye.detection.description import explained
from handeye.detection.plausible import implausible
from handeye.detection.predicted import Prediction, where_expected
from handeye.detection.registration import Aligned
from handeye.errors import InputError
from handeye.types import Charuco, Chessboard, CircleGrid, Target
from handeye.types.target import MarkerCorners

SMALLEST_SIDE_PX = 24
# To be raised with every change of what is detected, or where.
VERSION = 12


@dataclass(frozen=True)
class Kind:
    """How one kind of points is found: anywhere, and where it is expected."""

    targets: type[Target]
    find: Callable[[Image, Any], Detection | NotFound]
    confirm: Callable[[Image, Any, Aligned], Detection | None]


KINDS = (
    Kind(Chessboard, chessboard.find, chessboard.confirm),
    Kind(CircleGrid, circle_grid.find, circle_grid.confirm),
    Kind(Charuco, charuco.find, charuco.confirm),
    Kind(MarkerCorners, tags.find, tags.confirm),
)


def detect(image: Image, target: Target, *, predicted: Prediction | None = None) -> Detection | NotFound:
    """Find the points of a target in a grey image.

    With a prediction the target is looked for where it should be first, and in the whole image only if it is
    not there or if what is there may not be it.

    Parameters
    ----------
    image
        (H, W) uint8, as `handeye.datasets.images.read_image` gives it.
    target
        What to look for.
    predicted
        Where it should be, if anything is known of that.

    Returns
    -------
    Detection or NotFound
        Chessboards and circle grids are found whole or not at all; boards with markers also in part. Labels
        are those of the target, up to its symmetries; no board is ever labeled as if seen in a mirror.

    Raises
    ------
    InputError
        Not a grey image of bytes, a family of targets for which there is no detector, or a prediction for
        another number of points.

    Examples
    --------
    >>> import numpy as np
    >>> from handeye.types import Chessboard
    >>> detect(np.full((480, 640), 255, np.uint8), Chessboard(6, 9, 0.025)).reason.value
    'overexposed'
    """
    kind = next((kind for kind in KINDS if isinstance(target, kind.targets)), None)
    if kind is None:
        raise InputError(f"target: no detector for the family {target.family}", code=Code.UNKNOWN_TARGET)
    if image.ndim != 2 or image.dtype != np.uint8:
        raise InputError(
            f"image: shape {image.shape} of {image.dtype}, expected grey values (height, width) of uint8",
            code=Code.WRONG_SHAPE,
            hint="read it with handeye.datasets.images.read_image, or convert it to grey",
        )
    if min(image.shape) < SMALLEST_SIDE_PX:
        height, width = image.shape
        return NotFound(Reason.IMAGE_TOO_SMALL, f"the image has only {width} x {height} pixels")
    whole, positive = upright(np.ascontiguousarray(image), target)
    if predicted is not None:
        found = _where_predicted(whole, positive, kind, predicted)
        if found is not None and implausible(target, found) is None:
            return found
    try:
        found = kind.find(whole, positive)
        if isinstance(found, NotFound):
            found = explained(image, target, found)
        return found if isinstance(found, NotFound) else implausible(target, found) or found
    except cv2.error as error:
        # OpenCV asserts on some contents; to the caller that is one image without a target, not a crash.
        return NotFound(Reason.DETECTOR_FAILED, f"OpenCV: {str(error).strip()[:200]}")


def _where_predicted(image: Image, target: Target, kind: Kind, predicted: Prediction) -> Detection | None:
    """Return what is found where it is expected, None if the whole image is to be looked at."""
    try:
        board = where_expected(image, target, predicted)
        return None if board is None else kind.confirm(image, target, board)
    except cv2.error:
        return None
