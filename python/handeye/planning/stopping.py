"""When to stop: one class per rule, each with the evidence for its verdict."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from handeye.errors import InputError
from handeye.solving.estimate import Estimate
from handeye.types.arrays import FloatArray


class StopReason(StrEnum):
    """Why planning ended."""

    VIEWS_TAKEN = "views_taken"
    GAIN_BELOW_THRESHOLD = "gain_below_threshold"
    ACCURACY_REACHED = "accuracy_reached"
    NO_CANDIDATE = "no_candidate"


@dataclass(frozen=True)
class Stop:
    """The end of planning, with its evidence."""

    reason: StopReason
    sentence: str
    evidence: dict[str, Any] = field(default_factory=dict[str, Any])


class StopRule(ABC):
    """Looks at the state before a proposal is made."""

    @abstractmethod
    def verdict(self, views: int, estimate: Estimate, gains: FloatArray) -> Stop | None:
        """Return the end, or None to go on.

        Parameters
        ----------
        views
            Number of views taken.
        estimate
            What is believed.
        gains
            (N,) gains of the candidates left; NaN for infeasible ones.
        """


@dataclass(frozen=True)
class NumberOfViews(StopRule):
    """Stop at a number of views.

    Raises
    ------
    InputError
        Fewer than three.
    """

    views: int

    def __post_init__(self) -> None:
        if self.views < 3:
            raise InputError(f"number of views {self.views}, expected at least 3", code="out_of_range")

    def verdict(self, views: int, estimate: Estimate, gains: FloatArray) -> Stop | None:
        """Stop once enough views are taken."""
        if views < self.views:
            return None
        return Stop(
            StopReason.VIEWS_TAKEN, f"{views} views taken, as asked", {"views": views, "asked": self.views}
        )


@dataclass(frozen=True)
class GainThreshold(StopRule):
    """Stop when the best candidate gains too little (Yang, Rebello and Waslander 2023, eq. 15)."""

    threshold_nats: float

    def verdict(self, views: int, estimate: Estimate, gains: FloatArray) -> Stop | None:
        """Stop once no candidate gains the threshold."""
        if not estimate.determined or np.all(np.isnan(gains)):
            return None
        best = float(np.nanmax(gains))
        if best >= self.threshold_nats:
            return None
        return Stop(
            StopReason.GAIN_BELOW_THRESHOLD,
            f"the best view left would gain {best:.3g}, below the threshold {self.threshold_nats:.3g}",
            {"best_gain": best, "threshold": self.threshold_nats},
        )


@dataclass(frozen=True)
class Accuracy(StopRule):
    """Stop when the predicted standard deviations of the hand-eye are small enough."""

    sigma_translation_mm: float
    sigma_rotation_deg: float

    def verdict(self, views: int, estimate: Estimate, gains: FloatArray) -> Stop | None:
        """Stop once both are reached."""
        if not estimate.determined:
            return None
        covariance = estimate.hand_eye_covariance
        translation = float(np.sqrt(np.trace(covariance[:3, :3])) * 1e3)
        rotation = float(np.rad2deg(np.sqrt(np.trace(covariance[3:, 3:]))))
        if translation > self.sigma_translation_mm or rotation > self.sigma_rotation_deg:
            return None
        return Stop(
            StopReason.ACCURACY_REACHED,
            f"predicted standard deviation {translation:.2g} mm and {rotation:.2g} deg, as asked",
            {"sigma_translation_mm": translation, "sigma_rotation_deg": rotation},
        )


def first_verdict(
    rules: Sequence[StopRule], views: int, estimate: Estimate, gains: FloatArray
) -> Stop | None:
    """Return the first end that a rule calls for; without a feasible candidate there is always one."""
    for rule in rules:
        stop = rule.verdict(views, estimate, gains)
        if stop is not None:
            return stop
    if np.all(np.isnan(gains)):
        return Stop(
            StopReason.NO_CANDIDATE,
            "no candidate left that shows enough of the target",
            {"candidates": len(gains)},
        )
    return None
