"""What the methods that minimise a cost on poses share: the views, the cost, and Levenberg-Marquardt."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DegenerateError, InputError
from handeye.types.arrays import FloatArray

# Step of the central differences, metres and radians; rounding then costs about 1e-10 of a derivative.
DIFFERENCE = 1e-6
MOST_STEPS = 200
# A step this small ends the descent, metres and radians.
SMALL_STEP = 1e-13
FIRST_DAMPING, MOST_DAMPING = 1e-9, 1e9
# Condition of the normal equations, scaled to a unit diagonal, beyond which nothing is determined.
MOST_CONDITION = 1e16


@dataclass(frozen=True)
class PoseViews:
    """What the methods see of K views: poses alone.

    Parameters
    ----------
    A
        (K, 4, 4) motions of the robot, of the chain ``C ~ X A Y``.
    C
        (K, 4, 4) measured `T_camera_target`.
    points
        (P, 3) points of the target, metres, for costs that measure there.
    """

    A: FloatArray
    C: FloatArray
    points: FloatArray


@dataclass(frozen=True)
class PoseCost:
    """A method: the residuals whose squares it sums, and how it weights them.

    Parameters
    ----------
    name, paper
        How users choose the method, and where it comes from.
    residuals
        From X (S, 1, 4, 4), Y (S, 1, 4, 4) and the views to (S, K, m): S answers at once.
    weights
        From residuals (K, m) to weights (K, m) of their squares, found again at every step; None is one.
    """

    name: str
    paper: str
    residuals: Callable[[FloatArray, FloatArray, PoseViews], FloatArray]
    weights: Callable[[FloatArray], FloatArray] | None = None


def optimise(
    cost: PoseCost, views: PoseViews, start: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Minimise a cost over X and Y on the manifold, by Levenberg-Marquardt from a start.

    Parameters
    ----------
    start
        X and Y, each (4, 4), such as a closed form gives.

    Raises
    ------
    InputError
        Fewer than three views.
    DegenerateError
        The cost does not determine X and Y.

    Examples
    --------
    >>> start = _core.closed_form("shah", A, C)
    >>> X, Y = optimise(TABB_AHMAD_YOUSEF_1, PoseViews(A, C, points), start)
    """
    if len(views.A) < 3:
        raise InputError(f"{len(views.A)} views, at least 3 are needed", code=Code.TOO_FEW_VIEWS)
    x, y = start
    damping = FIRST_DAMPING
    for _ in range(MOST_STEPS):
        rows, jacobian = _linearised(cost, views, x, y)
        weights = np.ones_like(rows) if cost.weights is None else cost.weights(rows)
        root = np.sqrt(weights).ravel()
        r, J = root * rows.ravel(), root[:, np.newaxis] * jacobian
        normal, gradient = J.T @ J, J.T @ r
        scale = np.sqrt(np.diag(normal))
        if not np.all(scale > 0) or np.linalg.cond(normal / np.outer(scale, scale)) > MOST_CONDITION:
            raise DegenerateError(f"{cost.name}: these views do not determine X and Y", code=Code.DEGENERATE)
        before = float(r @ r)
        while True:
            damped = normal + damping * np.diag(scale**2)
            step = -np.linalg.solve(damped, gradient)
            x_next, y_next = _core.se3_exp(step.reshape(2, 6)) @ np.stack([x, y])
            after = float(np.sum(weights * _rows(cost, views, x_next, y_next) ** 2))
            if after <= before or damping > MOST_DAMPING:
                break
            damping *= 10
        if after > before:
            break
        x, y, damping = x_next, y_next, max(damping / 10, FIRST_DAMPING)
        if np.abs(step).max() < SMALL_STEP:
            break
    return x, y


def _rows(cost: PoseCost, views: PoseViews, X: FloatArray, Y: FloatArray) -> FloatArray:
    return cost.residuals(X[np.newaxis, np.newaxis], Y[np.newaxis, np.newaxis], views)[0]


def _linearised(
    cost: PoseCost, views: PoseViews, X: FloatArray, Y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Residuals (K, m) and their derivatives (K m, 12) by left perturbations of X and Y."""
    steps = _core.se3_exp(DIFFERENCE * np.concatenate([np.eye(6), -np.eye(6)]))
    left, right = np.broadcast_to(X, (12, 4, 4)), np.broadcast_to(Y, (12, 4, 4))
    Xs = np.concatenate([steps @ X, left, X[np.newaxis]])[:, np.newaxis]
    Ys = np.concatenate([right, steps @ Y, Y[np.newaxis]])[:, np.newaxis]
    rows = cost.residuals(Xs, Ys, views)
    ahead, behind = rows[[*range(6), *range(12, 18)]], rows[[*range(6, 12), *range(18, 24)]]
    jacobian = ((ahead - behind) / (2 * DIFFERENCE)).reshape(12, -1).T
    return rows[24], jacobian


def flat(matrices: FloatArray) -> FloatArray:
    """(..., 12) entries of the upper three rows of transforms (..., 4, 4)."""
    return matrices[..., :3, :].reshape(*matrices.shape[:-2], 12)


def inverse(transforms: FloatArray) -> FloatArray:
    """(..., 4, 4) inverses of rigid transforms."""
    result = np.zeros_like(transforms)
    rotation = np.swapaxes(transforms[..., :3, :3], -1, -2)
    result[..., :3, :3] = rotation
    result[..., :3, 3] = -(rotation @ transforms[..., :3, 3:])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def rotation_vectors(rotations: FloatArray) -> FloatArray:
    """(..., 3) rotation vectors of (..., 3, 3) matrices, radians."""
    transforms = np.zeros((*rotations.shape[:-2], 4, 4))
    transforms[..., :3, :3], transforms[..., 3, 3] = rotations, 1.0
    twists = _core.se3_log(transforms.reshape(-1, 4, 4))
    return twists[:, 3:].reshape(*rotations.shape[:-2], 3)
