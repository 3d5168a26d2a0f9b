"""Every method on a folder of one's own: by how much the answers from disjoint halves of its views differ."""

from collections.abc import Callable
from typing import Any

import cv2

from handeye.codes import Code
from handeye.errors import HandeyeError, InputError
from handeye.estimation import Measurements
from handeye.studies.methods import methods
from handeye.types import Pose, Recording
from handeye.validation import metrics

# Each half must be solvable, with a view to spare.
FEWEST_VIEWS = 8


def study_halves(recording: Recording) -> dict[str, Any]:
    """Return, for every method, the difference of the camera between every other view and the rest.

    Without truth this is the fairest judge: an answer that bends to follow the arm's error does not agree
    with the one from other postures.

    Raises
    ------
    InputError
        Too few views.
    """
    measurements = Measurements.of_recording(recording)
    count = len(measurements)
    if count < FEWEST_VIEWS:
        raise InputError(
            f"{recording.name}: {count} usable views, at least {FEWEST_VIEWS} are needed",
            code=Code.TOO_FEW_VIEWS,
        )
    halves = [measurements.select(range(first, count, 2)) for first in range(2)]
    return {
        "name": recording.name,
        "views": count,
        "methods": {name: _difference(method, halves) for name, method in methods().items()},
    }


def _difference(
    method: Callable[[Measurements], Pose], halves: list[Measurements]
) -> dict[str, float | None]:
    try:
        first, second = (method(half) for half in halves)
        difference = metrics.absolute_error(first, second)
    except (HandeyeError, cv2.error):
        return {"translation_mm": None, "rotation_deg": None}
    return {"translation_mm": difference.translation_mm, "rotation_deg": difference.rotation_deg}
