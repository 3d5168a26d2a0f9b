"""Our recording on disk: a folder that a person can read.

::

    recording.toml      format, version, name, source, mounting, view_count, [camera], [target], [truth],
                        [[view]] ...
    corners/NAME.csv    id,u_px,v_px and, where they are known, sigma_px
    images/NAME.png     optional

Lengths in metres, angles in radians, pixels with their centres at whole numbers; transforms as four rows of
four numbers. Unknown fields are errors: a misspelt one must not be silently without effect.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handeye.codes import Code
from handeye.datasets.corners import read_corners
from handeye.datasets.image_header import image_size
from handeye.datasets.plausibility import DataWarning, recording_warnings
from handeye.datasets.reading import existing_folder, inside, located
from handeye.datasets.recording_header import FILE_NAME, VERSION, read_versioned
from handeye.errors import InputError
from handeye.types import Camera, Mounting, Pose, Recording, Target, Truth, View
from handeye.types.plain import Document, read_document
from handeye.types.view import check_view_name

Rows = list[list[float]]


class ViewDocument(Document):
    """The table of a view."""

    name: str
    T_base_flange: Rows
    corners: str
    image: str | None = None
    timestamp_s: float | None = None
    joints_rad: list[float] | None = None


class RecordingDocument(Document):
    """All of `recording.toml`."""

    format: str
    version: int
    name: str
    mounting: Mounting
    camera: dict[str, Any]
    target: dict[str, Any]
    source: str = ""
    truth: dict[str, Rows] | None = None
    view_count: int | None = None
    view: list[ViewDocument] = []  # noqa: RUF012 - msgspec copies an empty default


@dataclass(frozen=True)
class LoadedRecording:
    """A recording, the folder it was read from, and what looks wrong with it.

    Attributes
    ----------
    recording
        The recording.
    folder
        Where it was read from; images are relative to it.
    warnings
        Values that are possible but hardly meant.

    Examples
    --------
    >>> loaded = read_recording(folder)
    >>> len(loaded.recording), loaded.warnings
    (9, ())
    """

    recording: Recording
    folder: Path
    warnings: tuple[DataWarning, ...] = ()

    def image_path(self, view: View) -> Path | None:
        """Return the path of the image of a view, None if it was not kept."""
        return None if view.image is None else self.folder / view.image


def read_recording(folder: str | os.PathLike[str]) -> LoadedRecording:
    """Read a recording.

    Raises
    ------
    InputError
        A file that is missing or not what it should be, a newer version, a path that leaves the folder, an
        image of another size than the camera's, or values that make no recording. The message names file,
        view and field.

    Examples
    --------
    >>> from handeye.datasets.shipped import shipped_recording
    >>> read_recording(shipped_recording()).recording.name
    'CS_synthetic_3'
    """
    root = existing_folder(folder)
    file = root / FILE_NAME
    document = read_recording_document(file)
    with located(str(file)):
        if document.view_count not in {None, len(document.view)}:
            raise InputError(
                f"{len(document.view)} views, but view_count is {document.view_count}",
                code=Code.TRUNCATED,
                hint="the file may have been cut off; if it was edited on purpose, correct view_count",
            )
        camera = Camera.from_dict(document.camera)
        recording = Recording(
            name=document.name,
            mounting=document.mounting,
            camera=camera,
            target=Target.from_dict(document.target),
            views=tuple(_read_view(view, root, camera) for view in document.view),
            truth=None if document.truth is None else _read_truth(document.truth, document.mounting),
            source=document.source,
        )
    return LoadedRecording(recording, root, recording_warnings(recording))


@dataclass(frozen=True)
class ViewsApart:
    """A recording without its views, and each view by its name, or what is wrong with it."""

    recording: Recording
    views: dict[str, View | InputError]


def read_views_apart(folder: str | os.PathLike[str]) -> ViewsApart:
    """Read a recording of which single views may be damaged; its truth is left out.

    Raises
    ------
    InputError
        The recording cannot be read at all.
    """
    root = existing_folder(folder)
    file = root / FILE_NAME
    document = read_recording_document(file)
    views: dict[str, View | InputError] = {}
    with located(str(file)):
        camera = Camera.from_dict(document.camera)
        target = Target.from_dict(document.target)
        recording = Recording(document.name, document.mounting, camera, target, (), source=document.source)
        for view in document.view:
            try:
                views[check_view_name(view.name)] = _read_view(view, root, camera)
            except InputError as error:
                views[view.name] = error
    return ViewsApart(recording, views)


def read_recording_document(file: Path) -> RecordingDocument:
    """Read `recording.toml` alone.

    Raises
    ------
    InputError
        It cannot be read, or is one of several cameras or targets.
    """
    data = read_versioned(file)
    if data["version"] != VERSION:
        raise InputError(
            f"{file}: several cameras or targets, expected one of each",
            code=Code.SEVERAL_CAMERAS,
            hint="handeye solve takes them together",
        )
    return read_document(data, RecordingDocument, str(file))


def _read_view(document: ViewDocument, root: Path, camera: Camera) -> View:
    where = f"view {check_view_name(document.name)}"
    with located(f"{where}: T_base_flange"):
        T_base_flange = Pose(document.T_base_flange)
    ids, pixels, sigmas = read_corners(inside(root, document.corners, f"{where}: corners"))
    view = View(
        document.name,
        T_base_flange,
        ids,
        pixels,
        document.image,
        document.timestamp_s,
        document.joints_rad,
        sigmas,
    )
    if view.image is not None:
        size = image_size(inside(root, view.image, f"{where}: image"))
        if size is not None and size != camera.size_px:
            raise InputError(
                f"{where}: image {view.image} has {size[0]} x {size[1]} pixels, the camera "
                f"{camera.width_px} x {camera.height_px}",
                code=Code.IMAGE_SIZE,
                hint="the camera must be calibrated at the size of the images",
            )
    return view


def _read_truth(table: dict[str, Rows], mounting: Mounting) -> Truth:
    names = (mounting.x_name, mounting.y_name)
    for name in table:
        if name not in names:
            raise InputError(f"truth: {name[:60]!r}, expected {' or '.join(names)}", code=Code.INVALID_FIELD)
    poses: list[Pose | None] = []
    for name in names:
        with located(f"truth: {name}"):
            poses.append(Pose(table[name]) if name in table else None)
    return Truth(*poses)
