"""Robot poses and images that agree under no reading."""

import numpy as np

from handeye.errors import InputError
from handeye.estimation.faults.kinds.base import Handling, Kind

KIND = Kind(
    "inconsistent",
    "robot poses and images agree under no reading",
    "Several mistakes at once, or one that is not in this list.",
    "Fewer than half of the views agree within what an arm that works can be off by, however they are read.",
    Handling.REFUSED,
    "Check which pose belongs to which image, the unit and order of the numbers, the size of the target and "
    "the camera's calibration.",
)


def error(agreeing: int, count: int, translation_m: float, rotation_rad: float) -> InputError:
    """Return the error, with how far apart the views are."""
    return InputError(
        f"the robot poses and the images do not agree under any reading: {agreeing} of "
        f"{count} views within {translation_m * 1e3:.3g} mm and {np.rad2deg(rotation_rad):.2g} deg",
        code=KIND.code,
        hint="check which pose belongs to which image, the unit and the order of the numbers, the size "
        "of the target and the camera's calibration",
    )
