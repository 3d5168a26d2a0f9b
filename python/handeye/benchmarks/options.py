"""What a run of the benchmarks is asked for."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Options:
    """How long, against whom, and from which seed.

    Parameters
    ----------
    budget_s
        Seconds for each method at each size.
    peers
        Whether other ways to the same answers are measured in the same run.
    quick
        The smallest sizes only: to see that all of it runs, not to measure.
    seed
        Of the made-up problems.
    """

    budget_s: float = 0.4
    peers: bool = True
    quick: bool = False
    seed: int = 0
