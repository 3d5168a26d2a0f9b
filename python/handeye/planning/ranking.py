"""Candidates in order of what they would teach, what is predicted after each, and why others cannot serve.

The prediction needs no image: the information of a candidate is known before it is taken. Under each
hypothesis about the robot's noise the covariance falls from the inverse of `Lambda` to that of `Lambda + I`
(paper, section IV). The averages of the two say by what share it falls, and that share is applied to the
covariance of the estimate, which also holds what the averaging adds.
"""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.errors import DegenerateError
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.visibility import obstacles
from handeye.solving.estimate import Estimate, Sight
from handeye.types.arrays import FloatArray

# Candidates whose covariances are held in memory at a time.
_BATCH = 1000


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
    """
    sight = sight or Sight()
    if len(pool) == 0:
        return Ranking((), {}, 0)
    motions = pool.motions(estimate.mounting)
    hidden = obstacles(estimate, motions, sight)
    if gains is None:
        gains = estimate.gains(criterion, motions, sight, joints=pool.joints)
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
    covariances = predicted_covariances(estimate, motions[chosen], sight, joints)
    prospects = tuple(
        Prospect(pool.candidates[i], float(gains[i]), covariance)
        for i, covariance in zip(chosen, covariances, strict=True)
    )
    return Ranking(prospects, infeasible, int(usable.sum()))


def predicted_covariances(
    estimate: Estimate, motions: FloatArray, sight: Sight, joints: FloatArray | None = None
) -> FloatArray:
    """(N, 6, 6) covariance of the twist of X predicted after a view at each of motions (N, 4, 4).

    `joints` (N, n) are the joint positions there, if the arm is known.

    Raises
    ------
    DegenerateError
        The information is singular.
    """
    jacobians = estimate.jacobians(joints)
    before = np.zeros((6, 6))
    after = np.zeros((len(motions), 6, 6))
    try:
        for weight, hypothesis in estimate.averaged:
            predictor = estimate.predictor(hypothesis, sight)
            before += weight * _hand_eye_covariance(hypothesis.information)
            for first in range(0, len(motions), _BATCH):
                batch = slice(first, first + _BATCH)
                taught = predictor.informations(
                    motions[batch], jacobians=None if jacobians is None else jacobians[batch]
                )
                information = hypothesis.information + taught
                after[batch] += weight * _hand_eye_covariance(information)
        root = np.linalg.cholesky(estimate.hand_eye_covariance)
        share = root @ np.linalg.inv(np.linalg.cholesky(before))
    except np.linalg.LinAlgError as error:
        raise DegenerateError("the information of the views is singular") from error
    return share @ after @ share.T


def _hand_eye_covariance(information: FloatArray) -> FloatArray:
    """Return the block (..., 6, 6) of X in the inverse of informations (..., n, n), never indefinite.

    Scaled to a unit diagonal first, as metres, radians and pixels differ by many orders of magnitude; then by
    Cholesky, ``(L L')^-1 = W' W`` with the columns of ``W = L^-1`` that belong to X.
    """
    scale = 1 / np.sqrt(np.diagonal(information, axis1=-2, axis2=-1))
    root = np.linalg.cholesky(information * scale[..., :, None] * scale[..., None, :])
    columns = np.eye(information.shape[-1])[:, :6]
    half = np.linalg.solve(root, np.broadcast_to(columns, (*root.shape[:-1], 6))) * scale[..., None, :6]
    return np.swapaxes(half, -1, -2) @ half
