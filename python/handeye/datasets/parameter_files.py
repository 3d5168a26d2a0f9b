"""Cameras and targets in files of their own, as people keep them.

A camera: our TOML or JSON (the fields at the top level or in a table `camera`, so a `recording.toml` and the
output of a solve serve too), or the YAML of ROS's `camera_info`. A target: our TOML or JSON in the same way.
"""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

import msgspec

from handeye.datasets.reading import MIB, located, read_text
from handeye.datasets.toml_text import toml_values
from handeye.datasets.yaml_reading import read_yaml
from handeye.errors import InputError
from handeye.types import Camera, Target
from handeye.types.plain import read_document

MAX_BYTES = 2 * MIB
_YAML = (".yaml", ".yml")
# Names that ROS gives to lens models; its plumb_bob always has five coefficients.
_ROS_FISHEYE = ("equidistant", "fisheye")
_ROS_MODELS = ("plumb_bob", "rational_polynomial", *_ROS_FISHEYE)


class _Matrix(msgspec.Struct):
    data: list[float]


class _CameraInfo(msgspec.Struct):
    """What is needed of a camera_info file; it has more."""

    image_width: int
    image_height: int
    camera_matrix: _Matrix
    distortion_coefficients: _Matrix
    distortion_model: str = "plumb_bob"


def read_camera(path: str | os.PathLike[str]) -> Camera:
    """Read a camera from a file: .toml or .json of ours, .yaml of ROS.

    Raises
    ------
    InputError
        Not such a file; the message names file and field.
    """
    file = Path(path)
    if file.suffix.lower() in _YAML:
        info = read_document(read_yaml(file), _CameraInfo, str(file), lax=True)
        with located(str(file)):
            return _camera_of_ros(info)
    table = _table(file, "camera")
    with located(str(file)):
        return Camera.from_dict(table)


def read_target(path: str | os.PathLike[str]) -> Target:
    """Read a target from a .toml or .json file of ours.

    Raises
    ------
    InputError
        Not such a file; the message names file and field.
    """
    file = Path(path)
    table = _table(file, "target")
    with located(str(file)):
        return Target.from_dict(table)


def _camera_of_ros(info: _CameraInfo) -> Camera:
    matrix, coefficients = info.camera_matrix.data, info.distortion_coefficients.data
    if info.distortion_model not in _ROS_MODELS:
        raise InputError(
            f"distortion_model {info.distortion_model[:40]!r}, expected one of {', '.join(_ROS_MODELS)}",
            code="unknown_lens",
        )
    if len(matrix) != 9:
        raise InputError(f"camera_matrix: {len(matrix)} numbers, expected 9", code="wrong_shape")
    rows = [matrix[0:3], matrix[3:6], matrix[6:9]]
    size = (info.image_width, info.image_height)
    return Camera.from_opencv(rows, coefficients, size, fisheye=info.distortion_model in _ROS_FISHEYE)


def _table(file: Path, name: str) -> dict[str, Any]:
    """Return the table of a name in a file, or the whole file where it has no such table."""
    readers: dict[str, Callable[[str], Any]] = {".toml": toml_values, ".json": json.loads}
    reader = readers.get(file.suffix.lower())
    if reader is None:
        raise InputError(
            f"{file}: a {name} in a file of this kind, expected .toml or .json", code="unknown_format"
        )
    text = read_text(file, MAX_BYTES)
    try:
        document = reader(text)
    except (ValueError, RecursionError) as error:
        kind = file.suffix.lower().removeprefix(".").upper()
        raise InputError(f"{file}: not {kind}: {str(error)[:200]}", code=f"not_{kind.lower()}") from error
    if not isinstance(document, Mapping):
        raise InputError(f"{file}: expected a table with the fields of a {name}", code="invalid_field")
    table = cast("Mapping[str, Any]", document)
    inner = table.get(name, table)
    return dict(cast("Mapping[str, Any]", inner)) if isinstance(inner, Mapping) else {name: inner}
