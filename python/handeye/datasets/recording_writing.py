"""Writing a recording: a new folder all at once, one that is there already file by file, the table last."""

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from handeye.codes import Code
from handeye.datasets.corners import corners_text
from handeye.datasets.reading import inside, is_file, read_text
from handeye.datasets.recording_format import read_recording_document
from handeye.datasets.recording_header import FILE_NAME, FORMAT, MAX_BYTES, VERSION
from handeye.datasets.toml_text import toml_text
from handeye.datasets.writing import copy_file, is_occupied, new_folder, replace_file, write_file
from handeye.errors import HandeyeError, InputError, OutputError
from handeye.types import Camera, Recording, Target, View
from handeye.types.plain import without_none


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
        RecordingFolder(target).update(recording, source)
        return
    with new_folder(target) as partial:
        (partial / "corners").mkdir()
        tables = [_write_view(view, partial, source) for view in recording.views]
        write_file(partial / FILE_NAME, _text(recording, [_table_text(table) for table in tables]))


@dataclass(frozen=True, eq=False)
class _Written:
    """A view as it lies on the disk: the file of its corners, and its table."""

    view: View
    corners: str
    text: str


class RecordingFolder:
    """A recording that is there already and to which one process alone writes.

    What this object wrote it does not look at again: one more view costs its own files, and the table.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: dict[str, _Written] | None = None

    def update(self, recording: Recording, images_from: Path | None = None) -> None:
        """Replace what is there: what is new goes beside the old, then `recording.toml` in one step.

        A file that the old `recording.toml` names is never written to, so the old recording stays whole until
        the step.

        Raises
        ------
        OutputError
            There is no recording that can be read, an image is missing, or the system refuses to write.
        """
        # After a failure nothing is known of what lies there.
        known, self._written = self._written, None
        old = self._found() if known is None else {name: one.corners for name, one in known.items()}
        added: list[Path] = []
        text = b""
        try:
            (self._folder / "corners").mkdir(exist_ok=True)
            written = [
                self._of_view(view, known, old.get(view.name), images_from, added) for view in recording.views
            ]
            text = _text(recording, [one.text for one in written])
            replace_file(self._folder / FILE_NAME, text)
        except BaseException as error:
            if not self._is_current(text):
                for path in added:
                    path.unlink(missing_ok=True)
            if isinstance(error, OSError):
                raise OutputError(f"{self._folder}: cannot be written ({error})") from error
            raise
        kept = {one.corners for one in written}
        for corners in old.values():
            if corners not in kept:
                _remove_corners(self._folder, corners)
        self._written = {one.view.name: one for one in written}

    def _found(self) -> dict[str, str]:
        """Return the file of the corners of each view that is there."""
        try:
            document = read_recording_document(self._folder / FILE_NAME)
        except InputError as error:
            raise OutputError(
                f"{self._folder}: not replaced, as it holds no recording that can be read: {error}",
                code=Code.EXISTS,
            ) from error
        return {view.name: view.corners for view in document.view}

    def _of_view(
        self,
        view: View,
        known: dict[str, _Written] | None,
        corners: str | None,
        images_from: Path | None,
        added: list[Path],
    ) -> _Written:
        one = None if known is None else known.get(view.name)
        if one is not None and one.view is view:
            return one
        if corners is not None and self._holds(corners, corners_text(view)):
            image = keep_image(view, self._folder, images_from, view.name)
            table = _view_table(view, corners, image)
        else:
            table = _write_view(view, self._folder, images_from)
            added.append(self._folder / table["corners"])
        return _Written(view, table["corners"], _table_text(table))

    def _is_current(self, text: bytes) -> bool:
        """Tell whether the step is done: an interruption may come right after it."""
        try:
            return read_text(self._folder / FILE_NAME, MAX_BYTES).encode() == text
        except InputError:
            return True  # in doubt, what lies around does no harm

    def _holds(self, path: str, text: str) -> bool:
        try:
            return read_text(inside(self._folder, path, "recording"), MAX_BYTES) == text
        except InputError:
            return False


def _occupied(folder: Path) -> bool:
    try:
        return is_occupied(folder)
    except (OSError, ValueError) as error:
        raise OutputError(f"{folder}: cannot be written ({error})") from error


def _text(recording: Recording, tables: list[str]) -> bytes:
    """Return `recording.toml` with the texts of the tables of its views."""
    mounting, truth = recording.mounting, recording.truth
    poses = {} if truth is None else {mounting.x_name: truth.X, mounting.y_name: truth.Y}
    head = without_none(
        format=FORMAT,
        version=VERSION,
        name=recording.name,
        source=recording.source,
        mounting=mounting.value,
        view_count=len(tables),
        truth={name: pose.to_list() for name, pose in poses.items() if pose is not None} or None,
    )
    cell = _camera_text(recording.camera), _target_text(recording.target)
    truths = toml_text({"truth": head.pop("truth")}) if "truth" in head else ""
    return "".join([toml_text(head), *cell, truths, *tables]).encode()


# A session writes the same ones with every view.
@lru_cache(maxsize=4)
def _camera_text(camera: Camera) -> str:
    return toml_text({"camera": camera.to_dict()})


@lru_cache(maxsize=4)
def _target_text(target: Target) -> str:
    return toml_text({"target": target.to_dict()})


def _table_text(table: dict[str, Any]) -> str:
    return toml_text({"view": [table]})


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
        raise OutputError(f"{folder}: {error}", code=Code.MISSING_FILE) from error
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


def _remove_corners(folder: Path, corners: str) -> None:
    """Remove a file that no view names any more; if that fails, it only takes up room."""
    try:
        inside(folder, corners, "corners").unlink()
    except (HandeyeError, OSError):
        return
