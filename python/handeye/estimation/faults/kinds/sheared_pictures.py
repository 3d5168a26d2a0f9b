"""Pictures that are sheared: every row shifted against the one before."""

from dataclasses import replace

import numpy as np

from handeye.errors import HandeyeError
from handeye.estimation.faults.kinds.base import Handling, Kind, as_recording
from handeye.estimation.faults.recalibration import median_px
from handeye.estimation.measurements import Measurements
from handeye.types.recording import Recording
from handeye.types.view import View

KIND = Kind(
    "pictures_sheared",
    "sheared pictures",
    "A wrong stride or row length when frames were read, or a transformation that was no camera's.",
    "The board's points fit a pose only after rows are shifted back in proportion to their height.",
    Handling.REFUSED,
    "Read the frames with the right row length; take the pictures again.",
    "writes the points where they are with the rows shifted back; pictures themselves are left out",
)
LARGEST = 0.4
TRIED, ROUNDS = 9, 7
# A shear shows in that a small one the same way brings the residual down to this share.
PROBE, PROBE_SHARE = 0.005, 0.98


def sheared(recording: Recording, shear: float) -> Recording:
    """Return a recording with u moved by `shear` times the height above the middle row."""
    middle = 0.5 * (recording.camera.height_px - 1)
    return recording.with_views(_sheared(view, shear, middle) for view in recording.views)


def _sheared(view: View, shear: float, middle: float) -> View:
    pixels = np.array(view.pixels)
    pixels[:, 0] += shear * (pixels[:, 1] - middle)
    return replace(view, pixels=pixels, image=None)


def find_shear(measurements: Measurements) -> tuple[float, float]:
    """Return the shear that the pictures ask for, and the median residual that is left."""
    given = as_recording(measurements)

    def left(shear: float) -> float:
        try:
            return median_px(Measurements.of_recording(sheared(given, shear)))
        except HandeyeError:
            return float("inf")  # Points beyond the picture.

    best = (median_px(measurements), 0.0)
    nearby = min((left(shear), shear) for shear in (-PROBE, PROBE))
    if nearby[0] > PROBE_SHARE * best[0]:
        return 0.0, best[0]
    width, centre = 0.5 * LARGEST, 0.5 * LARGEST * float(np.sign(nearby[1]))
    for _ in range(ROUNDS):
        tried = (centre + np.linspace(-width, width, TRIED)).tolist()
        best = min(best, *((left(shear), shear) for shear in tried))
        centre, width = best[1], 2 * width / (TRIED - 1)
    return best[1], best[0]
