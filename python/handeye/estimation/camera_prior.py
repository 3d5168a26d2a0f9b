"""What is believed of a camera before its pictures are solved: how well it is known, and from where."""

from dataclasses import dataclass

import numpy as np

from handeye.types.arrays import FloatArray
from handeye.types.camera import OPENCV_LENSES, Camera
from handeye.types.ordinary_lens import DISTORTION_SIGMAS

# Without a covariance: relative focal length, principal point as a share of the width, and coefficients.
DEFAULT_FOCAL_SIGMA = 0.002
DEFAULT_CENTRE_SIGMA = 0.002
DEFAULT_DISTORTION_SIGMA = 0.02
# A lens that was never measured (no coefficients, or all zero): what ordinary lenses are like.
UNMEASURED_LENS = "brown_conrady_5"
# Lenses for which zeros say that nothing was measured.
UNMEASURED_FORMS = OPENCV_LENSES - {"kannala_brandt"}


@dataclass(frozen=True, eq=False)
class CameraPrior:
    """Free parameters of a camera and a Gaussian belief about them.

    Parameters
    ----------
    camera
        The camera at which measurements are made; its lens may have more parameters than the given one.
    free
        Indices of the free parameters; empty where the camera is held.
    information
        (n, n) information of the free parameters.
    mean
        (n,) where it is centred, relative to the parameters of `camera`.
    inflated
        Whether the stated covariance may be too small by a factor that the views find.
    from_these_pixels
        Whether it comes from the very pictures that are solved: their pixels then say nothing more of it.
    """

    camera: Camera
    free: tuple[int, ...]
    information: FloatArray
    mean: FloatArray
    inflated: bool
    from_these_pixels: bool

    def moved(self, camera: Camera) -> "CameraPrior":
        """Return the same belief relative to other parameters."""
        given = self.camera.parameters[list(self.free)] + self.mean
        return CameraPrior(
            camera,
            self.free,
            self.information,
            given - camera.parameters[list(self.free)],
            self.inflated,
            self.from_these_pixels,
        )


def camera_prior(camera: Camera, *, fixed: bool = False) -> CameraPrior:
    """Return the prior of a camera: its covariance, or what cameras of its kind are known to.

    `fixed` holds the camera as it is. A camera without covariance has a wide prior, and one without any
    distortion a lens that is found within what ordinary lenses are like.
    """
    if fixed:
        return CameraPrior(camera, (), np.zeros((0, 0)), np.zeros(0), inflated=False, from_these_pixels=False)
    covariance = camera.covariance
    if covariance is None:
        unmeasured = camera.lens in UNMEASURED_FORMS and not camera.distortion.any()
        if unmeasured:
            zeros = np.zeros(len(DISTORTION_SIGMAS[UNMEASURED_LENS]))
            camera = Camera(UNMEASURED_LENS, np.concatenate([camera.parameters[:4], zeros]), *camera.size_px)
        fx, fy, _, _ = camera.parameters[:4]
        centre = DEFAULT_CENTRE_SIGMA * camera.width_px
        deviations = [DEFAULT_FOCAL_SIGMA * fx, DEFAULT_FOCAL_SIGMA * fy, centre, centre]
        deviations += (
            DISTORTION_SIGMAS[UNMEASURED_LENS]
            if unmeasured
            else [DEFAULT_DISTORTION_SIGMA] * (len(camera.parameters) - 4)
        )
        covariance = np.diag(np.square(deviations))
    free = tuple(int(i) for i in np.flatnonzero(np.diag(covariance) > 0))
    block = covariance[np.ix_(free, free)]
    # Scaled to a correlation, whose inverse is well conditioned whatever the units.
    scale = np.sqrt(np.diag(block))
    correlation = block / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(correlation)
    known = np.abs(values) > 1e-12 * np.abs(values).max(initial=0.0)
    vectors = vectors[:, known] / scale[:, np.newaxis]
    information = (vectors / values[known]) @ vectors.T
    return CameraPrior(
        camera,
        free,
        information,
        np.zeros(len(free)),
        inflated=not camera.from_views,
        from_these_pixels=camera.from_views,
    )
