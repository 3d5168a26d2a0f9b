"""Timing methods against each other: in turns, so that a busy machine is busy for all of them.

What is measured is the time that the processor spent on this process, with all its threads: on a machine with
other work the clock on the wall also counts the waiting, most of all for the slow.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

# A method's turn: long enough for caches and clock to settle on it, short enough for many turns.
TURN_S = 0.02
FEWEST_RUNS = 3


@dataclass(frozen=True)
class Timing:
    """Processor times of the calls of one method, in seconds."""

    median_s: float
    low_s: float
    high_s: float
    fastest_s: float
    runs: int

    @classmethod
    def of(cls, times_s: "list[float]") -> "Timing":
        """Sum up the times of some calls: median, quartiles and the fastest."""
        low, median, high = np.quantile(times_s, [0.25, 0.5, 0.75])
        return cls(float(median), float(low), float(high), min(times_s), len(times_s))

    def to_dict(self, per: int = 1) -> dict[str, Any]:
        """Return plain values for JSON in microseconds, per one of `per` things done in a call."""
        scale = 1e6 / per
        return {
            "median_us": self.median_s * scale,
            "low_us": self.low_s * scale,
            "high_us": self.high_s * scale,
            "fastest_us": self.fastest_s * scale,
            "runs": self.runs,
        }


def interleave(
    methods: Mapping[str, Callable[[], object]],
    budget_s: float,
    clock: Callable[[], float] = time.process_time,
) -> dict[str, Timing]:
    """Time every method for about `budget_s` seconds, in turns of hundredths; each is called once before.

    A method that takes longer is called three times all the same.

    Parameters
    ----------
    clock
        Seconds; the processor's unless given.
    """
    times: dict[str, list[float]] = {name: [] for name in methods}
    spent = dict.fromkeys(methods, 0.0)
    for method in methods.values():
        method()
    while waiting := [name for name in methods if spent[name] < budget_s or len(times[name]) < FEWEST_RUNS]:
        for name in waiting:
            method, turn = methods[name], 0.0
            while turn < TURN_S:
                began = clock()
                method()
                elapsed = clock() - began
                times[name].append(elapsed)
                turn += elapsed
            spent[name] += turn
    return {name: Timing.of(found) for name, found in times.items()}
