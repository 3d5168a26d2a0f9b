"""What each view says about the answer."""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.estimation import Measurements, ViewPose
from handeye.estimation.estimate import side_of_chain
from handeye.report.document import ViewLine
from handeye.types import Camera, Mounting, Pose, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Calibration, RobotSide
from handeye.types.units import MM_PER_M


@dataclass(frozen=True, eq=False)
class ViewPicture:
    """Residuals of one view.

    Attributes
    ----------
    name
        Name of the view.
    width_px, height_px
        Size of the image.
    pixels, residuals
        (N, 2) where points were found, and by how much that is off what the answer predicts.
    """

    name: str
    width_px: int
    height_px: int
    pixels: FloatArray
    residuals: FloatArray

    @property
    def rmse_px(self) -> float:
        """Root mean square of the length of the residuals."""
        return float(np.sqrt(np.square(self.residuals).sum(axis=1).mean()))


def view_lines(calibration: Calibration, measurements: Measurements) -> list[ViewLine]:
    """Return a line for every view that could be measured, in the order of the recording."""
    lines: list[ViewLine] = []
    results = {view.name: view for view in calibration.views}
    pixel_sigma = dict(zip(calibration.used, calibration.noise.pixel_sigma_px, strict=False))
    for view, measured in zip(measurements.views, measurements.poses, strict=True):
        result = results.get(view.name)
        chain = _chain(calibration, view)
        off = robot_error(calibration, view, measured, pixel_sigma.get(view.name))
        middle = chain.act(measurements.target.points.mean(axis=0, keepdims=True))[0]
        facing = float(middle @ chain.rotation[:, 2] / np.linalg.norm(middle))
        rmse = None if result is None or not np.isfinite(result.rmse_px) else result.rmse_px
        lines.append(
            ViewLine(
                name=view.name,
                used=result is not None and result.used,
                reason="" if result is None else result.reason,
                points=len(view),
                rmse_px=rmse,
                own_rmse_px=measured.rmse_px,
                robot_off_mm=None if off is None else MM_PER_M * float(np.linalg.norm(off.translation)),
                robot_off_deg=None if off is None else float(np.rad2deg(off.rotation_angle_rad)),
                distance_mm=MM_PER_M * float(np.linalg.norm(middle)),
                tilt_deg=float(np.rad2deg(np.arccos(np.clip(facing, -1.0, 1.0)))),
            )
        )
    return lines


def view_picture(calibration: Calibration, measurements: Measurements, view: View) -> ViewPicture:
    """Return the residuals of a view at the answer, with the robot's pose as the view has it.

    Points that the answer puts out of the lens's sight are left out.
    """
    camera: Camera = calibration.camera
    target = measurements.target
    predicted, seen = _core.project_features(
        camera.lens,
        camera.parameters,
        _chain(calibration, view).matrix,
        target.points[view.point_ids],
        target.radii_m[view.point_ids],
    )
    residuals = (view.pixels - predicted)[seen]
    return ViewPicture(view.name, camera.width_px, camera.height_px, view.pixels[seen], residuals)


def _chain(calibration: Calibration, view: View) -> Pose:
    """Return `T_camera_target` of a view at the answer."""
    return calibration.X @ calibration.mounting.chain(view.T_base_flange) @ calibration.Y


def robot_error(
    calibration: Calibration, view: View, measured: ViewPose, pixel_sigma_px: float | None
) -> Pose | None:
    """Return the most probable error of the robot's pose at the flange: reported pose from the true one.

    With the twist d that separates what the image says from what the answer predicts, its covariance P from
    the image and S of the robot, the robot's share is ``S (S + P)^-1 d``. None where the robot's poses are
    taken as exact, or the noise of the view is not known.
    """
    noise = calibration.noise
    if noise.robot_side is RobotSide.NONE or pixel_sigma_px is None:
        return None
    A = calibration.mounting.chain(view.T_base_flange)
    wanted = calibration.X.inverse() @ measured.T_camera_target @ calibration.Y.inverse()
    # On the left of A the error acts at the flange of a camera in the hand, and at the base otherwise.
    left = side_of_chain(calibration.mounting, noise.robot_side) == "left"
    twist = (wanted @ A.inverse()).log() if left else (A.inverse() @ wanted).log()
    to_side = (calibration.X if left else calibration.X @ A).inverse().adjoint()
    of_image = to_side @ np.linalg.inv(measured.information) @ to_side.T * pixel_sigma_px**2
    of_robot = np.diag([noise.robot_translation_m**2] * 3 + [noise.robot_rotation_rad**2] * 3)
    share = of_robot @ np.linalg.solve(of_robot + of_image, twist)
    true = Pose.exp(share) @ A if left else A @ Pose.exp(share)
    T_base_flange = true.inverse() if calibration.mounting is Mounting.EYE_IN_HAND else true
    return T_base_flange.inverse() @ view.T_base_flange
