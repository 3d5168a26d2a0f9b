"""The cameras and targets of a rig that is to be driven, in one TOML file.

::

    [[camera]]
    name = "left"
    on = "flange"                   or "base"
    images = "basler:40012345"      its driver, as for `handeye run --images`
    calibration = "left.yaml"       any file of a camera; or its fields, as in a recording

    [[target]]
    name = "table"
    on = "base"                     or "flange"
    board = "table.toml"            any file of a target; or its fields, as in a recording

Files are named from where this one lies.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, TypeVar

from handeye.codes import Code
from handeye.datasets.camera_files import read_camera
from handeye.datasets.parameter_files import read_target
from handeye.datasets.reading import located, read_text
from handeye.datasets.recording_header import MAX_BYTES
from handeye.datasets.rig_format import named_tables
from handeye.datasets.toml_reading import parse_toml
from handeye.errors import InputError
from handeye.types import Camera, MountedCamera, MountedTarget, RigRecording, Target
from handeye.types.plain import Document, read_document
from handeye.types.target.coded import Coded

T = TypeVar("T")


class _Description(Document):
    camera: list[dict[str, Any]]
    target: list[dict[str, Any]]


@dataclass(frozen=True, eq=False)
class RigDescription:
    """A rig as it is described.

    Parameters
    ----------
    recording
        Its cameras and targets, without a station.
    images
        The driver of each camera, by the name of the camera.

    Examples
    --------
    >>> described = RigDescription(rig.with_stations([]), {"left": "basler:40012345"})
    >>> described.images["left"]
    'basler:40012345'
    """

    recording: RigRecording
    images: Mapping[str, str]


def read_rig_description(path: str | os.PathLike[str]) -> RigDescription:
    """Read what there is of cameras and targets.

    Parameters
    ----------
    path
        A TOML file, see the head of this module.

    Raises
    ------
    InputError
        A missing or unusable field or file, or two targets that a picture does not tell apart.

    Examples
    --------
    >>> tables = {"camera": [], "target": []}
    >>> for name, one in rig.cameras.items():
    ...     table = {"name": name, "on": one.body.value, "images": "opencv:0"}
    ...     tables["camera"].append(table | one.camera.to_dict())
    >>> for name, one in rig.targets.items():
    ...     tables["target"].append({"name": name, "on": one.body.value} | one.target.to_dict())
    >>> from handeye.datasets.toml_text import toml_text
    >>> _ = Path("rig.toml").write_text(toml_text(tables))
    >>> sorted(read_rig_description("rig.toml").recording.cameras)
    ['front', 'left', 'right', 'side']
    """
    file = Path(path)
    document = read_document(parse_toml(read_text(file, MAX_BYTES), file), _Description, str(file))
    cameras: dict[str, MountedCamera] = {}
    targets: dict[str, MountedTarget] = {}
    images: dict[str, str] = {}
    with located(str(file)):
        for name, body, rest in named_tables(document.camera, "camera"):
            images[name] = _text(rest.pop("images", None), f"camera {name}: images", "the name of its driver")
            camera = _either(file, rest, f"camera {name}", "calibration", (read_camera, Camera.from_dict))
            cameras[name] = MountedCamera(camera, body)
        for name, body, rest in named_tables(document.target, "target"):
            target = _either(file, rest, f"target {name}", "board", (read_target, Target.from_dict))
            targets[name] = MountedTarget(target, body)
        for (a, one), (b, other) in combinations(targets.items(), 2):
            if look_alike(one.target, other.target):
                raise InputError(
                    f"targets {a} and {b}: a picture does not tell which of them it shows",
                    code=Code.INVALID_FIELD,
                    hint="use boards of other ids or of other numbers of squares: handeye target prints them",
                )
        recording = RigRecording(file.stem, cameras, targets, ())
    return RigDescription(recording, images)


def look_alike(one: Target, other: Target) -> bool:
    """Tell whether a picture of one target may be taken for one of the other.

    Examples
    --------
    >>> from handeye.types import Chessboard
    >>> look_alike(Chessboard(6, 9, 0.025), Chessboard(6, 9, 0.04))
    True
    """
    if isinstance(one, Coded) and isinstance(other, Coded):
        shared = set(one.marker_ids.tolist()) & set(other.marker_ids.tolist())
        return one.dictionary == other.dictionary and bool(shared)
    return _counts(one) == _counts(other)


def _counts(target: Target) -> dict[str, Any]:
    """Return what a picture shows of a target, which may be turned: all but its sizes."""
    shown = {name: value for name, value in target.to_dict().items() if not name.endswith("_m")}
    return shown | {"rows and columns": sorted((shown.pop("rows", 0), shown.pop("columns", 0)))}


def _text(value: object, what: str, expected: str) -> str:
    if not isinstance(value, str) or not value:
        raise InputError(f"{what}: found {str(value)[:60]!r}, expected {expected}", code=Code.INVALID_FIELD)
    return value


def _either(
    file: Path,
    rest: dict[str, Any],
    what: str,
    field: str,
    readers: tuple[Callable[[Path], T], Callable[[object], T]],
) -> T:
    """Return what a table says, in a file that its field names, or in the table itself."""
    of_file, of_fields = readers
    named = rest.pop(field, None)
    if named is None:
        with located(what):
            return of_fields(rest)
    name = _text(named, f"{what}: {field}", "the name of a file")
    if rest:
        raise InputError(
            f"{what}: {field} names a file, and {', '.join(map(str, rest))[:100]} beside it; expected one or "
            "the other",
            code=Code.INVALID_FIELD,
        )
    return of_file(file.parent / name)
