"""What the pictures say by themselves: a camera that is not theirs, pictures that are sheared."""

from dataclasses import replace
from functools import partial

import numpy as np

from handeye import _core
from handeye.estimation.faults.kinds import (
    Hypothesis,
    Kind,
    SharedFaultError,
    missing_distortion,
    sheared_pictures,
    wrong_camera,
)
from handeye.estimation.faults.recalibration import Recalibrated, median_px, recalibrated
from handeye.estimation.measurements import Measurements
from handeye.types.calibration import Finding
from handeye.types.camera import Camera
from handeye.types.recording import Recording

FEWEST_VIEWS = 3
# Views that fit their own pose within this need no other camera.
HEALTHY_PX = 0.35
# A camera of their own must bring the residual of the views down to this share; no nine parameters do that to
# noise.
WRONG_SHARE = 0.75
# And the residual of views that fit their own pose.
SMALL_SHARE = 0.35
# Residuals of fewer of the standard deviations that the camera states for itself are no fault.
STATED_SHARE = 3.0
# What a shear leaves of the residual.
SHEAR_SHARE = 0.5
# Rows shifted by less than this share of their height are no shear.
LEAST_SHEAR = 0.003


def examine_pictures(measurements: Measurements, *, closely: bool = False) -> tuple[Finding, ...]:
    """Compare the residuals of single views with what a camera of their own would leave.

    Parameters
    ----------
    measurements
        The views.
    closely
        Look even where the residuals are small, as robot and images do not agree.

    Raises
    ------
    SharedFaultError
        The camera is not that of the pictures, or they are sheared.
    """
    before = median_px(measurements)
    if before < (0.2 * HEALTHY_PX if closely else HEALTHY_PX):
        return ()
    found = None if measurements.camera.from_views else recalibrated(measurements)
    after = before if found is None else found.after_px
    if after > HEALTHY_PX or closely:  # No camera explains them, or none that robot and images agree with.
        shear, left = sheared_pictures.find_shear(measurements)
        if left < SHEAR_SHARE * after and abs(shear) > LEAST_SHEAR:
            raise _sheared(before, shear, left)
    if found is None:
        return ()
    given = measurements.camera
    kind, sentence = wrong_camera.told(given, found.camera)
    if kind is wrong_camera.LENS and before < STATED_SHARE * _stated_px(given):
        # The calibration itself says that it is no better: the estimate takes it as it is meant.
        return ()
    if not given.distortion.any() and kind is wrong_camera.LENS:
        if after < WRONG_SHARE * before:
            return (missing_distortion.finding(before, after),)
        return ()
    # Small residuals may well be those of circles or of a lens that no model follows.
    if after < (WRONG_SHARE if before > HEALTHY_PX else SMALL_SHARE) * before:
        raise _other_camera(kind, sentence, found)
    return ()


def check_lens(recording: Recording) -> None:
    """Look for another camera where the lens as stated shows hardly any view at all.

    Raises
    ------
    SharedFaultError
        The camera is not that of the pictures.
    """
    given = recording.camera
    if not len(given.distortion):
        return
    pinhole = Camera("pinhole", given.parameters[:4], *given.size_px)
    plain = Measurements.of_recording(replace(recording, camera=pinhole))
    found = recalibrated(plain) if len(plain) >= FEWEST_VIEWS else None
    if found is not None and found.after_px < min(HEALTHY_PX, SMALL_SHARE * found.before_px):
        raise _other_camera(*wrong_camera.told(given, found.camera), found)


def _stated_px(camera: Camera) -> float:
    """Root mean square over the image of the pixel deviation that a camera's own covariance means."""
    if camera.covariance is None:
        return 0.0
    width, height = camera.size_px
    u, v = np.meshgrid(np.linspace(0, width - 1, 7), np.linspace(0, height - 1, 7))
    rays, seen = camera.unproject(np.stack([u.ravel(), v.ravel()], axis=1))
    _, _, moved, valid = _core.project_jacobians(camera.lens, camera.parameters, rays[seen])
    moved = moved[valid]
    return float(np.sqrt(np.einsum("kai,ij,kaj->k", moved, camera.covariance, moved).mean()))


def _other_camera(kind: Kind, sentence: str, found: Recalibrated) -> SharedFaultError:
    hint = "give the calibration of this camera at this size, or leave the camera out: it is then calibrated "
    hint += "from the pictures"
    change = partial(_with_camera, camera=found.camera)
    return SharedFaultError(
        f"{sentence}: the points of a view fit within {found.before_px:.2g} px, through a camera found from "
        f"the pictures within {found.after_px:.2g} px",
        Hypothesis(kind, "recalibrated", sentence, hint, change),
    )


def _sheared(before_px: float, shear: float, after_px: float) -> SharedFaultError:
    sentence = f"the pictures are sheared: every row is shifted by {-shear:+.4f} px against the one above"
    hint = "read the frames with the right row length, and take the pictures again"
    change = partial(sheared_pictures.sheared, shear=shear)
    return SharedFaultError(
        f"{sentence}; the points of a view fit within {before_px:.2g} px, with rows shifted back within "
        f"{after_px:.2g} px",
        Hypothesis(sheared_pictures.KIND, "sheared", sentence, hint, change),
    )


def _with_camera(recording: Recording, camera: Camera) -> Recording:
    return replace(recording, camera=camera)
