"""Pictures that were flipped before the target was found in them."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from handeye.estimation.faults.kinds.base import Handling, Hypothesis, Kind
from handeye.estimation.measurements import Measurements
from handeye.types.recording import Recording
from handeye.types.view import View

KIND = Kind(
    "mirrored_pictures",
    "pictures flipped left to right or upside down",
    "A driver or a program flips the pictures, as for a selfie.",
    "A flipped picture shows a board that turns the other way: with the pixels flipped back all views agree.",
    Handling.REFUSED,
    "Look at a picture: letters that read from right to left are mirrored. Then switch the flip off "
    "(`ReverseX`, `cv2.flip`) and take the pictures again, or flip them back. Else the robot's frame is "
    "left-handed.",
    "writes nothing where a left-handed frame of the robot explains the views as well: only a look at a "
    "picture tells",
)
# What is done in pictures seldom, by this logarithm.
SELDOM = -2.0


def hypotheses(measurements: Measurements) -> Iterator[Hypothesis]:
    """Yield both ways to flip."""
    del measurements
    for axis, words in ((0, "left to right"), (1, "upside down")):
        yield Hypothesis(
            KIND,
            f"flipped_{'xy'[axis]}",
            f"the pictures are mirrored ({words})",
            "if letters in a picture read from right to left, switch the flip of the camera's driver off and "
            "take the pictures again, or flip them back; else turn one axis of the robot's poses round",
            partial(flipped, axis=axis),
            log_prior=SELDOM,
            is_mirror=True,
        )


def flipped(recording: Recording, axis: int) -> Recording:
    """Return a recording whose pixels are counted from the other side of the picture."""
    last = recording.camera.size_px[axis] - 1
    return recording.with_views(_flipped(view, axis, last) for view in recording.views)


def _flipped(view: View, axis: int, last: int) -> View:
    pixels = np.array(view.pixels)
    pixels[:, axis] = last - pixels[:, axis]
    return replace(view, pixels=pixels, image=None)
