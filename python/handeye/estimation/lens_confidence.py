"""How well the lens is known, in pixels: what its parameters leave open of where rays meet the image."""

import numpy as np

from handeye import _core
from handeye.estimation.confidence import PROBABILITY, radius
from handeye.estimation.estimate import Estimate
from handeye.types.arrays import FloatArray
from handeye.types.camera import Camera

# Pixels that are looked at, across and down.
GRID = (9, 7)


def lens_within_px(estimate: Estimate, probability: float = PROBABILITY) -> float:
    """Return within how many pixels the lens is known with a probability.

    The root mean square over the image of how far pixels are off, after the turn of the camera that explains
    most of it: that turn is part of X. Zero where the camera is held.

    Parameters
    ----------
    estimate
        What is believed of the camera's free parameters, with the tails of Student's t.
    """
    return radius(_of_pixels(estimate), estimate.degrees_of_freedom, probability)


def lens_deviation_px(estimate: Estimate) -> float:
    """Return the standard deviation of what `lens_within_px` bounds."""
    return float(np.sqrt(np.trace(_of_pixels(estimate))))


def _of_pixels(estimate: Estimate) -> FloatArray:
    """(n, n) covariance of a vector whose length is the root mean square over the image."""
    free = estimate.free_camera
    if not free:
        return np.zeros((1, 1))
    covariance = estimate.covariance[12 : 12 + len(free), 12 : 12 + len(free)]
    camera = estimate.camera
    rays = _rays(camera)
    _, _, in_parameters, _ = _core.project_jacobians(camera.lens, camera.parameters, rays)
    deviations = np.sqrt(np.diag(covariance))
    moved = _without_turn(in_parameters[:, :, list(free)].reshape(2 * len(rays), len(free)), camera, rays)
    # The mean square is a quadratic form of the parameters; its square root is the length of a vector.
    root = np.linalg.cholesky(moved.T @ moved / len(rays) + 1e-18 * np.diag(1 / deviations**2))
    return root.T @ covariance @ root


def lens_difference_px(camera: Camera, other: Camera) -> float:
    """Return how far two cameras of one image size differ, as `lens_within_px` counts it."""
    rays = _rays(camera)
    here, _ = camera.project(rays)
    there, seen = other.project(rays)
    off = (there - here).reshape(-1, 1)
    keep = np.repeat(seen, 2)
    off = _without_turn(off[keep], camera, rays[seen])
    return float(np.sqrt(np.sum(off**2) / max(int(seen.sum()), 1)))


def _rays(camera: Camera) -> FloatArray:
    """(N, 3) rays through the pixels that are looked at, as far as the lens sees there."""
    width, height = camera.size_px
    u, v = np.meshgrid(np.linspace(0, width - 1, GRID[0]), np.linspace(0, height - 1, GRID[1]))
    rays, seen = camera.unproject(np.stack([u.ravel(), v.ravel()], axis=1))
    return rays[seen]


def _without_turn(off: FloatArray, camera: Camera, rays: FloatArray) -> FloatArray:
    """Return pixel differences (2 N, n) without what a small turn of the camera explains."""
    _, in_points, _, _ = _core.project_jacobians(camera.lens, camera.parameters, rays)
    turned: FloatArray = np.einsum("kij,akj->kia", in_points, np.cross(np.eye(3)[:, np.newaxis], rays))
    turns = turned.reshape(2 * len(rays), 3)
    explained, *_ = np.linalg.lstsq(turns, off, rcond=None)
    return off - turns @ explained
