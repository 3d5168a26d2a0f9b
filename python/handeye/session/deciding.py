"""What a decision of the loop may look at, and what it can be: a step, or a halt."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from handeye.estimation import Estimate, Measurements, RigEstimate
from handeye.planning import Pool, Proposal, Stop, StopReason
from handeye.robots.protocol import Goal
from handeye.session.entry import TRANSIENT, Entry
from handeye.session.starting import Start
from handeye.types import Station, View
from handeye.types.arrays import FloatArray
from handeye.types.kinematics import Kinematics

# Views before anything is planned.
START_VIEWS = 3


class EndReason(StrEnum):
    """How a run ended.

    Examples
    --------
    >>> EndReason("accuracy_reached") is EndReason.ACCURACY_REACHED
    True
    """

    ACCURACY_REACHED = "accuracy_reached"
    VIEWS_TAKEN = "views_taken"
    NO_CANDIDATE = "no_candidate"
    OUT_OF_REACH = "out_of_reach"
    NO_START = "no_start"
    TOO_MANY_FAILURES = "too_many_failures"
    ROBOT_HANGS = "robot_hangs"
    BY_HAND = "by_hand"
    REFUSED = "refused"


# Ends without an answer.
FAILED = (EndReason.NO_START, EndReason.TOO_MANY_FAILURES, EndReason.ROBOT_HANGS, EndReason.REFUSED)


@dataclass(frozen=True, eq=False)
class Attempts(ABC):
    """What was tried so far.

    Parameters
    ----------
    entries
        All attempts so far.
    forgiven
        How many of the attempts since the last view do not count any more: the session ended with them, and
        was told to go on.
    outvoted
        How many views or stations there were when the session, which had ended without an answer, was told to
        go on: new ones may be taken until they are the more.
    doubtful
        Whether what was seen contradicts itself so that nobody can say yet which of it is wrong.
    """

    entries: tuple[Entry, ...]
    forgiven: int = field(default=0, kw_only=True)
    outvoted: int = field(default=0, kw_only=True)
    doubtful: bool = field(default=False, kw_only=True)

    @property
    @abstractmethod
    def taken(self) -> int:
        """Return how many views or stations count."""

    @property
    @abstractmethod
    def is_open(self) -> bool:
        """Tell whether there is no answer yet."""

    @property
    def goes_on(self) -> bool:
        """Tell whether no promise of accuracy is to be believed: only the number of views ends it."""
        return self.doubtful or (self.outvoted > 0 and self.is_open)

    @cached_property
    def missed(self) -> list[Entry]:
        """Return the attempts since the last view or station."""
        missed: list[Entry] = []
        for entry in reversed(self.entries):
            if entry.brought is not None:
                break
            missed.append(entry)
        return missed[::-1]

    @property
    def counted(self) -> list[Entry]:
        """Return the attempts since the last view that count against going on."""
        return self.missed[self.forgiven :]

    @property
    def next_number(self) -> int:
        """Return the number of the next view: all that are in the journal are counted, usable or not."""
        return 1 + sum(1 for entry in self.entries if entry.brought is not None)

    def label(self, what: str) -> str:
        """Return the label of the next attempt at a view or station: its number, and that of the try."""
        return f"{what}_{self.next_number:02d}.{1 + len(self.missed)}"

    def joints(self, taken: View | Station) -> tuple[float, ...]:
        """Return the joints of a view or station; where nobody tells them, some that reach the goal."""
        if taken.joints_rad is not None:
            return taken.joints_rad
        entry = next(e for e in self.entries if e.brought is not None and e.brought.name == taken.name)
        return entry.goal_joints

    def standing(self, start: Start) -> tuple[float, ...] | None:
        """Return the joints where the arm stands, as far as the journal knows; None if nobody tells."""
        if not start.posture_known:
            return None
        for entry in reversed(self.entries):
            told = None if entry.brought is None else self.joints(entry.brought)
            for joints in (entry.standing_rad, told, entry.goal_joints if entry.moved else None):
                # Older sessions may hold readings that are not of this arm.
                if joints is not None and len(joints) == len(start.joints_rad):
                    return joints
        return start.joints_rad

    def too_many(self, most: int) -> "Halt | None":
        """Return that too many attempts in a row brought nothing, None if they are fewer."""
        if len(self.counted) < most:
            return None
        last = self.counted[-1]
        return Halt(
            EndReason.TOO_MANY_FAILURES,
            f"{len(self.counted)} attempts in a row brought no view; the last: {last.failure}: {last.detail}",
        )

    def full(self, most: int, what: str) -> "Halt | None":
        """Return that as many were taken as asked for, without an answer; None if they are fewer."""
        if not self.is_open or self.taken < max(most, 2 * self.outvoted + 1):
            return None
        return Halt(EndReason.VIEWS_TAKEN, f"{self.taken} {what} taken, as asked")

    def to_repeat(self, tries: int) -> Entry | None:
        """Return the last attempt if it failed for no reason of its place, and is worth another try there."""
        if not self.counted or self.counted[-1].failure not in TRANSIENT:
            return None
        last = self.counted[-1]
        done = sum(1 for entry in self.counted if entry.goal_joints == last.goal_joints)
        return None if done >= tries else last


@dataclass(frozen=True, eq=False)
class Situation(Attempts):
    """Everything that a decision follows from with one camera, besides what was asked for.

    Parameters
    ----------
    views
        What the attempts brought, without what was withdrawn.
    measurements
        Those of them to plan from: views that turned out wrong are left out.
    estimate
        What is believed; None after fewer than three views.

    Examples
    --------
    >>> Situation((), (), measurements, None).missed
    []
    """

    views: tuple[View, ...]
    measurements: Measurements
    estimate: Estimate | None

    @property
    def taken(self) -> int:
        """Return how many views count."""
        return len(self.views)

    @property
    def is_open(self) -> bool:
        """Tell whether the views are in doubt or do not determine the answer."""
        return self.doubtful or self.estimate is None or not self.estimate.determined


@dataclass(frozen=True, eq=False)
class Considered:
    """What a decision chose from, for those who look on.

    Parameters
    ----------
    pool, gains
        Candidates, and the gain (N,) of each; NaN where too little of the target would be in sight.
    ruled_out, reasons
        (M, 4, 4) poses of the flange that were turned down, and why.
    """

    pool: Pool
    gains: FloatArray
    ruled_out: FloatArray = field(default_factory=lambda: np.zeros((0, 4, 4)))
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Step:
    """What to do next, how it was decided, from what, and how many seconds that took.

    `believed` is what is believed of several cameras; `estimate` of one.

    Examples
    --------
    >>> from handeye.robots.protocol import Goal
    >>> Step(Goal("view_01.1", recording.views[0].T_base_flange), "hand", {}, None).goal.label
    'view_01.1'
    """

    goal: Goal
    phase: str
    decision: dict[str, Any]
    estimate: Estimate | None
    seconds: float = 0.0
    considered: Considered | None = None
    believed: RigEstimate | None = None


@dataclass(frozen=True)
class Halt:
    """That nothing is to be done next, and why.

    Examples
    --------
    >>> Halt(EndReason.NO_CANDIDATE, "no posture left").reason.value
    'no_candidate'
    """

    reason: EndReason
    sentence: str


class Chooser(Protocol):
    """Decides what to do next; the same situation always leads to the same decision.

    Examples
    --------
    >>> class Stopping:
    ...     kinematics = None
    ...     def choose(self, situation):
    ...         return Halt(EndReason.BY_HAND, "enough")
    >>> Stopping().choose(None).sentence
    'enough'
    """

    @property
    def kinematics(self) -> Kinematics | None:
        """How the joints move the arm, in the frames of the poses that it reports; None if unknown."""
        ...

    def choose(self, situation: Situation) -> Step | Halt:
        """Return the next step, or why there is none."""
        ...


def halt_of(stop: Stop) -> Halt:
    """Return the halt that a planner's stop means."""
    known = {
        StopReason.ACCURACY_REACHED: EndReason.ACCURACY_REACHED,
        StopReason.NO_CANDIDATE: EndReason.NO_CANDIDATE,
        StopReason.OUT_OF_REACH: EndReason.OUT_OF_REACH,
    }
    return Halt(known.get(stop.reason, EndReason.VIEWS_TAKEN), stop.sentence)


def decision_of(answer: Proposal, estimate: Estimate, more: Mapping[str, Any]) -> dict[str, Any]:
    """Return how a proposal came about, for the journal."""
    now = estimate.within_95
    return {
        "predicted_gain": answer.predicted_gain,
        "candidates": {
            name: round(float(gain), 6)
            for name, gain in zip(answer.names, answer.gains, strict=True)
            if np.isfinite(gain)
        },
        "reach_before": {"translation_mm": now.translation_mm, "rotation_deg": now.rotation_deg},
        **more,
    }
