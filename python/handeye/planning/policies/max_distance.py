"""The paper's second baseline: as far away as possible."""

import numpy as np

from handeye.planning.policies.base import Choice, Policy, Situation


class MaxDistance(Policy):
    """Take the candidate whose nearest taken view is farthest away; the first of equals.

    The paper names the baseline without a formula. Distance is between positions of the flange in the base.
    """

    name = "max_distance"

    def choose(self, situation: Situation) -> Choice:
        """Return the feasible candidate farthest from all views taken."""
        taken = np.array([view.T_base_flange.translation for view in situation.views])
        distances = np.linalg.norm(situation.pool.positions[:, None] - taken, axis=2).min(axis=1)
        distances[np.isnan(situation.gains)] = -np.inf
        best = int(np.argmax(distances))
        return Choice(best, float(distances[best]))
