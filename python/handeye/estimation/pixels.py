"""What the pixels of the views say by themselves: their noise, and where they put the camera."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from statistics import median

import numpy as np

from handeye import _core
from handeye.errors import InputError
from handeye.estimation.camera_prior import CameraPrior
from handeye.estimation.rig_measurements import Pair, RigMeasurements
from handeye.types.arrays import FloatArray
from handeye.types.camera import Camera

# No view's pixel noise is believed to be less. Even on rendered pictures corners err by a hundredth of a
# pixel or so, much of it shared by neighbouring corners: such an error no number of points averages out.
LEAST_PIXEL_SIGMA = 0.01
# Degrees of freedom of the other views' pixel noise that a view's own is drawn to.
PIXEL_PRIOR_DEGREES = 20.0
# Beyond this, in pixels anywhere in the image, what was measured through the camera is measured again.
LARGEST_CAMERA_SHIFT_PX = 2.0


@dataclass(frozen=True, eq=False)
class Pixels:
    """Views of a pair as poses, deviations of their pixels (K,), and the factor for what neighbours share."""

    poses: _core.PoseMeasurements
    sigma_px: FloatArray
    shared: float

    @cached_property
    def usual_px(self) -> float:
        """Deviation of the pixels of an ordinary view, with what neighbours share."""
        return self.shared * median(self.sigma_px.tolist())


def pixels_of(measurements: RigMeasurements, priors: Mapping[str, CameraPrior]) -> dict[Pair, Pixels]:
    """Read the pixels of every pair that has views, once.

    Parameters
    ----------
    measurements
        As they are seen through the cameras of the priors.
    priors
        Which parameters of each camera are free.
    """
    found: dict[Pair, Pixels] = {}
    for (camera, target), measured in measurements.pairs.items():
        if len(measured) == 0:
            continue
        poses = _core.PoseMeasurements(
            measured.problem,
            measured.camera_poses,
            free_camera=list(priors[camera].free) or None,
            board_scale=True,
            sigmas_px=[
                None if view.sigmas_px is None else np.hypot(view.sigmas_px, LEAST_PIXEL_SIGMA)
                for view in measured.views
            ],
        )
        variances = poses.shrunk_variances(prior_degrees=PIXEL_PRIOR_DEGREES, floor_px2=LEAST_PIXEL_SIGMA**2)
        shared = poses.shared_error(variances)
        found[camera, target] = Pixels(poses, np.sqrt(variances), float(np.sqrt(shared)))
    return found


def camera_of_pixels(pixels: Mapping[Pair, Pixels], name: str, prior: CameraPrior) -> Camera:
    """Return the camera that its pixels and what is believed of it make likeliest, whatever the arm does.

    Of pixels that the belief comes from that is the camera as it is; so it is where they would make it none.

    Parameters
    ----------
    pixels
        Of every pair.
    name
        Which camera.
    prior
        What is believed of it.
    """
    count = len(prior.free)
    if count == 0 or prior.from_these_pixels:
        return prior.camera
    information, right = prior.information.copy(), prior.information @ prior.mean
    for (camera, _), one in pixels.items():
        if camera == name:
            # Beside the camera's parameters stands the board's scale, of which a plane's pixels say nothing.
            of_pixels, gradient = one.poses.camera_normal()
            weight = 1 / one.usual_px**2
            information += weight * of_pixels[:count, :count]
            right += weight * gradient[:count]
    scale = 1 / np.sqrt(np.diag(information))
    parameters = np.array(prior.camera.parameters)
    parameters[list(prior.free)] += scale * np.linalg.solve(
        information * np.outer(scale, scale), scale * right
    )
    try:
        return Camera(prior.camera.lens, parameters, *prior.camera.size_px)
    except InputError:
        return prior.camera


def moved_cameras(priors: Mapping[str, CameraPrior], cameras: Mapping[str, Camera]) -> dict[str, Camera]:
    """Return those of some cameras that are too far from where measurements were made through them.

    Parameters
    ----------
    priors
        With the cameras of the measurements.
    cameras
        As they were found, by name.
    """
    return {
        name: camera
        for name, camera in cameras.items()
        if camera is not priors[name].camera
        and not _shift_px(priors[name].camera, camera) < LARGEST_CAMERA_SHIFT_PX
    }


def _shift_px(before: Camera, after: Camera) -> float:
    return _core.camera_shift(before.lens, before.parameters, after.parameters, before.size_px)
