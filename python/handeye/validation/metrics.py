"""How good a calibration is: the metrics of Yang, Rebello and Waslander (2023), and those that mislead less.

Frames are those of the chain ``C_k = X A_k Y``: with the camera in the hand X is `T_ce` and Y is `T_bw` of
the paper. `C_k` is the pose of the target found in the image of view k alone. Where the
arm is known, A_k is that of the arm as the estimate has found its joints and links to be.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DegenerateError, InputError
from handeye.estimation import Estimate, Measurements
from handeye.estimation.f_distribution import f_quantile
from handeye.types import Pose
from handeye.types.arrays import FloatArray
from handeye.types.pose import inverses
from handeye.types.units import MM_PER_M


@dataclass(frozen=True)
class Deviation:
    """A translation in millimetres and a rotation in degrees."""

    translation_mm: float
    rotation_deg: float


def deviation(difference: Pose) -> Deviation:
    """Return how far a transform is from none at all: norm of its translation, angle of its rotation."""
    return Deviation(
        MM_PER_M * float(np.linalg.norm(difference.translation)),
        float(np.rad2deg(difference.rotation_angle_rad)),
    )


def absolute_error(X: Pose, X_true: Pose) -> Deviation:
    """Return how far the centre of the camera is off, and by what angle the camera is turned.

    ``X_true inv(X)``, the pose of the camera in the true camera: its translation is the error of the centre
    whatever the frame that the camera is fixed in. (The paper's ``inv(X) X_true``, section V-A, is the error
    of where the camera sees the flange or base, which grows with the distance to it.)
    """
    return deviation(X_true @ X.inverse())


def held_out_rmse_px(estimate: Estimate, held_out: Measurements) -> float:
    """Return the paper's `e_RMSE` over views that were not used, in pixels (section V-B).

    ``sqrt(1 / (K - 1) sum_k mean_i |u_ki - pi(X A_k Y p_i)|^2)``: over the points of a view the mean is
    taken, so that boards of different size compare. The camera is that of the estimate. Infinite where the
    estimate puts the target out of sight.

    Raises
    ------
    InputError
        Fewer than two views.
    """
    if len(held_out) < 2:
        raise InputError(f"{len(held_out)} held-out views, at least 2 are needed", code=Code.TOO_FEW_VIEWS)
    problem = estimate.corrected(held_out).with_camera(estimate.camera).problem
    squared = [
        problem.squared_error(estimate.X.matrix, estimate.Y.matrix, views=[k]) / count
        for k, count in enumerate(held_out.point_counts)
    ]
    return float(np.sqrt(np.sum(squared) / (len(held_out) - 1)))


def relative_error(estimate: Estimate, held_out: Measurements) -> Deviation:
    """Return the paper's relative error on views that were not used (section V-B).

    ``dT_k = Y inv(C_k) X A_k``: mean over the views of the norm of its translation and of its angle. With
    the camera in the hand it has coordinates of the robot's base, so its translation grows with the rotation
    error and the distance of the target from the base; see `relative_error_at_target`.

    Raises
    ------
    InputError
        No view.
    """
    held_out = _as_estimated(estimate, held_out)
    poses, motions = inverses(held_out.camera_poses), held_out.motions
    return _mean_deviation(estimate.Y.matrix @ poses @ estimate.X.matrix @ motions)


def relative_error_at_target(estimate: Estimate, held_out: Measurements) -> Deviation:
    """Return the same error in the frame of the target, ``inv(C_k) X A_k Y``: how far the board seems off.

    Raises
    ------
    InputError
        No view.
    """
    held_out = _as_estimated(estimate, held_out)
    poses, motions = inverses(held_out.camera_poses), held_out.motions
    return _mean_deviation(poses @ estimate.X.matrix @ motions @ estimate.Y.matrix)


def _as_estimated(estimate: Estimate, held_out: Measurements) -> Measurements:
    """Return views as the estimate has camera and arm: X belongs to the camera that it was found with."""
    some = _some(held_out)
    same = estimate.camera == some.camera
    return estimate.corrected(some if same else some.through(estimate.camera))


def _some(held_out: Measurements) -> Measurements:
    if len(held_out) == 0:
        raise InputError("no held-out views", code=Code.TOO_FEW_VIEWS)
    return held_out


def _mean_deviation(differences: FloatArray) -> Deviation:
    twists = _core.se3_log(differences)
    return Deviation(
        MM_PER_M * float(_norms(differences[:, :3, 3]).mean()),
        float(np.rad2deg(_norms(twists[:, 3:]).mean())),
    )


def _norms(rows: FloatArray) -> FloatArray:
    return np.sqrt(np.sum(np.square(rows), axis=1))


def split_half_difference(first: Estimate, second: Estimate) -> Deviation:
    """Return by how much two answers from disjoint views differ, ``inv(X_1) X_2``.

    Needs no truth, and does not reward an answer that bends to follow the robot's error.
    """
    return deviation(first.X.inverse() @ second.X)


def nees(X: Pose, covariance: FloatArray, X_true: Pose) -> float:
    """Return the normalised estimation error squared, ``d' C^-1 d`` with ``d = log(X_true inv(X))``.

    With a true covariance (6, 6) its mean is 6.

    Raises
    ------
    DegenerateError
        The covariance is singular.
    """
    d = (X_true @ X.inverse()).log()
    # Metres and radians side by side: scaled to a correlation before it is inverted.
    deviations = np.sqrt(np.diag(covariance))
    try:
        whitened = np.linalg.solve(covariance / np.outer(deviations, deviations), d / deviations)
    except np.linalg.LinAlgError as error:
        raise DegenerateError("the covariance is singular") from error
    return float(d / deviations @ whitened)


def split_half_nees(first: Estimate, second: Estimate) -> float:
    """Return the NEES of the difference of two answers from disjoint views, with both covariances added.

    Raises
    ------
    DegenerateError
        The covariance is singular.
    """
    return nees(first.X, first.hand_eye_covariance + second.hand_eye_covariance, second.X)


def region_holds(squared: float, degrees_of_freedom: float = float("inf"), probability: float = 0.95) -> bool:
    """Tell whether an error lies in the region of a probability.

    The region is ``d' C^-1 d <= 6 F(6, nu)``: where the noise levels behind the covariance are known with nu
    degrees of freedom only, the error has heavier tails than a Gaussian.

    Parameters
    ----------
    squared
        NEES of the error.
    degrees_of_freedom
        nu; infinite makes it chi-square.
    """
    return squared <= 6 * f_quantile(probability, 6, degrees_of_freedom)


def summary(values: FloatArray) -> dict[str, Any]:
    """Return mean, median and number of values (N,)."""
    return {"mean": float(np.mean(values)), "median": float(np.median(values)), "trials": len(values)}
