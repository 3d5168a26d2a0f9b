"""A board that is larger or smaller than stated."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from handeye.estimation.faults.kinds.base import Handling, Hypothesis, Kind
from handeye.estimation.faults.kinds.wrong_unit import larger
from handeye.estimation.faults.scale import scale_of
from handeye.estimation.measurements import Measurements
from handeye.types.recording import Recording

KIND = Kind(
    "board_size",
    "a board of another size than stated",
    "The size of squares, circles or markers was stated wrongly, or the printer scaled the page.",
    "Rotations agree and lengths differ by a factor that is no unit's.",
    Handling.REFUSED,
    "Measure the printed board over many squares, and state that.",
    "writes the size that the robot's motions say, which is as true as the robot is",
)
# Nearer to one the scale of the board is a parameter of the estimate.
SMALLEST_ERROR = 0.01
# Views that hardly turn say anything of its size.
LARGEST_FACTOR = 30.0
# A factor of any value is less probable beforehand than a unit's, by this logarithm.
ANY_SCALE = -8.0


# The motions' size leans to one side where noise of the rotations is mistaken for a change of distance: parts
# of the way to it are tried too.
SHARES = (1.0, 0.75, 0.5)


def hypotheses(measurements: Measurements, smallest: float = SMALLEST_ERROR) -> Iterator[Hypothesis]:
    """Yield sizes of the board that fit the robot's motions, where they are off by `smallest` or more."""
    whole = scale_of(measurements)
    if whole is None or not math.log1p(smallest) <= abs(math.log(whole)) < math.log(LARGEST_FACTOR):
        return
    for share in SHARES:
        yield _of_size(whole**share)


def _of_size(factor: float) -> Hypothesis:
    return Hypothesis(
        KIND,
        "size",
        f"the target is {factor:.4g} times as large as stated, going by the robot's motions",
        "is the size of the squares, circles or markers right, and the unit of the poses?",
        partial(_larger, factor=factor),
        log_prior=ANY_SCALE,
        log_unit=3 * math.log(factor),
    )


def _larger(recording: Recording, factor: float) -> Recording:
    return replace(recording, target=larger(recording.target, factor))
