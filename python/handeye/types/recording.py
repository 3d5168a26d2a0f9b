"""A set of views with one camera and one target: what a calibration is made from."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.camera import Camera
from handeye.types.mounting import Mounting
from handeye.types.plain import Document, read_document, without_none
from handeye.types.pose import Pose
from handeye.types.target import Target
from handeye.types.view import View

# How far outside the image a point may lie, as a share of the longer side: room for an extrapolated corner.
OUTSIDE_SHARE = 0.05
MAX_NAME_LENGTH = 200
MAX_SOURCE_LENGTH = 2000


class _TruthDocument(Document):
    X: list[list[float]] | None = None
    Y: list[list[float]] | None = None


class _RecordingDocument(Document):
    name: str
    mounting: Mounting
    camera: dict[str, Any]
    target: dict[str, Any]
    views: list[dict[str, Any]]
    truth: dict[str, Any] | None = None
    source: str = ""


@dataclass(frozen=True)
class Truth:
    """What is known to be true: X and Y of the chain, where the recording was simulated.

    Raises
    ------
    InputError
        Neither X nor Y.

    Examples
    --------
    >>> Truth(X=Pose.identity()).to_dict()["X"][0]
    [1.0, 0.0, 0.0, 0.0]
    """

    X: Pose | None = None
    Y: Pose | None = None

    def __post_init__(self) -> None:
        if self.X is None and self.Y is None:
            raise InputError("truth: expected X, Y or both", code=Code.INVALID_FIELD)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or TOML; `from_dict` reads them back."""
        return without_none(
            X=None if self.X is None else self.X.to_list(), Y=None if self.Y is None else self.Y.to_list()
        )

    @classmethod
    def from_dict(cls, data: object) -> "Truth":
        """Read what `to_dict` wrote.

        Raises
        ------
        InputError
            A missing, unknown or unusable field.
        """
        document = read_document(data, _TruthDocument, "truth")
        return cls(
            None if document.X is None else Pose(document.X), None if document.Y is None else Pose(document.Y)
        )


@dataclass(frozen=True)
class Recording:
    """Views of one target through one camera, with the robot's pose for each.

    Parameters
    ----------
    name
        Name of the recording, one line.
    mounting
        Where the camera sits.
    camera
        The camera's calibration.
    target
        The calibration target.
    views
        The views, in the order of recording; may be empty while a session begins.
    truth
        What is known to be true, None for most recordings.
    source
        Where the data came from, in words; to be cited with results.

    Raises
    ------
    InputError
        Two views of one name, a point that the target does not have, or a pixel far outside the image.

    Examples
    --------
    >>> from handeye.datasets.shipped import shipped_recording
    >>> import handeye
    >>> len(handeye.open_folder(shipped_recording()).recording.views)
    30
    """

    name: str
    mounting: Mounting
    camera: Camera
    target: Target
    views: tuple[View, ...]
    truth: Truth | None = None
    source: str = ""

    def __post_init__(self) -> None:
        if not 0 < len(self.name) <= MAX_NAME_LENGTH or not self.name.isprintable():
            raise InputError(
                f"recording: name {self.name[:50]!r}, expected one line of 1 to {MAX_NAME_LENGTH} characters",
                code=Code.INVALID_NAME,
            )
        if len(self.source) > MAX_SOURCE_LENGTH or not self.source.replace("\n", "").isprintable():
            raise InputError(
                f"recording: source, expected text of at most {MAX_SOURCE_LENGTH} characters",
                code=Code.INVALID_FIELD,
            )
        object.__setattr__(self, "mounting", Mounting(self.mounting))
        object.__setattr__(self, "views", tuple(self.views))
        seen: set[str] = set()
        for view in self.views:
            # Compared without case: the names become files, and some file systems know no case.
            if view.name.lower() in seen:
                raise InputError(
                    f"view {view.name}: the name is there twice",
                    code=Code.DUPLICATE_VIEW,
                    hint="rename one of them",
                )
            seen.add(view.name.lower())
            check_points(view, self.target)
            _check_inside(view, self.camera)

    def __len__(self) -> int:
        return len(self.views)

    def view(self, name: str) -> View:
        """Return the view of a name.

        Raises
        ------
        InputError
            No such view.
        """
        for view in self.views:
            if view.name == name:
                return view
        raise InputError(f"view {name!r}: not in recording {self.name}", code=Code.UNKNOWN_VIEW)

    def select(self, names: Iterable[str]) -> "Recording":
        """Return the recording with the views of these names, in the order given.

        Raises
        ------
        InputError
            No such view, or a name twice.
        """
        return self.with_views(self.view(name) for name in names)

    def with_views(self, views: Iterable[View]) -> "Recording":
        """Return the recording with other views.

        Raises
        ------
        InputError
            The views do not fit the target or the camera.
        """
        return replace(self, views=tuple(views))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or TOML; `from_dict` reads them back."""
        return without_none(
            name=self.name,
            source=self.source,
            mounting=self.mounting.value,
            camera=self.camera.to_dict(),
            target=self.target.to_dict(),
            truth=None if self.truth is None else self.truth.to_dict(),
            views=[view.to_dict() for view in self.views],
        )

    @classmethod
    def from_dict(cls, data: object) -> "Recording":
        """Read what `to_dict` wrote.

        Raises
        ------
        InputError
            A missing, unknown or unusable field.
        """
        document = read_document(data, _RecordingDocument, "recording")
        return cls(
            name=document.name,
            mounting=document.mounting,
            camera=Camera.from_dict(document.camera),
            target=Target.from_dict(document.target),
            views=tuple(View.from_dict(view) for view in document.views),
            truth=None if document.truth is None else Truth.from_dict(document.truth),
            source=document.source,
        )


def check_points(view: View, target: Target) -> None:
    """Raise InputError where a view has points that the target has not."""
    largest = int(view.point_ids.max())
    if largest >= target.point_count:
        raise InputError(
            f"view {view.name}: point {largest}, but the {target.family} has {target.point_count} points "
            f"(0 to {target.point_count - 1})",
            code=Code.POINT_OUT_OF_RANGE,
            hint="check the size of the pattern",
        )


def _check_inside(view: View, camera: Camera) -> None:
    margin = OUTSIDE_SHARE * max(camera.size_px)
    low, high = view.pixels.min(axis=0), view.pixels.max(axis=0)
    if (low < -margin).any() or high[0] > camera.width_px + margin or high[1] > camera.height_px + margin:
        raise InputError(
            f"view {view.name}: pixels u {low[0]:.1f} to {high[0]:.1f}, v {low[1]:.1f} to {high[1]:.1f}, "
            f"but the image has {camera.width_px} x {camera.height_px} pixels",
            code=Code.PIXEL_OUTSIDE,
            hint="check that the camera's width_px and height_px belong to these images",
        )
