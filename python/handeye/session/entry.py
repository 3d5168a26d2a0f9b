"""One attempt at a view or a station, as the journal keeps it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from handeye.types import CameraView, Pose, Station, View
from handeye.types.plain import Document, read_document, without_none


class Failure(StrEnum):
    """Why an attempt brought no view.

    Examples
    --------
    >>> Failure("stale_image") is Failure.STALE_IMAGE
    True
    """

    NOT_CONFIRMED = "not_confirmed"
    MOTION_REFUSED = "motion_refused"
    ROBOT_FAILED = "robot_failed"
    BAD_READING = "bad_reading"
    NOT_MOVED = "not_moved"
    ELSEWHERE = "elsewhere"
    CAMERA_FAILED = "camera_failed"
    CAMERA_TIMEOUT = "camera_timeout"
    BAD_IMAGE = "bad_image"
    STALE_IMAGE = "stale_image"
    POOR_IMAGE = "poor_image"
    NOT_FOUND = "not_found"
    INCONSISTENT = "inconsistent"
    WITHDRAWN = "withdrawn"
    """A person took a view back."""


# Worth another try at the same place: nothing says that the place is to blame.
TRANSIENT = frozenset(
    {
        Failure.ROBOT_FAILED,
        Failure.BAD_READING,
        Failure.NOT_MOVED,
        Failure.CAMERA_FAILED,
        Failure.CAMERA_TIMEOUT,
        Failure.BAD_IMAGE,
        Failure.STALE_IMAGE,
        Failure.POOR_IMAGE,
        Failure.INCONSISTENT,
    }
)


class _SeenDocument(Document):
    camera: str
    target: str
    view: dict[str, Any]


class _EntryDocument(Document):
    number: int
    label: str
    phase: str
    goal: list[list[float]]
    goal_joints: list[float]
    moved: bool
    view: dict[str, Any] | None = None
    station: list[_SeenDocument] | None = None
    failure: Failure | None = None
    detail: str = ""
    decision: dict[str, Any] = {}  # noqa: RUF012 - msgspec copies an empty default
    timings_s: dict[str, float] = {}  # noqa: RUF012
    image_digest: str | None = None
    image_digests: list[str] = []  # noqa: RUF012
    standing_rad: list[float] | None = None
    withdraws: str | None = None


@dataclass(frozen=True)
class Entry:
    """One attempt.

    Parameters
    ----------
    number
        Counted from one.
    label
        View and number of the try at it: `view_04.2`.
    phase
        `start`, `plan`, `nudge`, `back` or `retry`: how the goal was chosen.
    goal, goal_joints
        Where the arm was sent.
    moved
        Whether it went there, as far as is known.
    view
        What came of it with one camera; None if nothing.
    failure, detail
        Why nothing came of it.
    decision
        Scores of all candidates, what was predicted, and how many candidates were turned down for what.
    timings_s
        Seconds that deciding, moving, exposing and detecting took.
    digests
        Of the images, to notice one that comes twice.
    standing_rad
        Joints where the robot said that it stood afterwards; None if it did not say.
    withdraws
        Name of a view or station that does not count any more; nothing was attempted then.
    station
        What came of it with several cameras; None if nothing.

    Examples
    --------
    >>> from handeye.types import Pose
    >>> failed = {"moved": False, "failure": Failure.NOT_CONFIRMED}
    >>> entry = Entry(1, "view_01.1", "start", Pose.identity(), (), **failed)
    >>> Entry.from_dict(entry.to_dict()).failure.value
    'not_confirmed'
    """

    number: int
    label: str
    phase: str
    goal: Pose
    goal_joints: tuple[float, ...]
    moved: bool
    view: View | None = None
    failure: Failure | None = None
    detail: str = ""
    decision: Mapping[str, Any] = field(default_factory=dict[str, Any])
    timings_s: Mapping[str, float] = field(default_factory=dict[str, float])
    digests: tuple[str, ...] = ()
    standing_rad: tuple[float, ...] | None = None
    withdraws: str | None = None
    station: Station | None = None

    @property
    def brought(self) -> View | Station | None:
        """The view or station that came of it; None if nothing."""
        return self.station if self.view is None else self.view

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON; `from_dict` reads them back."""
        return without_none(
            number=self.number,
            label=self.label,
            phase=self.phase,
            goal=self.goal.to_list(),
            goal_joints=list(self.goal_joints),
            moved=self.moved,
            view=None if self.view is None else self.view.to_dict(),
            station=None
            if self.station is None
            else [
                {"camera": one.camera, "target": one.target, "view": one.view.to_dict()}
                for one in self.station.views
            ],
            failure=None if self.failure is None else self.failure.value,
            detail=self.detail,
            decision=dict(self.decision),
            timings_s=dict(self.timings_s),
            image_digest=self.digests[0] if len(self.digests) == 1 else None,
            image_digests=list(self.digests) if len(self.digests) > 1 else None,
            standing_rad=None if self.standing_rad is None else list(self.standing_rad),
            withdraws=self.withdraws,
        )

    @classmethod
    def from_dict(cls, data: object, where: str = "entry") -> "Entry":
        """Read what `to_dict` wrote.

        Raises
        ------
        InputError
            A missing, unknown or unusable field.
        """
        document = read_document(data, _EntryDocument, where)
        return cls(
            document.number,
            document.label,
            document.phase,
            Pose(document.goal),
            tuple(document.goal_joints),
            document.moved,
            None if document.view is None else View.from_dict(document.view),
            document.failure,
            document.detail,
            document.decision,
            document.timings_s,
            (*([] if document.image_digest is None else [document.image_digest]), *document.image_digests),
            None if document.standing_rad is None else tuple(document.standing_rad),
            document.withdraws,
            None
            if document.station is None
            else Station(
                tuple(
                    CameraView(one.camera, one.target, View.from_dict(one.view)) for one in document.station
                )
            ),
        )


def views_of(entries: Sequence[Entry]) -> list[View]:
    """Return the views that attempts brought, without those that were withdrawn."""
    withdrawn = {entry.withdraws for entry in entries}
    return [entry.view for entry in entries if entry.view is not None and entry.view.name not in withdrawn]


def stations_of(entries: Sequence[Entry]) -> list[Station]:
    """Return the stations that attempts brought, without those that were withdrawn."""
    withdrawn = {entry.withdraws for entry in entries}
    found = [entry.station for entry in entries if entry.station is not None]
    return [station for station in found if station.name not in withdrawn]
