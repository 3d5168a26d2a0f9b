"""Whether what was seen fits what is believed: labels of symmetric boards, and views that cannot be true."""

from collections.abc import Sequence

import cv2
import numpy as np

from handeye import _core
from handeye.detection import Detection, Prediction, relabeled
from handeye.errors import HandeyeError
from handeye.estimation import Estimate, Measurements, view_pose
from handeye.robots.replay import is_near
from handeye.types import Camera, Pose, Target, View
from handeye.types.arrays import FloatArray

# Root mean square error of one view's own pose beyond which its points are no picture of the target.
LARGEST_RMSE_PX = 3.0
# By so much of its size in the image a lens may bend the picture of a flat target.
LARGEST_BEND = 0.08
# A view this much off what is believed is believed to be wrong, however sure the belief: metres, radians.
LARGEST_SURPRISE = (0.02, np.deg2rad(3.0))
SIGMAS = 6.0
# Fewer views than these cannot speak against another one.
FEWEST_WITNESSES = 4
# The arm's own errors are not all known: a prediction is never taken to be better than this.
LEAST_MARGIN_PX = 8.0
# Views agree where none is farther off what is believed than the first, nor so many times as far as the
# median, which is not taken to be less than the second: metres, radians.
AGREEMENT = ((0.0015, 1e-4), (np.deg2rad(0.3), np.deg2rad(0.02)))
STANDS_OUT = 3.0
# Points that all moved less than this did not move, though the arm moved more than this: metres, radians.
UNCHANGED_PX = 0.5
ELSEWHERE = (0.005, np.deg2rad(1.0))


def labeled(camera: Camera, target: Target, detection: Detection, T_base: Pose, expected: Pose) -> Detection:
    """Return the detection with those labels, of all that look the same, that fit an expected pose best."""
    if len(target.symmetries) == 1:
        return detection
    best: tuple[float, Detection] | None = None
    for permutation in target.symmetries:
        candidate = relabeled(detection, permutation)
        try:
            pose = view_pose(camera, target, View("candidate", T_base, candidate.point_ids, candidate.pixels))
        except HandeyeError:
            continue
        angle = (expected.inverse() @ pose.T_camera_target).rotation_angle_rad
        if best is None or angle < best[0]:
            best = angle, candidate
    return detection if best is None else best[1]


def objection(
    camera: Camera | None, target: Target, view: View, estimate: Estimate | None, views: int
) -> str | None:
    """Say why a view cannot be true, None if it may be.

    Parameters
    ----------
    camera
        As it was given, or as the views teach it, this one included; None where they do not yet.
    estimate
        What the other views say.
    views
        How many these are.
    """
    if camera is None:
        return _no_plane(target, view)
    try:
        pose = view_pose(camera, target, view)
    except HandeyeError as error:
        return error.message.removeprefix(f"view {view.name}: ")
    if pose.rmse_px > LARGEST_RMSE_PX:
        return f"its points fit the target only to {pose.rmse_px:.1f} px"
    if estimate is None or views < FEWEST_WITNESSES or not estimate.determined:
        return None
    A = estimate.mounting.chain(view.T_base_flange)
    expected = estimate.X @ A @ estimate.Y
    choices = [pose.T_camera_target] + ([] if pose.mirrored is None else [pose.mirrored[0]])
    complaints = [_surprise(estimate, A, expected, seen) for seen in choices]
    return None if None in complaints else complaints[0]


def _no_plane(target: Target, view: View) -> str | None:
    """Say why points are no picture of a flat target, whatever the camera; None if they may be.

    A homography takes the target into the image but for the distortion of the lens.
    """
    points = target.points[view.point_ids, :2]
    H: FloatArray | None = cv2.findHomography(points, view.pixels)[0]  # pyright: ignore[reportAssignmentType]
    if H is None:
        return "its points are no picture of a flat target"
    mapped: FloatArray = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ H.T
    off: FloatArray = mapped[:, :2] / mapped[:, 2:] - view.pixels
    rms = float(np.linalg.norm(off)) / len(points) ** 0.5
    extent = float(np.ptp(view.pixels, axis=0).max())
    if not rms <= LARGEST_BEND * extent:
        return f"its points are {rms:.0f} px from any picture of a flat target"
    return None


def all_agree(measurements: Measurements, estimate: Estimate) -> bool:
    """Tell whether every view is where the estimate has it, and none stands out: then none is a mistake.

    A wrong view shows even where it has drawn the estimate to it: it then lies several times farther off than
    the median, or all of them are far off.
    """
    predicted = estimate.X.matrix @ measurements.motions @ estimate.Y.matrix
    seen = measurements.camera_poses
    middle = measurements.target.points.mean(axis=0)
    off_m = np.linalg.norm(
        (predicted[:, :3, :3] - seen[:, :3, :3]) @ middle + predicted[:, :3, 3] - seen[:, :3, 3], axis=1
    )
    turns = np.einsum("kji,kjl->kil", predicted[:, :3, :3], seen[:, :3, :3])
    off_rad = np.linalg.norm(turns - np.eye(3), axis=(1, 2)) / np.sqrt(2.0)
    return all(
        off.max() <= limit and off.max() <= STANDS_OUT * max(float(np.median(off)), floor)
        for off, limit, floor in ((off_m, *AGREEMENT[0]), (off_rad, *AGREEMENT[1]))
    )


def unchanged(view: View, others: Sequence[View]) -> bool:
    """Tell whether a view shows what another showed from elsewhere: a picture that came again."""
    for other in others:
        if is_near(view.T_base_flange, other.T_base_flange, *ELSEWHERE):
            continue
        if np.array_equal(view.point_ids, other.point_ids) and (
            np.abs(view.pixels - other.pixels).max() < UNCHANGED_PX
        ):
            return True
    return False


def foreseen(camera: Camera, target: Target, estimate: Estimate | None, T_base: Pose) -> Prediction | None:
    """Return where the target should be seen from a robot pose, None where the views do not tell yet.

    The margin is what the estimate does not know, so many deviations of it.
    """
    if estimate is None or not estimate.determined:
        return None
    A = estimate.mounting.chain(T_base)
    expected = estimate.X @ A @ estimate.Y
    pixels, seen = _core.project_features(
        camera.lens, camera.parameters, expected.matrix, target.points, target.radii_m
    )
    depth = float(expected.act(target.points.mean(axis=0)[np.newaxis])[0, 2])
    if depth <= 0 or not seen.any():
        return None
    sigma_m, sigma_rad = _deviations(estimate, A, expected)
    size = float(np.ptp(target.points, axis=0).max())
    margin = SIGMAS * float(camera.parameters[:2].max()) * (sigma_m + 0.5 * sigma_rad * size) / depth
    return Prediction(np.where(seen[:, np.newaxis], pixels, np.nan), max(LEAST_MARGIN_PX, margin))


def _surprise(estimate: Estimate, A: Pose, expected: Pose, seen: Pose) -> str | None:
    middle = estimate.target.points.mean(axis=0)[np.newaxis]
    off = float(np.linalg.norm(seen.act(middle) - expected.act(middle)))
    turn = (expected.inverse() @ seen).rotation_angle_rad
    sigma_m, sigma_rad = _deviations(estimate, A, expected)
    most_m = max(LARGEST_SURPRISE[0], SIGMAS * sigma_m)
    most_rad = max(LARGEST_SURPRISE[1], SIGMAS * sigma_rad)
    if off <= most_m and turn <= most_rad:
        return None
    return (
        f"the target would be {1e3 * off:.0f} mm and {np.rad2deg(turn):.1f} deg from where all other views "
        f"have it"
    )


def _deviations(estimate: Estimate, A: Pose, expected: Pose) -> tuple[float, float]:
    """Return the deviations (metres, radians) of where the estimate has the middle of the target."""
    middle = estimate.target.points.mean(axis=0)[np.newaxis]
    # First order: C = X A Y moves with the left twists of X and, carried over by X A, of Y.
    carried = (estimate.X @ A).adjoint()
    jacobian = np.hstack([np.eye(6), carried])
    # At the middle of the target rather than at the camera's centre.
    x, y, z = expected.act(middle)[0]
    lever = np.eye(6)
    lever[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    jacobian = lever @ jacobian
    covariance = jacobian @ estimate.covariance[:12, :12] @ jacobian.T
    robot = estimate.noise.robot_translation_m
    sigma_m = float(np.sqrt(np.trace(covariance[:3, :3]) + 3 * robot**2))
    sigma_rad = float(np.sqrt(np.trace(covariance[3:, 3:])))
    return sigma_m, sigma_rad
