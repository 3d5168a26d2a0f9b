"""What a view that is not taken yet would teach, predicted from an estimate."""

from dataclasses import dataclass, replace

import numpy as np

from handeye import _core
from handeye.errors import DegenerateError
from handeye.estimation.confidence import foretold
from handeye.estimation.estimate import Estimate
from handeye.types.arrays import BoolArray, FloatArray
from handeye.types.pose import Pose

# Least known directions of X and Y along which sigma points are laid, a metre and a radian weighing alike.
SIGMA_POINT_DIRECTIONS = 4
# Points that stand for a target where a first ranking is enough.
COARSE_POINTS = 16
# Candidates whose covariances, or errors of whose arms, are held in memory at a time.
_BATCH = 1000


@dataclass(frozen=True)
class Sight:
    """What a candidate must show of the target to count.

    Parameters
    ----------
    margin_px
        Distance of every counted point from the border of the image.
    fewest
        Fewest points in sight; None for all of the target.
    known
        The candidates are recorded views that are known to show the target: nothing is checked but that the
        lens can see it at the current estimate.

    Examples
    --------
    >>> Sight(margin_px=10.0, fewest=20).fewest
    20
    """

    margin_px: float = 0.0
    fewest: int | None = None
    known: bool = False


class Prediction:
    """What an estimate predicts of candidate views.

    Parameters
    ----------
    estimate
        What is believed now.
    sight
        What a candidate must show.
    coarse
        Let a few points, spread over the target, stand for all: for a first ranking of many candidates.

    Raises
    ------
    DegenerateError
        The information is singular.

    Examples
    --------
    >>> pool = Pool.of_views(recording.views)
    >>> Prediction(estimate, Sight(known=True)).covariances(pool.motions(recording.mounting)).shape
    (9, 6, 6)
    """

    def __init__(self, estimate: Estimate, sight: Sight, *, coarse: bool = False) -> None:
        self.estimate, self.sight = estimate, sight
        self._belief = _core.Belief(estimate.information)
        left, right = estimate.station_noise.roots(estimate.mounting)
        width, height = estimate.camera.size_px
        target = estimate.target
        points, radii_m, fewest = target.points, target.radii_m, sight.fewest or target.point_count
        pixel_sigma = estimate.candidate_sigma_px
        if coarse and len(points) > COARSE_POINTS:
            share = COARSE_POINTS / len(points)
            chosen = _spread(points, COARSE_POINTS)
            points, radii_m = points[chosen], radii_m[chosen]
            fewest, pixel_sigma = max(1, round(share * fewest)), pixel_sigma * share**0.5
        self._predictor = _core.Predictor(
            estimate.camera.lens,
            estimate.camera.parameters,
            points,
            radii_m,
            estimate.X.matrix,
            estimate.Y.matrix,
            pixel_sigma=pixel_sigma,
            robot_left=left,
            robot_right=right,
            free_camera=list(estimate.free_camera) or None,
            board_scale=estimate.board_scale is not None,
            kinematic_count=0 if estimate.arm is None else estimate.arm.constants,
            image_size=None if sight.known else (width, height),
            margin_px=sight.margin_px,
            fewest=1 if sight.known else fewest,
        )

    def in_sight(self, motions: FloatArray) -> BoolArray:
        """(N,) whether views at `motions` (N, 4, 4) would show enough of the target, its face or its back."""
        return np.array(self._predictor.in_sight(motions), dtype=bool)

    def gains(
        self, criterion: _core.Criterion, motions: FloatArray, joints: FloatArray | None = None
    ) -> FloatArray:
        """(N,) gain of candidate views at `motions` (N, 4, 4); NaN where too little would be in sight.

        Parameters
        ----------
        criterion
            What a view is worth.
        motions
            A of the chain of each candidate.
        joints
            (N, n) joint positions of the candidates, if the arm is known. Without them constants of the arm
            are taken as if they moved nothing.
        """
        # What the arm does, and what a view tells of the camera, is asked only where it shows the target.
        gains = np.full(len(motions), np.nan)
        seen = np.flatnonzero(self.in_sight(motions))
        if joints is None or self.estimate.arm is None:
            gains[seen] = self._predictor.gains(self._belief, criterion, motions[seen])
            return gains
        for first in range(0, len(seen), _BATCH):
            part = seen[first : first + _BATCH]
            arm = self._arm(joints[part])
            gains[part] = self._predictor.gains(self._belief, criterion, motions[part], arm=arm)
        return gains

    def informations(self, motions: FloatArray, joints: FloatArray | None = None) -> FloatArray:
        """(N, n, n) information of candidate views; zero where too little would be in sight."""
        return self._predictor.informations(motions, arm=self._arm(joints))

    def covariances(self, motions: FloatArray, joints: FloatArray | None = None) -> FloatArray:
        """(N, 6, 6) covariance of the twist of X predicted after a view at each of motions (N, 4, 4).

        A view adds to the information; what it does not lessen, errors that come again in every view
        and what is not known of the noise, stays as it is.

        Raises
        ------
        DegenerateError
            The information is singular.
        """
        after = np.zeros((len(motions), 6, 6))
        try:
            for first in range(0, len(motions), _BATCH):
                batch = slice(first, first + _BATCH)
                taught = self.informations(motions[batch], None if joints is None else joints[batch])
                after[batch] = _hand_eye_covariance(self.estimate.information + taught)
        except np.linalg.LinAlgError as error:
            raise DegenerateError("the information of the views is singular") from error
        return self.predicted(after)

    def predicted(self, after: FloatArray) -> FloatArray:
        """Covariances (..., 6, 6) of X after views that leave these by the information alone.

        See `handeye.estimation.confidence.foretold`.
        """
        known = self.estimate.arm is not None
        before = self._belief.covariance[:6, :6]
        return foretold(before, self.estimate.hand_eye_covariance, after, comes_again=not known)

    def _arm(self, joints: FloatArray | None) -> FloatArray | None:
        arm = self.estimate.arm
        if arm is None or joints is None:
            return None
        return arm.columns(self.estimate.mounting, joints, self.estimate.station_noise.joint_rad)


def gains(
    estimate: Estimate,
    criterion: _core.Criterion,
    motions: FloatArray,
    sight: Sight,
    *,
    joints: FloatArray | None = None,
    over_posterior: bool = False,
) -> FloatArray:
    """(N,) gain of candidate views at `motions` (N, 4, 4); see `Prediction.gains`.

    Parameters
    ----------
    over_posterior
        Average over sigma points of X and Y as well: a young estimate is wrong, and a view must be worth
        taking wherever the truth may be. Where a sigma point does not show the target it gains nothing.

    Raises
    ------
    DegenerateError
        The information is singular.
    """
    here = Prediction(estimate, sight).gains(criterion, motions, joints)
    if not over_posterior:
        return here
    points = [here]
    for X, Y in _sigma_points(estimate):
        there = Prediction(replace(estimate, X=X, Y=Y), sight).gains(criterion, motions, joints)
        points.append(np.nan_to_num(there))
    return np.mean(points, axis=0)


def _sigma_points(estimate: Estimate) -> list[tuple[Pose, Pose]]:
    """X and Y on both sides along the least known directions (unscented transform, no central weight)."""
    values, vectors = np.linalg.eigh(estimate.covariance[:12, :12])
    points: list[tuple[Pose, Pose]] = []
    for value, vector in list(zip(values, vectors.T, strict=True))[-SIGMA_POINT_DIRECTIONS:]:
        step = np.sqrt(SIGMA_POINT_DIRECTIONS * max(float(value), 0.0)) * vector
        points += [
            (Pose.exp(signed[:6]) @ estimate.X, Pose.exp(signed[6:]) @ estimate.Y) for signed in (step, -step)
        ]
    return points


def _spread(points: FloatArray, count: int) -> list[int]:
    """Return places of points (n, 3), each the furthest from those before it; the outermost comes first."""
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    away = np.full(len(points), np.inf)
    while len(chosen) < count:
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(away)))
    return chosen


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
