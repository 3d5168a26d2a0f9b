"""Every statement of how far off the answer may be: radii with a probability, the ellipsoid behind them."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from handeye.estimation.f_distribution import f_quantile
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Calibration
from handeye.types.units import MM_PER_M


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An ellipsoid around a position.

    Parameters
    ----------
    probability
        Probability that it holds the truth.
    semi_axes_m
        (3,) lengths of its semi-axes, the longest first.
    directions
        (3, 3) their directions in the camera frame, one a row.
    """

    probability: float
    semi_axes_m: FloatArray
    directions: FloatArray

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        return {
            "probability": self.probability,
            "semi_axes_mm": (self.semi_axes_m * MM_PER_M).tolist(),
            "directions": self.directions.tolist(),
            "frame": "camera",
        }


PROBABILITY = 0.95
_DRAWS = 20_000


@dataclass(frozen=True)
class Within:
    """Radii within which the error of the camera's centre, and of its rotation, lies with a probability."""

    translation_mm: float
    rotation_deg: float

    def to_dict(self) -> dict[str, float]:
        """Return plain values for JSON."""
        return {"translation_mm": self.translation_mm, "rotation_deg": self.rotation_deg}


def within(covariance: FloatArray, degrees_of_freedom: float, probability: float = PROBABILITY) -> Within:
    """Return how far off the answer may be: the headline of every output.

    Parameters
    ----------
    covariance
        (6, 6) covariance of the twist of X, whose translation is that of the camera's centre.
    degrees_of_freedom
        Of the noise levels behind it: where they were estimated, the error has the heavier tails of
        Student's t.
    """
    return Within(
        MM_PER_M * radius(covariance[:3, :3], degrees_of_freedom, probability),
        float(np.rad2deg(radius(covariance[3:, 3:], degrees_of_freedom, probability))),
    )


def radius(covariance: FloatArray, degrees_of_freedom: float, probability: float = PROBABILITY) -> float:
    """Return the radius within which a vector of a covariance (n, n) lies with a probability, in its unit."""
    return float(radii(covariance[np.newaxis], degrees_of_freedom, probability)[0])


def radii(
    covariances: FloatArray,
    degrees_of_freedom: float,
    probability: float = PROBABILITY,
    means: FloatArray | None = None,
) -> FloatArray:
    """(Q,) radii within which vectors of covariances (Q, n, n) lie, about zero or means (Q, n)."""
    variances, axes = np.linalg.eigh(covariances)
    variances = np.clip(variances, 0, None)
    if means is None:
        squares = _squares(covariances.shape[-1], degrees_of_freedom)
        return np.sqrt(np.quantile(squares @ variances.T, probability, axis=0))
    draws = _drawn(covariances.shape[-1], degrees_of_freedom)
    deviations = np.sqrt(variances)
    centres = np.einsum("qji,qj->qi", axes, means)
    return np.array(
        [
            np.sqrt(np.quantile(np.square(draws * deviation + centre).sum(axis=1), probability))
            for deviation, centre in zip(deviations, centres, strict=True)
        ]
    )


@lru_cache(maxsize=8)
def _drawn(size: int, degrees_of_freedom: float) -> FloatArray:
    """Return a fixed sample (20000, size): the same covariance has the same radius, to a hundredth."""
    random = np.random.default_rng(20)
    draws = random.standard_normal((_DRAWS, size))
    if np.isfinite(degrees_of_freedom):
        draws /= np.sqrt(random.chisquare(degrees_of_freedom, _DRAWS) / degrees_of_freedom)[:, np.newaxis]
    draws.setflags(write=False)
    return draws


@lru_cache(maxsize=8)
def _squares(size: int, degrees_of_freedom: float) -> FloatArray:
    """Return the squares of `_drawn`."""
    squares = np.square(_drawn(size, degrees_of_freedom))
    squares.setflags(write=False)
    return squares


def position_region(calibration: Calibration, probability: float = PROBABILITY) -> Ellipsoid:
    """Return the ellipsoid that holds the true position of the camera with a probability."""
    return ellipsoid(calibration.covariance[:3, :3], calibration.degrees_of_freedom, probability)


def ellipsoid(
    covariance: FloatArray, degrees_of_freedom: float, probability: float = PROBABILITY
) -> Ellipsoid:
    """Return the ellipsoid that holds a position of this covariance C (3, 3), metres, with a probability.

    ``rho' C^-1 rho <= 3 F(3, nu)``, nu the degrees of freedom of the noise levels behind it.
    """
    variances, vectors = np.linalg.eigh(covariance)
    scale = 3 * f_quantile(probability, 3, degrees_of_freedom)
    lengths = np.sqrt(np.clip(variances, 0, None) * scale)
    return Ellipsoid(probability, lengths[::-1].copy(), vectors.T[::-1].copy())


def foretold(before: FloatArray, whole: FloatArray, after: FloatArray, *, comes_again: bool) -> FloatArray:
    """Covariances (..., 6, 6) of X after stations that would leave these by the information alone.

    In units of what the information leaves before them, the covariance of the estimate has values above
    one along some axes. Where the arm is not described that excess is what comes again in every view, and
    stays; elsewhere it is what is not known of the noise, and falls with the rest.

    Parameters
    ----------
    before, whole
        (6, 6) what the information leaves now, and the covariance of the estimate.
    after
        (..., 6, 6) what the information leaves after them.
    comes_again
        Whether what `whole` exceeds `before` by stays.

    Examples
    --------
    >>> foretold(np.eye(6), 2 * np.eye(6), 0.5 * np.eye(6), comes_again=True)[0, 0].item()
    1.5
    """
    root = np.linalg.cholesky(before)
    inverse = np.linalg.inv(root)
    values, axes = np.linalg.eigh(inverse @ whole @ inverse.T)
    kept = np.maximum(values - 1.0, 0.0) if comes_again else np.zeros(6)
    scale = np.sqrt(np.maximum(values - kept, 0.0))
    relative = axes.T @ inverse @ after @ inverse.T @ axes
    back = root @ axes
    return np.asarray(back @ (scale[:, np.newaxis] * relative * scale + np.diag(kept)) @ back.T)
