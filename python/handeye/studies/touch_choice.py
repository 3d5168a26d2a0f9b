"""How good the best choice of views would be: what planning for the touch error could bring at most.

Nobody can choose like this, for it takes the estimate of all views for granted: how large each noise is,
where everything stands. Views are exchanged one by one (Fedorov, "Theory of Optimal Experiments", 1972)
until no exchange makes the predicted error smaller.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from handeye.estimation import Estimate, Measurements
from handeye.estimation.touch import touch_rows
from handeye.estimation.work import Work, lay_out
from handeye.planning.prediction import Prediction, Sight
from handeye.types.arrays import FloatArray

# What a prior teaches at least, as a share of all: it holds what no view shows.
_LEAST = 1e-9


@dataclass(frozen=True)
class ByHindsight:
    """Root mean square touch errors of choices of views, metres, as all views together foretell them."""

    of_choices: tuple[float, ...]
    best: float


def by_hindsight(
    estimate: Estimate,
    measurements: Measurements,
    work: Work,
    choices: Sequence[Sequence[int]],
    start: int,
) -> ByHindsight:
    """Foretell the touch errors of choices of equal size, and of the best choice there is.

    Parameters
    ----------
    estimate
        Of all views that could be chosen.
    measurements
        Those views.
    work
        What is seen and touched.
    choices
        Indices of the views of each choice.
    start
        How many of the first views every choice has.
    """
    foretold = _foretold(estimate, measurements, work)
    found = tuple(foretold(choice) for choice in choices)
    best = list(choices[int(np.argmin(found))])
    least = min(found)
    while True:
        exchanged = [
            [*best[:i], j, *best[i + 1 :]]
            for i in range(start, len(best))
            for j in range(len(measurements))
            if j not in best
        ]
        errors = [foretold(choice) for choice in exchanged]
        if not errors or min(errors) >= least:
            return ByHindsight(found, least)
        least, best = min(errors), exchanged[int(np.argmin(errors))]


def _foretold(estimate: Estimate, measurements: Measurements, work: Work) -> Callable[[Sequence[int]], float]:
    rows, noise = touch_rows(estimate, lay_out(estimate, measurements, work).touches)
    joints = None if estimate.arm is None else measurements.joints
    taught = Prediction(estimate, Sight(known=True)).informations(measurements.motions, joints)
    scale = np.sqrt(np.diag(estimate.information))
    taught = taught / np.outer(scale, scale)
    # What is left without any view: no less than nothing, though noise foretold is not quite that found.
    values, axes = np.linalg.eigh(estimate.information / np.outer(scale, scale) - taught.sum(axis=0))
    prior: FloatArray = (axes * np.maximum(values, _LEAST)) @ axes.T
    flat = rows.reshape(-1, rows.shape[2]) / scale
    always = float(np.trace(noise, axis1=1, axis2=2).mean())

    def error(chosen: Sequence[int]) -> float:
        information = prior + taught[list(chosen)].sum(axis=0)
        covariance = np.asarray(np.linalg.inv(information), np.float64)
        return float(np.sqrt(np.sum((flat @ covariance) * flat) / len(rows) + always))

    return error
