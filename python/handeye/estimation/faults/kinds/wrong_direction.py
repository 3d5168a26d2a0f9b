"""Poses the wrong way round, or the camera not where it is said to sit."""

from collections.abc import Iterator

import numpy as np

from handeye.estimation.faults.kinds.base import Handling, Hypothesis, Kind, of_poses
from handeye.estimation.faults.stations import inverted
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting

KIND = Kind(
    "wrong_direction",
    "poses the wrong way round, or the other mounting",
    "The robot poses are those of the base in the flange, or the camera sits beside the robot where it was "
    "said to sit on the flange, or the other way round: the numbers are the same.",
    "With every pose inverted all views agree as well as a robot can; as given they do not.",
    Handling.REFUSED,
    "Set the mounting, or write the poses as `T_base_flange`, the flange as seen from the base.",
    "writes the poses inverted; where the camera is then nearer to the other body, sets the mounting instead",
)
INVERSE = (
    "the robot poses are those of the base in the flange (T_flange_base) where T_base_flange is expected"
)


def hypotheses(measurements: Measurements) -> Iterator[Hypothesis]:
    """Yield the inverse."""
    del measurements
    yield of_poses(
        KIND,
        "inverse",
        INVERSE,
        "invert the poses",
        inverted,
    )


def told(mounting: Mounting, X: FloatArray, Y: FloatArray) -> tuple[str, str, bool]:
    """Return sentence, hint and whether the mounting is blamed, with X and Y of the inverted poses.

    With the directions swapped the same numbers describe the other mounting. The nearer of camera and target
    is on the flange.
    """
    other = next(m for m in Mounting if m is not mounting)
    camera_nearer = bool(np.linalg.norm(X[:3, 3]) < np.linalg.norm(Y[:3, 3]))
    if camera_nearer == (mounting is Mounting.EYE_IN_HAND):
        hint = f"invert the poses, or set the mounting to {other.value}"
        return f"{INVERSE}; or the mounting is {other.value}", hint, False
    words = "sits in the room" if other is Mounting.EYE_TO_HAND else "sits on the flange"
    sentence = f"the camera {words} ({other.value}), not as given ({mounting.value}); or {INVERSE}"
    return sentence, f"set the mounting to {other.value}, or invert the poses", True
