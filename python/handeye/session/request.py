"""How accurate the answer must be, as people ask for it: with a probability, at the camera."""

from dataclasses import dataclass

import numpy as np

from handeye.errors import InputError
from handeye.planning import Stop, StopReason, StopRule
from handeye.planning.stopping import State
from handeye.solving import Estimate
from handeye.types.arrays import FloatArray

PROBABILITY = 0.95
_DRAWS = 20_000


@dataclass(frozen=True)
class Reach:
    """Radii within which the error lies with a probability: millimetres and degrees."""

    translation_mm: float
    rotation_deg: float


def reach(estimate: Estimate, probability: float = PROBABILITY) -> Reach:
    """Return how far off the answer may be, with a probability.

    The translation is that of the camera's centre. Where the noise levels were estimated, the error has the
    heavier tails of Student's t.
    """
    covariance = estimate.hand_eye_covariance
    return Reach(
        1e3 * radius(covariance[:3, :3], estimate.degrees_of_freedom, probability),
        float(np.rad2deg(radius(covariance[3:, 3:], estimate.degrees_of_freedom, probability))),
    )


def radius(covariance: FloatArray, degrees_of_freedom: float, probability: float = PROBABILITY) -> float:
    """Return the radius within which a vector of a covariance (3, 3) lies with a probability, in its unit."""
    # A fixed sample: the same covariance has the same radius, to a hundredth.
    random = np.random.default_rng(20)
    draws = random.standard_normal((_DRAWS, 3))
    if np.isfinite(degrees_of_freedom):
        draws /= np.sqrt(random.chisquare(degrees_of_freedom, _DRAWS) / degrees_of_freedom)[:, np.newaxis]
    variances = np.clip(np.linalg.eigvalsh(covariance), 0, None)
    return float(np.quantile(np.sqrt(draws**2 @ variances), probability))


@dataclass(frozen=True)
class Requested(StopRule):
    """Stop once the error lies within both radii with 95 % probability.

    Raises
    ------
    InputError
        A radius that is not above zero.
    """

    translation_mm: float
    rotation_deg: float
    fewest_views: int = 6

    def __post_init__(self) -> None:
        if not (self.translation_mm > 0 and self.rotation_deg > 0):
            raise InputError(
                f"accuracy {self.translation_mm} mm and {self.rotation_deg} deg, expected above zero",
                code="out_of_range",
            )

    def verdict(self, state: State) -> Stop | None:
        """Stop once it is reached."""
        if state.views < self.fewest_views or not state.estimate.determined:
            return None
        now = reach(state.estimate)
        if now.translation_mm > self.translation_mm or now.rotation_deg > self.rotation_deg:
            return None
        return Stop(
            StopReason.ACCURACY_REACHED,
            f"with 95 % probability within {now.translation_mm:.2g} mm and {now.rotation_deg:.2g} deg, "
            "as asked",
            {"translation_mm": now.translation_mm, "rotation_deg": now.rotation_deg},
        )
