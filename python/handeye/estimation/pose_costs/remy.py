"""Remy, Dhome, Lavest and Daucher: the distance of the target's points between both sides of the equation."""

import numpy as np

from handeye.estimation.pose_costs.base import PoseCost, PoseViews
from handeye.types.arrays import FloatArray

PAPER = (
    'S. Remy, M. Dhome, J. M. Lavest and N. Daucher, "Hand-eye calibration", IEEE/RSJ International '
    "Conference on Intelligent Robots and Systems (IROS), 1997"
)


def _residuals(X: FloatArray, Y: FloatArray, views: PoseViews) -> FloatArray:
    """``sum |C p - X A Y p|^2`` over the points p of the target.

    As later papers describe the method; the sum over points is that of four of them, the corners of the box
    with the same second moments, which gives the same cost and takes a fraction of the time.
    """
    points = _moments(views.points)
    difference = views.C - X @ views.A @ Y
    rows = difference[..., :3, :] @ points.T
    return rows.reshape(*rows.shape[:-2], -1)


def _moments(points: FloatArray) -> FloatArray:
    """(4, 4) rows with the sum of products ``p p'`` of the homogeneous points (P, 3) per point."""
    homogeneous = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    values, vectors = np.linalg.eigh(homogeneous.T @ homogeneous / len(points))
    return np.sqrt(np.maximum(values, 0))[:, np.newaxis] * vectors.T


REMY = PoseCost("remy", PAPER, _residuals)
