"""Since which of many checks something has moved: one change of the mean of what the checks miss by.

What a calibration does not know is the same every night, and so is what the checks miss by for it, its
*bias*: no check by itself can tell that from a small shift, and all of them together look like one. What
shifts in between does not. With the misses whitened (their covariance the identity if nothing has moved,
less where the bias is a part of it), and the calibration itself as a first check that misses by nothing, the
statistic of a change after n of N checks is

    T_n = n (N - n) / N |mean_after - mean_before|^2

at most chi-square distributed with as many degrees of freedom as a check has numbers (Srivastava and Worsley,
"Likelihood ratio tests for a change in the multivariate normal mean", JASA 81, 1986).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from handeye.estimation.f_distribution import f_cumulative
from handeye.types.arrays import FloatArray

# A night is named where one of so many would be by chance in less than one log of a thousand.
NAMED = 1e-3


@dataclass(frozen=True)
class Change:
    """From which check on something had moved, if anything: its number from 0 on, and the chance of that."""

    first: int | None
    p_value: float


def change_of(misfits: ArrayLike) -> Change:
    """Return from which check on something had moved.

    What moved and was put back counts as in place, and one bad night among good ones does not count at all.

    Parameters
    ----------
    misfits
        (N, d) what each check misses by, in its time order: `Check.misfit`.

    Returns
    -------
    Change
        The likeliest first check after a shift; none where chance explains it.

    Examples
    --------
    >>> change_of([[0.1, -0.4], [0.3, 0.2], [9.0, 7.5], [8.2, 8.1]]).first
    2
    """
    found: FloatArray = np.asarray(misfits, np.float64)
    if not len(found):
        return Change(None, 1.0)
    count, size = found.shape
    known = np.vstack([np.zeros(size), found])
    best, value = 1, -1.0
    for first in range(1, count + 1):
        before, after = known[:first].mean(axis=0), known[first:].mean(axis=0)
        left = float(np.sum((known[:first] - before) ** 2) + np.sum((known[first:] - after) ** 2))
        # Noisier nights than the calibration expects show among themselves.
        spread = max(1.0, left / (size * max(count - 1, 1)))
        moved = first * (count + 1 - first) / (count + 1) * float(np.sum((after - before) ** 2))
        if moved / spread > value:
            best, value = first, moved / spread
    p_value = min(1.0, count * (1.0 - f_cumulative(value / size, size, np.inf)))
    before, after = known[:best].mean(axis=0), known[best:].mean(axis=0)
    last = known[-1]
    moved_away = float(after @ after) > float(before @ before)
    still_there = float(np.sum((last - after) ** 2)) < float(np.sum((last - before) ** 2))
    return Change(best - 1 if p_value < NAMED and moved_away and still_there else None, p_value)
