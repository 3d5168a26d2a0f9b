"""The paper's policy: the candidate that teaches most."""

import numpy as np

from handeye.planning.policies.base import Choice, Policy, Situation
from handeye.types.arrays import FloatArray


class NextBestView(Policy):
    """Take the candidate with the largest gain; the first of equals.

    Yang, Rebello and Waslander (2023), eq. 14.
    """

    name = "next_best_view"

    def worth(self, gains: FloatArray, seconds: FloatArray | None) -> FloatArray:
        """Return the gains."""
        del seconds
        return gains

    def choose(self, situation: Situation) -> Choice:
        """Return the candidate with the largest gain."""
        best = int(np.nanargmax(situation.gains))
        return Choice(best, float(situation.gains[best]))
