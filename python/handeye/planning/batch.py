"""Several views at once: the best choice found, and a bound that no other choice can beat.

Taking the best single view again and again is greedy; here k views are chosen together, greedily from several
first views and then by exchange, before any of them is taken. The bound comes from the concavity of the
criterion (`handeye-core`, planning/certificate.rs): the gap is what better planning could still gain.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.estimate import Estimate, regular_information
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.prediction import Prediction, Sight
from handeye.types.arrays import FloatArray

OBJECTIVES = ("entropy", "entropy_handeye", "tool_point")


@dataclass(frozen=True, eq=False)
class BatchPlan:
    """k views chosen together.

    Parameters
    ----------
    candidates
        The views, in the order in which they were chosen.
    worth
        Value of the criterion after them: `ln |Lambda|`, `ln |Lambda| - ln |Lambda_nn|`, or minus the mean
        variance of the tool points in square metres.
    bound
        No choice of as many of these candidates has a larger worth.
    efficiency
        What of the bound is reached: the D-efficiency for entropies (geometric mean over parameters of the
        ratio of variances), the ratio of standard deviations for tool points.
    covariance
        (6, 6) covariance of the twist of X predicted after all of them.
    """

    candidates: tuple[Candidate, ...]
    worth: float
    bound: float
    efficiency: float
    covariance: FloatArray

    @property
    def sentence(self) -> str:
        """The certificate in words."""
        lost = 100 * (1 - self.efficiency)
        return (
            f"no choice of {len(self.candidates)} of these poses can beat this one by more than {lost:.2g} %"
        )


def plan_batch(
    estimate: Estimate,
    pool: Pool,
    count: int,
    *,
    objective: str = "entropy",
    tool_points_m: ArrayLike | None = None,
    sight: Sight | None = None,
) -> BatchPlan:
    """Choose `count` views of a pool together, at the likeliest noise of the robot.

    Parameters
    ----------
    estimate
        What is believed now.
    pool
        Candidates.
    count
        Number of views.
    objective
        One of `OBJECTIVES`.
    tool_points_m
        (P, 3) points in the camera frame, for `tool_point`.
    sight
        What a candidate must show of the target.

    Raises
    ------
    InputError
        An unknown objective, `tool_point` without points, or fewer feasible candidates than views asked for.
    DegenerateError
        No choice determines the answer.
    """
    if objective not in OBJECTIVES:
        raise InputError(
            f"objective {objective!r}, expected one of {', '.join(OBJECTIVES)}", code=Code.UNKNOWN_CRITERION
        )
    prediction = Prediction(estimate, sight or Sight())
    informations = prediction.informations(pool.motions(estimate.mounting), pool.joints)
    feasible = np.flatnonzero(np.trace(informations, axis1=1, axis2=2) > 0)
    if not 1 <= count <= len(feasible):
        raise InputError(
            f"{count} views of {len(feasible)} feasible candidates cannot be chosen",
            code=Code.TOO_FEW_CANDIDATES,
            hint="offer more candidates that show the target",
        )
    offered = informations[feasible]
    chosen, _ = _core.select_views(estimate.information, offered, count, objective, tool_points=tool_points_m)
    worth, bound, efficiency = _core.certify_views(
        estimate.information, offered, chosen, objective, tool_points=tool_points_m
    )
    total: FloatArray = estimate.information + np.sum(offered[chosen], axis=0)
    covariance = prediction.predicted(regular_information(total)[:6, :6])
    return BatchPlan(
        tuple(pool.candidates[int(feasible[i])] for i in chosen), worth, bound, efficiency, covariance
    )
