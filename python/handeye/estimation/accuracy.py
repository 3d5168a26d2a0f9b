"""The hand-eye's uncertainty where it matters: at points that the user names."""

import numpy as np
from numpy.typing import ArrayLike

from handeye.types.arrays import FloatArray, finite_array


def tool_deviations_m(covariance: ArrayLike, points_camera_m: ArrayLike) -> FloatArray:
    """(P,) standard deviation in metres of points fixed in the camera frame, seen from where it is mounted.

    The twist xi of ``X <- exp(xi) X`` moves a point p of the camera by ``rho + phi x p``; the deviation is
    the root of the summed variances of the three directions.

    Parameters
    ----------
    covariance
        (6, 6) covariance of the twist of X.
    points_camera_m
        (P, 3) points in the camera frame, metres.
    """
    points = finite_array(points_camera_m, (None, 3), "tool points")
    hats = np.zeros((len(points), 3, 3))
    hats[:, 0, 1], hats[:, 0, 2], hats[:, 1, 2] = -points[:, 2], points[:, 1], -points[:, 0]
    hats -= hats.transpose(0, 2, 1)
    jacobians = np.concatenate([np.broadcast_to(np.eye(3), hats.shape), -hats], axis=2)
    return np.sqrt(np.einsum("pij,jk,pik->p", jacobians, np.asarray(covariance), jacobians))


def box_corners(lower_m: ArrayLike, upper_m: ArrayLike) -> FloatArray:
    """(8, 3) corners of a working box in the camera frame; the worst point of a box is one of them."""
    lower, upper = finite_array(lower_m, (3,), "box"), finite_array(upper_m, (3,), "box")
    return np.array(
        [[x, y, z] for x in (lower[0], upper[0]) for y in (lower[1], upper[1]) for z in (lower[2], upper[2])]
    )
