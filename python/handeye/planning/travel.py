"""How long the arm takes from one posture to another, on the straight line in joint space."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, finite_array

# An arm is at full speed after so long, and stands, looks and detects for so long at each view.
RAMP_S, LOOK_S = 0.25, 1.0


@dataclass(frozen=True, eq=False)
class Travel:
    """From where the arm stands, and how fast it may move.

    Parameters
    ----------
    start
        (n,) joint positions where it stands.
    velocities
        (n,) largest speed of each joint per second.
    ramp_s
        Time in which a joint comes to its largest speed from rest, and back.
    look_s
        What a view takes besides the way there.

    Raises
    ------
    InputError
        A speed or a time that is not above zero.
    """

    start: FloatArray
    velocities: FloatArray
    ramp_s: float = RAMP_S
    look_s: float = LOOK_S

    def __post_init__(self) -> None:
        start = finite_array(self.start, (None,), "travel: start")
        velocities = finite_array(self.velocities, (len(start),), "travel: velocities")
        if (velocities <= 0).any() or min(self.ramp_s, self.look_s) <= 0:
            raise InputError("travel: speeds and times above zero are expected", code=Code.OUT_OF_RANGE)
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "velocities", velocities)

    def seconds(self, joints: ArrayLike) -> FloatArray:
        """(N,) duration of the motion to each posture (N, n) and of the view there.

        Each joint speeds up and slows down evenly and is held back to arrive with the slowest.
        """
        share = np.abs(np.asarray(joints, dtype=np.float64) - self.start) / self.velocities
        # Long ways reach full speed: distance / speed + ramp; short ones do not.
        each = np.where(share > self.ramp_s, share + self.ramp_s, 2 * np.sqrt(share * self.ramp_s))
        return each.max(axis=1) + self.look_s
