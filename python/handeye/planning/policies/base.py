"""What every policy is asked, and what it answers."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from handeye.planning.candidates import Pool
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.view import View


@dataclass(frozen=True, eq=False)
class Situation:
    """Everything that a policy may look at.

    Parameters
    ----------
    views
        Views taken so far.
    pool
        Candidates left, at least one.
    gains
        (N,) gain of each candidate; NaN where too little of the target would be in sight.
    random
        The planner's own source of chance.
    seconds
        (N,) what each candidate takes, motion and view; None where that is not known.
    """

    views: Sequence[View]
    pool: Pool
    gains: FloatArray
    random: np.random.Generator
    seconds: FloatArray | None = None

    @property
    def feasible(self) -> IndexArray:
        """(M,) indices of the candidates that show enough of the target."""
        return np.flatnonzero(~np.isnan(self.gains)).astype(np.int64)


@dataclass(frozen=True)
class Choice:
    """The candidate chosen, by its index in the pool, and the score that decided."""

    index: int
    score: float


class Policy(ABC):
    """Chooses one of the feasible candidates.

    Examples
    --------
    >>> isinstance(make_policy("next_best_view"), Policy)
    True
    """

    name: ClassVar[str]

    def worth(self, gains: FloatArray, seconds: FloatArray | None) -> FloatArray | None:
        """(N,) what candidates are worth by their gains and times; None if that is not what decides."""
        del gains, seconds
        return None

    @abstractmethod
    def choose(self, situation: Situation) -> Choice:
        """Return the candidate to take; there is at least one feasible one."""
