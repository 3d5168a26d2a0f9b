"""Corners to a hundredth of a pixel: a picture of the corner is fitted to the grey values around it.

Two edges cross, each blurred by a Gaussian (the lens, and the area of a pixel), and divide the window into
four parts of uniform grey. Place, directions, blur and greys are found by least squares on the pixels along
the edges: several times closer to the truth on rendered boards than `cv2.findChessboardCornersSB`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import Image
from handeye.types.arrays import FloatArray, IndexArray

LARGEST_RADIUS_PX = 30.0
SMALLEST_RADIUS_PX = 2.0
MAX_ITERATIONS = 12
STEP_TOLERANCE_PX = 5e-4
# A pixel alone blurs like a Gaussian of 0.29 px; more than 4 px is no corner.
BLUR_RANGE_PX = (0.25, 4.0)
# Cameras sharpen, and guess colours between the pixels that see them: where an edge runs along the rows of
# pixels that shifts it, less so in a picture smoothed beforehand (standard deviation).
SMOOTHING_PX = 1.0
# Half the width of the strip along each edge that is looked at.
BAND_PX = 4.0
# Least grey step across an edge.
LEAST_CONTRAST = 4.0
# Least share of the window that lies inside the image.
LEAST_INSIDE = 0.75
# Corners fitted at a time: so many windows fit into the processor's cache.
_CHUNK = 48


class CornerKind(Enum):
    """What meets at a corner."""

    CROSSING = "crossing"
    """Two dark and two light squares, diagonally equal; the light may change across the window."""
    QUADRANTS = "quadrants"
    """Four parts of any grey: the corner of a tag, with or without a square that touches it."""


def fit_corners(
    image: Image,
    corners: FloatArray,
    directions: FloatArray,
    radii: FloatArray,
    kind: CornerKind,
    curvatures: FloatArray | None = None,
    bands: FloatArray | None = None,
) -> FloatArray:
    """Return corners (N, 2), NaN where the fit fails.

    Parameters
    ----------
    corners
        (N, 2) first guesses, off by no more than a pixel or two.
    directions
        (N, 2, 2) directions of the two edges, first guesses.
    radii
        (N,) radius around each corner, in pixels, in which there are no other edges.
    kind
        What meets at the corners.
    curvatures
        (N, 2) curvatures of the two edges in 1 / px, towards their normals (-sin, cos); a lens bends straight
        edges. None for straight ones.
    bands
        (N,) distance from the edges, in pixels, beyond which there is something else; None for nothing.
    """
    smooth = np.asarray(cv2.GaussianBlur(image.astype(np.float32), (0, 0), SMOOTHING_PX), dtype=np.float32)
    width = np.full(len(corners), BAND_PX) if bands is None else np.minimum(bands, BAND_PX)
    bend = np.zeros((len(corners), 2)) if curvatures is None else curvatures
    result = np.full((len(corners), 2), np.nan)
    usable = np.isfinite(corners).all(axis=1) & np.isfinite(directions).all(axis=(1, 2)) & (radii > 0)
    clipped = np.clip(radii, SMALLEST_RADIUS_PX, LARGEST_RADIUS_PX)
    for chosen in _chunks(clipped, usable):
        windows = _Windows.around(
            smooth, corners[chosen], directions[chosen], clipped[chosen], width[chosen], bend[chosen]
        )
        result[chosen] = _fitted(windows, corners[chosen], directions[chosen], clipped[chosen], kind)
    return result


def _chunks(radii: FloatArray, usable: NDArray[np.bool_]) -> Iterator[IndexArray]:
    """Yield corners with windows of one size, not too many at a time."""
    sizes = np.ceil(radii).astype(np.int64)
    for size in np.unique(sizes[usable]):
        members = np.flatnonzero(usable & (sizes == size))
        for start in range(0, len(members), _CHUNK):
            yield members[start : start + _CHUNK]


@dataclass
class _Windows:
    """Pixels around corners (N).

    Places (N, P, 2) relative to a pixel (N, 2) each, their grey values and weights (N, P), and the curvatures
    (N, 2) of the edges; and how much (N,) of each window lies inside the image.
    """

    origin: FloatArray
    places: FloatArray
    grey: FloatArray
    weight: FloatArray
    bend: FloatArray
    share_inside: FloatArray

    @classmethod
    def around(
        cls,
        image: NDArray[np.float32],
        corners: FloatArray,
        directions: FloatArray,
        radii: FloatArray,
        bands: FloatArray,
        bend: FloatArray,
    ) -> "_Windows":
        """Take the pixels near the edges; those further away tell nothing about the corner."""
        reach = int(np.ceil(radii.max())) + 1
        v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1]
        disc = np.column_stack([u.ravel(), v.ravel()])[np.hypot(u, v).ravel() <= reach + 0.5]
        origin = np.rint(corners)
        offset = disc - (corners - origin)[:, np.newaxis]
        across = [
            np.abs(d[:, :1] * offset[..., 1] - d[:, 1:] * offset[..., 0]) for d in directions.swapaxes(0, 1)
        ]
        number = min(len(disc), int(np.ceil(2 * (2 * BAND_PX) * 2 * reach)))
        from_edge = np.minimum(*across)
        near = np.argpartition(from_edge, number - 1, axis=1)[:, :number]
        places = disc[near].astype(np.float64)
        offset = np.take_along_axis(offset, near[:, :, np.newaxis], axis=1)
        columns, rows = (origin[:, np.newaxis] + places).astype(np.int64).transpose(2, 0, 1)
        height, width = image.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        grey = image[rows.clip(0, height - 1), columns.clip(0, width - 1)].astype(np.float64)
        # A soft rim, so that no pixel leaps in or out as the corner moves.
        rim = np.clip(radii[:, np.newaxis] - np.hypot(offset[..., 0], offset[..., 1]) + 0.5, 0, 1)
        strip = np.clip(bands[:, np.newaxis] - np.take_along_axis(from_edge, near, axis=1) + 0.5, 0, 1)
        weight = rim * strip
        whole = np.maximum(weight.sum(axis=1), 1e-9)
        return cls(origin, places, grey, weight * inside, bend, (weight * inside).sum(axis=1) / whole)


# Columns of the parameters.
_X, _Y, _FIRST, _SECOND, _LOG_BLUR, _MEAN, _A, _B, _PRODUCT = range(9)


def _fitted(
    windows: _Windows, corners: FloatArray, directions: FloatArray, radii: FloatArray, kind: CornerKind
) -> FloatArray:
    parameters = np.zeros((len(corners), 9))
    parameters[:, :2] = corners - windows.origin
    parameters[:, _FIRST] = np.arctan2(directions[:, 0, 1], directions[:, 0, 0])
    parameters[:, _SECOND] = np.arctan2(directions[:, 1, 1], directions[:, 1, 0])
    parameters[:, _LOG_BLUR] = np.log(SMOOTHING_PX)
    start = parameters[:, :2].copy()
    # The greys enter linearly: solved once for the first guess of the rest.
    _, jacobian = _model(parameters, windows, kind)
    linear = jacobian[..., _MEAN:]
    parameters[:, _MEAN:] = _solved(linear, windows, windows.grey, np.full(len(corners), 1e-6))
    parameters = _minimised(parameters, windows, kind)
    moved = np.hypot(*(parameters[:, :2] - start).T)
    good = (
        (moved <= np.maximum(0.25 * radii, 1.5))
        & (np.abs(parameters[:, _PRODUCT]) * 2 >= LEAST_CONTRAST)
        & (parameters[:, _LOG_BLUR] < np.log(BLUR_RANGE_PX[1]) - 1e-6)
        & (windows.share_inside >= LEAST_INSIDE)
    )
    return np.where(good[:, np.newaxis], windows.origin + parameters[:, :2], np.nan)


def _minimised(parameters: FloatArray, windows: _Windows, kind: CornerKind) -> FloatArray:
    """Levenberg-Marquardt on every corner by itself, all at once."""
    predicted, jacobian = _model(parameters, windows, kind)
    cost = _cost(windows, predicted)
    damping = np.full(len(parameters), 1e-3)
    for _ in range(MAX_ITERATIONS):
        step = _solved(jacobian, windows, windows.grey - predicted, damping)
        step[:, :2] = np.clip(step[:, :2], -1, 1)
        step[:, _LOG_BLUR] = np.clip(step[:, _LOG_BLUR], -0.5, 0.5)
        trial = parameters + step
        trial[:, _LOG_BLUR] = np.clip(trial[:, _LOG_BLUR], *np.log(BLUR_RANGE_PX))
        trial_predicted, trial_jacobian = _model(trial, windows, kind)
        trial_cost = _cost(windows, trial_predicted)
        better = trial_cost <= cost
        parameters = np.where(better[:, np.newaxis], trial, parameters)
        cost = np.where(better, trial_cost, cost)
        predicted = np.where(better[:, np.newaxis], trial_predicted, predicted)
        jacobian = np.where(better[:, np.newaxis, np.newaxis], trial_jacobian, jacobian)
        damping = np.where(better, damping / 10, damping * 10)
        if (np.abs(step[:, :2]).max(axis=1) < STEP_TOLERANCE_PX).all():
            break
    return parameters


def _cost(windows: _Windows, predicted: FloatArray) -> FloatArray:
    return np.asarray((windows.weight * (windows.grey - predicted) ** 2).sum(axis=1), dtype=np.float64)


def _solved(jacobian: FloatArray, windows: _Windows, residual: FloatArray, damping: FloatArray) -> FloatArray:
    """Return the damped Gauss-Newton steps (N, n)."""
    weighted = jacobian * windows.weight[:, :, np.newaxis]
    normal = weighted.swapaxes(1, 2) @ jacobian
    right = weighted.swapaxes(1, 2) @ residual[:, :, np.newaxis]
    diagonal = np.einsum("nii->ni", normal)
    n = normal.shape[1]
    ridge = damping[:, np.newaxis] * diagonal + 1e-9
    damped = normal + ridge[:, :, np.newaxis] * np.eye(n)
    return np.asarray(np.linalg.solve(damped, right), dtype=np.float64)[:, :, 0]


def _model(parameters: FloatArray, windows: _Windows, kind: CornerKind) -> tuple[FloatArray, FloatArray]:
    """Return grey values (N, P) and their derivatives (N, P, 9) in the parameters."""
    offset = windows.places - parameters[:, np.newaxis, :2]
    blur = np.exp(parameters[:, _LOG_BLUR, np.newaxis])
    first = _edge(offset, parameters[:, _FIRST], blur, windows.bend[:, 0])
    second = _edge(offset, parameters[:, _SECOND], blur, windows.bend[:, 1])
    mean, a, b, product = (parameters[:, i, np.newaxis] for i in (_MEAN, _A, _B, _PRODUCT))
    both = first.side * second.side
    one = np.ones_like(both)
    if kind is CornerKind.CROSSING:
        basis = (one, offset[..., 0], offset[..., 1], both)
        by_first, by_second = product * second.side, product * first.side
        drift = a, b
    else:
        basis = (one, first.side, second.side, both)
        by_first, by_second = a + product * second.side, b + product * first.side
        drift = 0.0, 0.0
    predicted = mean * basis[0] + a * basis[1] + b * basis[2] + product * basis[3]
    across_first, across_second = by_first * first.slope, by_second * second.slope
    jacobian = np.stack(
        [
            -across_first * first.normal[0] - across_second * second.normal[0] - drift[0],
            -across_first * first.normal[1] - across_second * second.normal[1] - drift[1],
            -across_first * first.along,
            -across_second * second.along,
            -across_first * first.distance - across_second * second.distance,
            *basis,
        ],
        axis=-1,
    )
    return predicted, jacobian


@dataclass
class _Edge:
    """A blurred edge: normal (N, 1); distance, place along it, side (-1 to 1) and its slope, all (N, P)."""

    normal: tuple[FloatArray, FloatArray]
    distance: FloatArray
    along: FloatArray
    side: FloatArray
    slope: FloatArray


def _edge(offset: FloatArray, angle: FloatArray, blur: FloatArray, bend: FloatArray) -> _Edge:
    cosine, sine = np.cos(angle)[:, np.newaxis], np.sin(angle)[:, np.newaxis]
    along = cosine * offset[..., 0] + sine * offset[..., 1]
    # A parabola stands for the arc; its derivatives, which matter little to a step, are left out.
    distance = cosine * offset[..., 1] - sine * offset[..., 0] - 0.5 * bend[:, np.newaxis] * along * along
    scaled = distance / blur
    bell = np.exp(-0.5 * scaled * scaled)
    slope = np.sqrt(2 / np.pi) * bell / blur
    return _Edge((-sine, cosine), distance, along, _erf(scaled / np.sqrt(2), bell), slope)


def _erf(x: FloatArray, bell: FloatArray) -> FloatArray:
    """Return the error function, given `exp(-x^2)`; Abramowitz and Stegun 7.1.26, good to 1.5e-7."""
    t = 1 / (1 + 0.3275911 * np.abs(x))
    series = ((((1.061405429 * t - 1.453152027) * t + 1.421413741) * t - 0.284496736) * t + 0.254829592) * t
    return np.sign(x) * (1 - series * bell)
