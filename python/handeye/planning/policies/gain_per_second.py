"""The candidate that teaches most for the time that it takes."""

import numpy as np

from handeye.planning.policies.base import Choice, Policy, Situation


class GainPerSecond(Policy):
    """Take the candidate with the largest gain per second of motion and view; the first of equals.

    Where nothing is known of times, it is the next-best-view policy.
    """

    name = "gain_per_second"

    def choose(self, situation: Situation) -> Choice:
        """Return the candidate with the largest gain per second."""
        gains = situation.gains
        rates = gains if situation.seconds is None else gains / situation.seconds
        best = int(np.nanargmax(rates))
        return Choice(best, float(rates[best]))
