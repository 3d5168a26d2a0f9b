"""The candidate that teaches most for the time that it takes."""

import numpy as np

from handeye.planning.policies.base import Choice, Policy, Situation
from handeye.types.arrays import FloatArray


class GainPerSecond(Policy):
    """Take the candidate with the largest gain per second of motion and view; the first of equals.

    Where nothing is known of times, it is the next-best-view policy.
    """

    name = "gain_per_second"

    def worth(self, gains: FloatArray, seconds: FloatArray | None) -> FloatArray:
        """Return the gains per second."""
        return gains if seconds is None else gains / seconds

    def choose(self, situation: Situation) -> Choice:
        """Return the candidate with the largest gain per second."""
        rates = self.worth(situation.gains, situation.seconds)
        best = int(np.nanargmax(rates))
        return Choice(best, float(rates[best]))
