"""Where a target is expected in an image, and whether it is there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from handeye.codes import Code
from handeye.detection.base import Image
from handeye.detection.registration import Aligned, aligned
from handeye.errors import InputError
from handeye.types import Target
from handeye.types.arrays import FloatArray

# Fewer points say too little of where the others are.
FEWEST_POINTS = 4


@dataclass(frozen=True, eq=False, init=False)
class Prediction:
    """Where the points of a target are expected.

    Parameters
    ----------
    pixels
        (P, 2) one for each point of the target; NaN for points that the lens does not see. Places outside
        the image are fine.
    margin_px
        How far off the prediction may be: from the accuracy of whatever predicts. Too small a margin costs
        time, not views.

    Raises
    ------
    InputError
        Wrong shapes, or a margin below zero.

    Examples
    --------
    >>> Prediction(np.zeros((len(board.points), 2)), margin_px=20.0).margin_px
    20.0
    """

    pixels: FloatArray
    margin_px: float

    def __init__(self, pixels: ArrayLike, margin_px: float) -> None:
        places = np.array(pixels, dtype=np.float64)
        if places.ndim != 2 or places.shape[1] != 2 or not margin_px >= 0:
            raise InputError(
                f"prediction: pixels of shape {places.shape} and a margin of {margin_px} px, expected (P, 2) "
                "and at least zero",
                code=Code.WRONG_SHAPE,
            )
        places[~np.isfinite(places).all(axis=1)] = np.nan
        places.flags.writeable = False
        object.__setattr__(self, "pixels", places)
        object.__setattr__(self, "margin_px", float(margin_px))


def where_expected(image: Image, target: Target, prediction: Prediction) -> Aligned | None:
    """Return where a target lies if something like it is where it is expected, None else.

    Raises
    ------
    InputError
        As many places are needed as the target has points.
    """
    if len(prediction.pixels) != target.point_count:
        raise InputError(
            f"prediction: {len(prediction.pixels)} pixels for {target.point_count} points of the target",
            code=Code.WRONG_SHAPE,
        )
    seen = np.isfinite(prediction.pixels[:, 0])
    if seen.sum() < FEWEST_POINTS:
        return None
    return aligned(image, target, target.points[seen, :2], prediction.pixels[seen], prediction.margin_px)
