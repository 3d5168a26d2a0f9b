"""Ali, Suominen, Gotchev and Ruiz Morales: costs on relative motions, AX = XB, in two forms."""

import numpy as np

from handeye.estimation.pose_costs.base import PoseCost, PoseViews, flat, inverse
from handeye.types.arrays import FloatArray

PAPER = (
    "I. Ali, O. Suominen, A. Gotchev and E. Ruiz Morales, "
    '"Methods for simultaneous robot-world-hand-eye calibration: a comparative study", Sensors 19(12), 2019'
)


def _motions(views: PoseViews) -> tuple[FloatArray, FloatArray]:
    """(K - 1, 4, 4) motions of hand and eye from each view to the next."""
    hand = views.A[1:] @ inverse(views.A[:-1])
    eye = views.C[1:] @ inverse(views.C[:-1])
    return hand, eye


def _mean_target(X: FloatArray, Y: FloatArray, views: PoseViews) -> FloatArray:
    """Rows that make Y the mean of what the views say of it; they have no say in X that could not be undone.

    ``AX = XB`` knows X alone, as ``inv(X)``. So that one descent gives both, Y is fitted beside it with a
    weight that leaves X where the motions put it.
    """
    seen = inverse(views.A) @ inverse(X) @ views.C
    return FOLLOW * flat(seen.mean(axis=1, keepdims=True) - Y)


# Small enough that X moves by less than rounding, large enough that Y is determined.
FOLLOW = 1e-3


def _first(X: FloatArray, Y: FloatArray, views: PoseViews) -> FloatArray:
    """``sum |hand Z - Z eye|^2`` with ``Z = inv(X)``."""
    hand, eye = _motions(views)
    Z = inverse(X)
    return np.concatenate([flat(hand @ Z - Z @ eye), _mean_target(X, Y, views)], axis=1)


def _second(X: FloatArray, Y: FloatArray, views: PoseViews) -> FloatArray:
    """``sum |hand - Z eye inv(Z)|^2``."""
    hand, eye = _motions(views)
    return np.concatenate([flat(hand - inverse(X) @ eye @ X), _mean_target(X, Y, views)], axis=1)


ALI_1 = PoseCost("ali_1", PAPER, _first)
ALI_2 = PoseCost("ali_2", PAPER, _second)
