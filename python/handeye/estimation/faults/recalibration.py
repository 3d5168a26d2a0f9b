"""The camera that the pictures of the target ask for by themselves, whatever the robot did.

Levenberg-Marquardt on the parameters, the pose of every view found again at each step: what a pose cannot
absorb of a camera's error shows in the residuals of its own view.
"""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.errors import HandeyeError
from handeye.estimation.camera_prior import UNMEASURED_LENS
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.camera import Camera

MOST_STEPS = 25
FIRST_DAMPING = 1e-2
# A step that brings less of the residual is the last.
LEAST_GAIN = 0.01
# Parameters that few views hardly tell stay near what is given: relative to this share of the focal length,
# and this size of a coefficient.
FAINT_SHARE, FAINT_COEFFICIENT = 0.5, 0.5


@dataclass(frozen=True, eq=False)
class Recalibrated:
    """A camera from the pictures alone.

    Parameters
    ----------
    camera
        With covariance, marked as calibrated from these pictures.
    before_px, after_px
        Median residual of a view through the given camera and through this one.
    """

    camera: Camera
    before_px: float
    after_px: float


def median_px(measurements: Measurements) -> float:
    """Median over the views of the residual that the best pose of a view leaves."""
    return float(np.median([pose.rmse_px for pose in measurements.poses]))


def recalibrated(measurements: Measurements) -> Recalibrated | None:
    """Find the camera; None where the pictures do not determine one."""
    before = median_px(measurements)
    current = min(_starts(measurements), key=median_px)
    last, damping = median_px(current), FIRST_DAMPING
    information = np.zeros((0, 0))
    for _ in range(MOST_STEPS):
        try:
            normal, gradient = _normal(current)
            damped = normal + damping * np.diag(np.diag(normal))
            step: FloatArray = np.asarray(np.linalg.solve(damped, gradient), dtype=np.float64)
            tried = current.through(_moved(current.camera, step))
        except (HandeyeError, np.linalg.LinAlgError):
            break
        information = normal
        now = median_px(tried) if len(tried) == len(measurements) else np.inf
        if now > last:
            damping *= 10
            continue
        current, last, gain = tried, now, 1 - now / max(last, 1e-12)
        damping /= 10
        if gain < LEAST_GAIN:
            break
    if not len(information):
        return None
    covariance = np.linalg.inv(information) * max(last, 1e-3) ** 2
    camera = current.camera
    found = Camera(
        camera.lens, camera.parameters, *camera.size_px, 0.5 * (covariance + covariance.T), from_views=True
    )
    return Recalibrated(found, before, last)


def _starts(measurements: Measurements) -> list[Measurements]:
    """Return the measurements through cameras to start from: as given, and from homographies."""
    camera = _with_lens(measurements.camera)
    starts = [measurements.through(camera)]
    pinhole = _from_homographies(measurements)
    if pinhole is not None:
        parameters = np.concatenate([pinhole, np.zeros(len(camera.parameters) - 4)])
        with suppress(HandeyeError):
            tried = measurements.through(Camera(camera.lens, parameters, *camera.size_px))
            if len(tried) == len(measurements):
                starts.append(tried)
    return starts


def _from_homographies(measurements: Measurements) -> FloatArray | None:
    """(4,) fx, fy, cx, cy from the homographies of a planar target without skew (Zhang 2000, section 3.1)."""
    size = np.array(measurements.camera.size_px) / 2
    rows: list[FloatArray] = []
    for view in measurements.views:
        board = measurements.target.points[view.point_ids, :2]
        spread = board.std()
        h = _homography((board - board.mean(axis=0)) / spread, (view.pixels - size) / size[0])
        rows += [_constraint(h, 0, 1), _constraint(h, 0, 0) - _constraint(h, 1, 1)]
    b11, b22, b13, b23, b33 = np.linalg.svd(np.array(rows))[2][-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = b33 - b13**2 / b11 - b23**2 / b22
        found = np.array([np.sqrt(scale / b11), np.sqrt(scale / b22), -b13 / b11, -b23 / b22]) * size[0]
    found[2:] += size
    usable = np.isfinite(found).all() and found[:2].min() > 0.1 * size[0]
    return found if usable and (np.abs(found[2:] - size) < 2 * size).all() else None


def _homography(board: FloatArray, pixels: FloatArray) -> FloatArray:
    """(3, 3) from points of a plane (N, 2) to the image (N, 2), by the direct linear transform."""
    ones = np.column_stack([board, np.ones(len(board))])
    zeros = np.zeros_like(ones)
    u, v = pixels[:, :1], pixels[:, 1:]
    system = np.concatenate([np.hstack([ones, zeros, -u * ones]), np.hstack([zeros, ones, -v * ones])])
    return np.linalg.svd(system)[2][-1].reshape(3, 3)


def _constraint(h: FloatArray, i: int, j: int) -> FloatArray:
    """Coefficients of h_i' B h_j in B11, B22, B13, B23, B33."""
    a, b = h[:, i], h[:, j]
    return np.array(
        [a[0] * b[0], a[1] * b[1], a[0] * b[2] + a[2] * b[0], a[1] * b[2] + a[2] * b[1], a[2] * b[2]]
    )


def _with_lens(camera: Camera) -> Camera:
    """Return a camera with room for distortion, its covariance aside."""
    if camera.lens == "kannala_brandt" or len(camera.distortion):
        return Camera(camera.lens, camera.parameters, *camera.size_px)
    zeros = np.zeros(5)
    return Camera(UNMEASURED_LENS, np.concatenate([camera.parameters[:4], zeros]), *camera.size_px)


def _normal(measurements: Measurements) -> tuple[FloatArray, FloatArray]:
    """Information (n, n) and gradient (n,) of the parameters, at 1 px."""
    camera = measurements.camera
    seen = _core.PoseMeasurements(
        measurements.problem, measurements.camera_poses, free_camera=list(range(len(camera.parameters)))
    )
    information, gradient = seen.camera_normal()
    faint = np.full(len(camera.parameters), FAINT_COEFFICIENT)
    faint[:4] = FAINT_SHARE * camera.parameters[0]
    return information + np.diag(np.square(max(median_px(measurements), 1e-3) / faint)), gradient


def _moved(camera: Camera, step: FloatArray) -> Camera:
    return Camera(camera.lens, camera.parameters + step, *camera.size_px)
