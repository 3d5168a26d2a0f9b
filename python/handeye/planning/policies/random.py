"""The paper's first baseline: any candidate."""

from handeye.planning.policies.base import Choice, Policy, Situation


class Random(Policy):
    """Take a feasible candidate at random, all with the same probability."""

    name = "random"

    def choose(self, situation: Situation) -> Choice:
        """Return a feasible candidate at random."""
        feasible = situation.feasible
        return Choice(int(feasible[situation.random.integers(len(feasible))]), 0.0)
