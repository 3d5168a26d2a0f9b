"""Cameras in the files of others: each format a file, told by what is in it."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import cast

from handeye.codes import Code
from handeye.datasets.camera_files import (
    camera_info,
    depth_cameras,
    kalibr,
    opencv_storage,
    ost_text,
    ours,
    visp,
)
from handeye.datasets.camera_files.base import CameraFormat, Table
from handeye.datasets.documents import SUFFIXES, read_document_file
from handeye.datasets.reading import MIB, located, read_text
from handeye.datasets.toml_reading import parse_toml
from handeye.errors import InputError
from handeye.types import Camera

MAX_BYTES = 2 * MIB
# The first that recognises a document reads it: those whose keys say more come first.
FORMATS: tuple[CameraFormat, ...] = (
    visp.FORMAT,
    ours.FORMAT,
    camera_info.FILE,
    camera_info.MESSAGE,
    kalibr.FORMAT,
    depth_cameras.REALSENSE,
    depth_cameras.OPEN3D,
    opencv_storage.FORMAT,
)
_TEXT = frozenset({".txt", ".ini"})


def read_camera(path: str | os.PathLike[str]) -> Camera:
    """Read a camera from a file of ours or of others: TOML, JSON, YAML, XML or `ost.txt`.

    Raises
    ------
    InputError
        Not such a file; the message names file and field.

    Examples
    --------
    >>> import json, pathlib, handeye
    >>> from handeye.datasets.shipped import shipped_recording
    >>> camera = handeye.open_folder(shipped_recording()).recording.camera
    >>> _ = pathlib.Path("camera.json").write_text(json.dumps(camera.to_dict()))
    >>> read_camera("camera.json") == camera
    True
    """
    file = Path(path)
    document = _document(file)
    found = next((member for member in FORMATS if member.recognises(document)), None)
    with located(str(file)):
        if found is None:
            raise InputError(
                f"no camera in it: expected {', '.join(member.name for member in FORMATS)}, or ost.txt",
                code=Code.UNKNOWN_FORMAT,
                hint="docs/commands/solve.md shows how a camera is written",
            )
        return found.read(document)


def read_cameras(path: str | os.PathLike[str]) -> dict[str, Camera]:
    """Read the cameras of a chain of Kalibr, by their names; the one of any other file is `camera`.

    Where the cameras are in each other is found from the views.

    Raises
    ------
    InputError
        As for `read_camera`.

    Examples
    --------
    >>> import json
    >>> _ = Path("camera.json").write_text(json.dumps(camera.to_dict()))
    >>> list(read_cameras("camera.json"))
    ['camera']
    """
    file = Path(path)
    with located(str(file)):
        chain = kalibr.cameras_of(_document(file))
    return chain or {"camera": read_camera(file)}


def _document(file: Path) -> Table:
    suffix = file.suffix.lower()
    if suffix == ".toml":
        document: object = parse_toml(read_text(file, MAX_BYTES), file)
    elif suffix in _TEXT:
        document = ost_text.table_of(read_text(file, MAX_BYTES))
    elif suffix in SUFFIXES:
        document = read_document_file(file)
    else:
        raise InputError(
            f"{file}: a camera in a file of this kind, expected .toml, .json, .yaml, .yml, .xml or ost.txt",
            code=Code.UNKNOWN_FORMAT,
        )
    if not isinstance(document, Mapping):
        raise InputError(f"{file}: expected a table with the fields of a camera", code=Code.INVALID_FIELD)
    return {str(key): value for key, value in cast("Mapping[object, object]", document).items()}
