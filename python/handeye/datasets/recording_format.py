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

from handeye.datasets.corners import corners_text, read_corners
from handeye.datasets.image_header import image_size
from handeye.datasets.plausibility import DataWarning, recording_warnings
from handeye.datasets.reading import existing_folder, inside, is_file, located, read_text
from handeye.datasets.recording_header import FILE_NAME, FORMAT, MAX_BYTES, VERSION, read_versioned
from handeye.datasets.toml_text import toml_text
from handeye.datasets.writing import copy_file, is_occupied, new_folder, replace_file, write_file
from handeye.errors import HandeyeError, InputError, OutputError
from handeye.types import Camera, Mounting, Pose, Recording, Target, Truth, View
from handeye.types.plain import Document, read_document, without_none
from handeye.types.view import check_view_name

Rows = list[list[float]]


class _ViewDocument(Document):
    name: str
    T_base_flange: Rows
    corners: str
    image: str | None = None
    timestamp_s: float | None = None
    joints_rad: list[float] | None = None


class _RecordingDocument(Document):
    format: str
    version: int
    name: str
    mounting: Mounting
    camera: dict[str, Any]
    target: dict[str, Any]
    source: str = ""
    truth: dict[str, Rows] | None = None
    view_count: int | None = None
    view: list[_ViewDocument] = []  # noqa: RUF012 - msgspec copies an empty default


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
    document = _read_document(file)
    with located(str(file)):
        if document.view_count not in {None, len(document.view)}:
            raise InputError(
                f"{len(document.view)} views, but view_count is {document.view_count}",
                code="truncated",
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
    document = _read_document(file)
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


def write_empty_recording(recording: Recording, folder: Path) -> None:
    """Write `recording.toml` alone, without views, into a folder that has lost its own.

    Raises
    ------
    OutputError
        The system refuses to write.
    """
    replace_file(folder / FILE_NAME, _text(recording.with_views(()), []))


def write_recording(
    recording: Recording,
    folder: str | os.PathLike[str],
    *,
    images_from: str | os.PathLike[str] | None = None,
    replace: bool = False,
) -> None:
    """Write a recording; a reader finds all of it or, after an error, what was there before.

    Parameters
    ----------
    recording
        What to write.
    folder
        A folder that does not exist yet or is empty; its parent exists.
    images_from
        The folder that the images of the views are relative to; they are copied to `images/`. With None no
        image is copied, and views keep only an image that lies in `folder` already.
    replace
        Update a recording that is there already. Images are never removed.

    Raises
    ------
    OutputError
        The folder is not empty (without `replace`) or holds no recording (with it), an image is missing, or
        the system refuses to write: no space, no permission, read-only.

    Examples
    --------
    >>> import pathlib, handeye
    >>> from handeye.datasets.shipped import shipped_recording
    >>> write_recording(handeye.read_recording(shipped_recording()).recording, pathlib.Path("copy"))
    >>> handeye.read_recording("copy").recording.name
    'CS_synthetic_3'
    """
    target = Path(folder)
    source = None if images_from is None else Path(images_from)
    if replace and _occupied(target):
        _update(recording, target, source)
        return
    with new_folder(target) as partial:
        (partial / "corners").mkdir()
        tables = [_write_view(view, partial, source) for view in recording.views]
        write_file(partial / FILE_NAME, _text(recording, tables))


def _read_document(file: Path) -> _RecordingDocument:
    data = read_versioned(file)
    if data["version"] != VERSION:
        raise InputError(
            f"{file}: several cameras or targets, expected one of each",
            code="several_cameras",
            hint="handeye solve takes them together",
        )
    return read_document(data, _RecordingDocument, str(file))


def _read_view(document: _ViewDocument, root: Path, camera: Camera) -> View:
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
                code="image_size",
                hint="the camera must be calibrated at the size of the images",
            )
    return view


def _read_truth(table: dict[str, Rows], mounting: Mounting) -> Truth:
    names = (mounting.x_name, mounting.y_name)
    for name in table:
        if name not in names:
            raise InputError(f"truth: {name[:60]!r}, expected {' or '.join(names)}", code="invalid_field")
    poses: list[Pose | None] = []
    for name in names:
        with located(f"truth: {name}"):
            poses.append(Pose(table[name]) if name in table else None)
    return Truth(*poses)


def _occupied(folder: Path) -> bool:
    try:
        return is_occupied(folder)
    except (OSError, ValueError) as error:
        raise OutputError(f"{folder}: cannot be written ({error})") from error


def _text(recording: Recording, tables: list[dict[str, Any]]) -> bytes:
    mounting, truth = recording.mounting, recording.truth
    poses = {} if truth is None else {mounting.x_name: truth.X, mounting.y_name: truth.Y}
    document = without_none(
        format=FORMAT,
        version=VERSION,
        name=recording.name,
        source=recording.source,
        mounting=mounting.value,
        view_count=len(tables),
        camera=recording.camera.to_dict(),
        target=recording.target.to_dict(),
        truth={name: pose.to_list() for name, pose in poses.items() if pose is not None} or None,
        view=tables,
    )
    return toml_text(document).encode()


def _write_view(view: View, folder: Path, images_from: Path | None) -> dict[str, Any]:
    """Write the files of a view under names that are free; return its table."""
    corners = _free_name(folder, "corners", view.name, ".csv")
    write_file(folder / corners, corners_text(view).encode())
    return _view_table(view, corners, keep_image(view, folder, images_from, view.name))


def _view_table(view: View, corners: str, image: str | None) -> dict[str, Any]:
    return without_none(
        name=view.name,
        image=image,
        corners=corners,
        timestamp_s=view.timestamp_s,
        joints_rad=None if view.joints_rad is None else list(view.joints_rad),
        T_base_flange=view.T_base_flange.to_list(),
    )


def keep_image(view: View, folder: Path, images_from: Path | None, stem: str) -> str | None:
    """Return the path of the image in the folder, copied there if need be; None if there is none."""
    if view.image is None:
        return None
    if images_from is None:
        return view.image if is_file(folder / view.image) else None
    try:
        source = inside(images_from, view.image, f"view {view.name}: image")
        if source.is_relative_to(folder.resolve()):
            return view.image
    except (InputError, OSError) as error:
        raise OutputError(f"{folder}: {error}", code="missing_file") from error
    name = _free_name(folder, "images", stem, source.suffix.lower())
    try:
        (folder / "images").mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written ({error})") from error
    copy_file(source, folder / name)
    return name


def _free_name(folder: Path, below: str, name: str, suffix: str) -> str:
    """Return `below/name.suffix`, or with a number if that is taken."""
    candidate, number = f"{below}/{name}{suffix}", 1
    while (folder / candidate).exists() or (folder / candidate).is_symlink():
        number += 1
        candidate = f"{below}/{name}.{number}{suffix}"
    return candidate


def _update(recording: Recording, folder: Path, images_from: Path | None) -> None:
    """Replace a recording: what is new goes beside the old, then `recording.toml` in one step.

    A file that the old `recording.toml` names is never written to, so the old recording stays whole until
    the step.
    """
    try:
        old = {view.name: view for view in _read_document(folder / FILE_NAME).view}
    except InputError as error:
        raise OutputError(
            f"{folder}: not replaced, as it holds no recording that can be read: {error}", code="exists"
        ) from error
    written: list[Path] = []
    text = b""
    try:
        (folder / "corners").mkdir(exist_ok=True)
        tables = [
            _updated_view(view, old.get(view.name), folder, images_from, written) for view in recording.views
        ]
        text = _text(recording, tables)
        replace_file(folder / FILE_NAME, text)
    except BaseException as error:
        if not _is_current(folder, text):
            for path in written:
                path.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise OutputError(f"{folder}: cannot be written ({error})") from error
        raise
    kept = {table["corners"] for table in tables}
    for view in old.values():
        if view.corners not in kept:
            _remove_corners(folder, view.corners)


def _is_current(folder: Path, text: bytes) -> bool:
    """Tell whether the step is done: an interruption may come right after it."""
    try:
        return read_text(folder / FILE_NAME, MAX_BYTES).encode() == text
    except InputError:
        return True  # in doubt, what lies around does no harm


def _updated_view(
    view: View, old: _ViewDocument | None, folder: Path, images_from: Path | None, written: list[Path]
) -> dict[str, Any]:
    if old is not None and _holds(folder, old.corners, corners_text(view)):
        return _view_table(view, old.corners, keep_image(view, folder, images_from, view.name))
    table = _write_view(view, folder, images_from)
    written.append(folder / table["corners"])
    return table


def _holds(folder: Path, corners: str, text: str) -> bool:
    try:
        return read_text(inside(folder, corners, "corners"), MAX_BYTES) == text
    except InputError:
        return False


def _remove_corners(folder: Path, corners: str) -> None:
    """Remove a file that no view names any more; if that fails, it only takes up room."""
    try:
        inside(folder, corners, "corners").unlink()
    except (HandeyeError, OSError):
        return
