"""Candidates in order of what they would teach, what is predicted after each, and why others cannot serve.

The prediction needs no image: the information of a candidate is known before it is taken. Under each
hypothesis about the robot's noise the covariance falls from the inverse of `Lambda` to that of `Lambda + I`
(paper, section IV). The averages of the two say by what share it falls, and that share is applied to the
covariance of the estimate, which also holds what the averaging adds.
"""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.estimation.estimate import Estimate
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.prediction import Prediction, Sight
from handeye.planning.visibility import obstacles
from handeye.types.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Prospect:
    """What is expected of one candidate.

    Parameters
    ----------
    candidate
        The robot pose.
    gain
        Gain by the criterion that was asked for.
    covariance
        (6, 6) covariance of the twist of X predicted after it.

    Examples
    --------
    >>> candidate = Candidate("left_high", recording.views[0].T_base_flange)
    >>> 1e3 * Prospect(candidate, 0.7, 1e-8 * np.eye(6)).sigma_translation_m
    0.17...
    """

    candidate: Candidate
    gain: float
    covariance: FloatArray

    @property
    def sigma_translation_m(self) -> float:
        """Predicted standard deviation of the camera's position: root of the sum of the three variances."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3])))

    @property
    def sigma_rotation_rad(self) -> float:
        """Predicted standard deviation of the camera's rotation: root of the sum of the three variances."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))


@dataclass(frozen=True, eq=False)
class Ranking:
    """All candidates of a pool.

    Parameters
    ----------
    prospects
        Feasible candidates, the best first; at most as many as were asked for.
    infeasible
        Name of each candidate that cannot be used, and why.
    feasible_count
        Number of feasible candidates, also those beyond the number asked for.

    Examples
    --------
    >>> from handeye import _core
    >>> pool = Pool.of_views(recording.views)
    >>> ranking = rank(estimate, pool, _core.Criterion("entropy"), Sight(known=True))
    >>> ranking.feasible_count
    9
    """

    prospects: tuple[Prospect, ...]
    infeasible: dict[str, str]
    feasible_count: int


def rank(
    estimate: Estimate,
    pool: Pool,
    criterion: _core.Criterion,
    sight: Sight | None = None,
    *,
    gains: FloatArray | None = None,
    top: int | None = None,
) -> Ranking:
    """Rank the candidates of a pool by gain; the first of equals stays first.

    Parameters
    ----------
    estimate
        What is believed now.
    pool
        Candidates.
    criterion
        What a view is worth.
    sight
        What a candidate must show of the target.
    gains
        (N,) gains of the candidates as a planner sees them; None for those of the estimate.
    top
        Number of prospects wanted; None for all.

    Raises
    ------
    DegenerateError
        The information of the views is singular.

    Examples
    --------
    >>> from handeye import _core
    >>> pool = Pool.of_views(recording.views)
    >>> best = rank(estimate, pool, _core.Criterion("entropy"), Sight(known=True), top=3).prospects
    >>> best[0].gain >= best[2].gain
    True
    """
    sight = sight or Sight()
    if len(pool) == 0:
        return Ranking((), {}, 0)
    motions = pool.motions(estimate.mounting)
    hidden = obstacles(estimate, motions, sight)
    prediction = Prediction(estimate, sight)
    if gains is None:
        gains = prediction.gains(criterion, motions, pool.joints)
    infeasible = {
        candidate.name: why or "the gain cannot be computed"
        for candidate, why, gain in zip(pool.candidates, hidden, gains, strict=True)
        if why is not None or np.isnan(gain)
    }
    usable = np.array([why is None for why in hidden]) & ~np.isnan(gains)
    order = [
        int(i) for i in np.argsort(-np.where(usable, gains, -np.inf), kind="stable")[: int(usable.sum())]
    ]
    chosen = order[:top]
    joints = None if pool.joints is None else pool.joints[chosen]
    covariances = prediction.covariances(motions[chosen], joints)
    prospects = tuple(
        Prospect(pool.candidates[i], float(gains[i]), covariance)
        for i, covariance in zip(chosen, covariances, strict=True)
    )
    return Ranking(prospects, infeasible, int(usable.sum()))
