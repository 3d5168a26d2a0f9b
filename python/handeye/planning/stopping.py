"""When to stop: one class per rule, each with the evidence for its verdict."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.accuracy import tool_deviations_m
from handeye.estimation.estimate import Estimate
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray


class StopReason(StrEnum):
    """Why planning ended.

    Examples
    --------
    >>> StopReason("no_candidate") is StopReason.NO_CANDIDATE
    True
    """

    VIEWS_TAKEN = "views_taken"
    GAIN_BELOW_THRESHOLD = "gain_below_threshold"
    ACCURACY_REACHED = "accuracy_reached"
    NO_CANDIDATE = "no_candidate"
    OUT_OF_REACH = "out_of_reach"


@dataclass(frozen=True)
class Stop:
    """The end of planning, with its evidence.

    Examples
    --------
    >>> Stop(StopReason.VIEWS_TAKEN, "12 views taken, as asked").reason.value
    'views_taken'
    """

    reason: StopReason
    sentence: str
    evidence: dict[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, eq=False)
class State:
    """What a stop rule may look at: measurements, what is believed, gains (N,) of the candidates left."""

    measurements: Measurements
    estimate: Estimate
    gains: FloatArray

    @property
    def views(self) -> int:
        """Number of views taken."""
        return len(self.measurements)

    @property
    def best_gain(self) -> float | None:
        """Largest gain; None without a feasible candidate."""
        return None if np.all(np.isnan(self.gains)) else float(np.nanmax(self.gains))


class StopRule(ABC):
    """Looks at the state before a proposal is made.

    Examples
    --------
    >>> isinstance(NumberOfViews(12), StopRule)
    True
    """

    @abstractmethod
    def verdict(self, state: State) -> Stop | None:
        """Return the end, or None to go on."""


@dataclass(frozen=True)
class NumberOfViews(StopRule):
    """Stop at a number of views.

    Raises
    ------
    InputError
        Fewer than three.

    Examples
    --------
    >>> NumberOfViews(12).views
    12
    """

    views: int

    def __post_init__(self) -> None:
        if self.views < 3:
            raise InputError(f"number of views {self.views}, expected at least 3", code=Code.OUT_OF_RANGE)

    def verdict(self, state: State) -> Stop | None:
        """Stop once enough views are taken."""
        if state.views < self.views:
            return None
        evidence = {"views": state.views, "asked": self.views}
        return Stop(StopReason.VIEWS_TAKEN, f"{state.views} views taken, as asked", evidence)


@dataclass(frozen=True)
class GainThreshold(StopRule):
    """Stop when the best candidate gains too little (Yang, Rebello and Waslander 2023, eq. 15).

    Examples
    --------
    >>> GainThreshold(0.1).threshold_nats
    0.1
    """

    threshold_nats: float

    def verdict(self, state: State) -> Stop | None:
        """Stop once no candidate gains the threshold."""
        best = state.best_gain
        if not state.estimate.determined or best is None or best >= self.threshold_nats:
            return None
        return Stop(
            StopReason.GAIN_BELOW_THRESHOLD,
            f"the best view left would gain {best:.3g}, below the threshold {self.threshold_nats:.3g}",
            {"best_gain": best, "threshold": self.threshold_nats},
        )


@dataclass(frozen=True)
class Accuracy(StopRule):
    """Stop when the predicted standard deviations of the hand-eye are small enough.

    Examples
    --------
    >>> Accuracy(sigma_translation_mm=0.2, sigma_rotation_deg=0.02).sigma_translation_mm
    0.2
    """

    sigma_translation_mm: float
    sigma_rotation_deg: float

    def verdict(self, state: State) -> Stop | None:
        """Stop once both are reached."""
        if not state.estimate.determined:
            return None
        covariance = state.estimate.hand_eye_covariance
        translation = float(np.sqrt(np.trace(covariance[:3, :3])) * 1e3)
        rotation = float(np.rad2deg(np.sqrt(np.trace(covariance[3:, 3:]))))
        if translation > self.sigma_translation_mm or rotation > self.sigma_rotation_deg:
            return None
        return Stop(
            StopReason.ACCURACY_REACHED,
            f"predicted standard deviation {translation:.2g} mm and {rotation:.2g} deg, as asked",
            {"sigma_translation_mm": translation, "sigma_rotation_deg": rotation},
        )


@dataclass(frozen=True, eq=False)
class ToolAccuracy(StopRule):
    """Stop when the predicted standard deviation at tool points is small enough.

    Parameters
    ----------
    points_camera_m
        (P, 3) points in the camera frame, metres: a tool centre point, or the corners of a working box.
    sigma_mm
        What the worst of them may have.

    Examples
    --------
    >>> ToolAccuracy(np.array([[0.0, 0.0, 0.2]]), sigma_mm=0.3).points_camera_m.shape
    (1, 3)
    """

    points_camera_m: FloatArray
    sigma_mm: float

    def verdict(self, state: State) -> Stop | None:
        """Stop once the worst point is good enough."""
        if not state.estimate.determined:
            return None
        deviations = tool_deviations_m(state.estimate.hand_eye_covariance, self.points_camera_m) * 1e3
        worst = float(deviations.max())
        if worst > self.sigma_mm:
            return None
        return Stop(
            StopReason.ACCURACY_REACHED,
            f"predicted standard deviation {worst:.2g} mm at the worst of {len(deviations)} points, as asked",
            {"worst_mm": worst, "mean_mm": float(deviations.mean()), "asked_mm": self.sigma_mm},
        )


def first_verdict(rules: Sequence[StopRule], state: State) -> Stop | None:
    """Return the first end that a rule calls for; without a feasible candidate there is always one."""
    for rule in rules:
        stop = rule.verdict(state)
        if stop is not None:
            return stop
    if state.best_gain is None:
        return Stop(
            StopReason.NO_CANDIDATE,
            "no candidate left that shows enough of the target",
            {"candidates": len(state.gains)},
        )
    return None
