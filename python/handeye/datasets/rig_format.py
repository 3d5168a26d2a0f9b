"""Our recording on disk where there are several cameras or targets: version 2 of `recording_format`.

::

    recording.toml      format, version = 2, name, source, station_count,
                        [[camera]] name, on, lens ...       on: "flange" or "base"
                        [[target]] name, on, family ...
                        [[truth]] name, T_camera_flange or T_camera_base, or T_base_target or T_flange_target
                        [[station]] name, T_base_flange, timestamp_s, joints_rad
                        [[view]] station, camera, target, corners, image
    corners/STATION.CAMERA.TARGET.csv

Units and frames are those of version 1, which is what is written where there is one camera and one target.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from handeye.codes import Code
from handeye.datasets.corners import read_corners
from handeye.datasets.image_header import image_size
from handeye.datasets.plausibility import DataWarning, recording_warnings
from handeye.datasets.reading import existing_folder, inside, located
from handeye.datasets.recording_format import Rows
from handeye.datasets.recording_header import FILE_NAME, read_versioned
from handeye.errors import InputError
from handeye.types import (
    Body,
    Camera,
    CameraView,
    MountedCamera,
    MountedTarget,
    Pose,
    RigRecording,
    RigTruth,
    Station,
    Target,
    View,
)
from handeye.types.plain import Document, read_document


class _TruthDocument(Document):
    name: str
    T_camera_flange: Rows | None = None
    T_camera_base: Rows | None = None
    T_flange_target: Rows | None = None
    T_base_target: Rows | None = None


class _StationDocument(Document):
    name: str
    T_base_flange: Rows
    timestamp_s: float | None = None
    joints_rad: list[float] | None = None


class _ViewDocument(Document):
    station: str
    camera: str
    target: str
    corners: str
    image: str | None = None


class _RigDocument(Document):
    format: str
    version: int
    name: str
    camera: list[dict[str, Any]]
    target: list[dict[str, Any]]
    source: str = ""
    truth: list[_TruthDocument] = []  # noqa: RUF012 - msgspec copies an empty default
    station_count: int | None = None
    station: list[_StationDocument] = []  # noqa: RUF012
    view: list[_ViewDocument] = []  # noqa: RUF012


@dataclass(frozen=True)
class LoadedRig:
    """A recording of several cameras or targets, its folder, and what looks wrong with it.

    Examples
    --------
    >>> write_rig(rig, "rig")
    >>> sorted(read_rig("rig").recording.cameras)
    ['front', 'left', 'right', 'side']
    """

    recording: RigRecording
    folder: Path
    warnings: tuple[DataWarning, ...] = ()


def read_rig(folder: str | os.PathLike[str]) -> LoadedRig:
    """Read a recording of version 2.

    Raises
    ------
    InputError
        As for `read_recording`; the message names file, station, view and field.

    Examples
    --------
    >>> write_rig(rig, "rig")
    >>> len(read_rig("rig").recording) == len(rig)
    True
    """
    root = existing_folder(folder)
    file = root / FILE_NAME
    document = read_document(read_versioned(file), _RigDocument, str(file))
    with located(str(file)):
        if document.station_count not in {None, len(document.station)}:
            raise InputError(
                f"{len(document.station)} stations, but station_count is {document.station_count}",
                code=Code.TRUNCATED,
                hint="the file may have been cut off; if it was edited on purpose, correct station_count",
            )
        empty = _header(document)
        recording = replace(
            empty,
            stations=_stations(document, empty.cameras, root),
            truth=_truth(document.truth, empty.cameras, empty.targets),
        )
    return LoadedRig(recording, root, rig_warnings(recording))


def rig_warnings(recording: RigRecording) -> tuple[DataWarning, ...]:
    """Return what is possible but hardly meant in the views of any pair, each said once.

    Examples
    --------
    >>> rig_warnings(rig)
    ()
    """
    found = [
        warning
        for camera, target in recording.pairs
        for warning in recording_warnings(recording.pair(camera, target))
    ]
    return tuple({str(warning): warning for warning in found}.values())


@dataclass(frozen=True)
class StationsApart:
    """A recording without its stations, and each station by its name, or what is wrong with it."""

    recording: RigRecording
    stations: dict[str, Station | InputError]


def read_stations_apart(folder: Path) -> StationsApart:
    """Read a recording of which single stations may be damaged; its truth is left out.

    Raises
    ------
    InputError
        The recording cannot be read at all.
    """
    file = folder / FILE_NAME
    document = read_document(read_versioned(file), _RigDocument, str(file))
    found: dict[str, Station | InputError] = {}
    with located(str(file)):
        recording = _header(document)
        for station in document.station:
            seen = [one for one in document.view if one.station == station.name]
            try:
                found[station.name] = _station(station, seen, recording.cameras, folder)
            except InputError as error:
                found[station.name] = error
    return StationsApart(recording, found)


def recording_of(header: object) -> RigRecording:
    """Read what `handeye.datasets.rig_writing.header_of` wrote.

    Raises
    ------
    InputError
        A missing, unknown or unusable field.
    """
    return _header(read_document(header, _RigDocument, "recording"))


def named_tables(tables: list[dict[str, Any]], what: str) -> list[tuple[str, Body, dict[str, Any]]]:
    """Return name, body and the other fields of tables of cameras or targets.

    Raises
    ------
    InputError
        A name that is missing or there twice, or something that hangs on neither flange nor base.
    """
    found: list[tuple[str, Body, dict[str, Any]]] = []
    for number, table in enumerate(tables, 1):
        rest = dict(table)
        name, on = rest.pop("name", None), rest.pop("on", None)
        if not isinstance(name, str) or name in {other for other, _, _ in found}:
            raise InputError(f"{what} {number}: expected a name of its own", code=Code.INVALID_FIELD)
        if on not in set(Body):
            raise InputError(
                f"{what} {name[:60]!r}: on {str(on)[:60]!r}, expected flange or base", code=Code.INVALID_FIELD
            )
        found.append((name, Body(on), rest))
    return found


def _header(document: _RigDocument) -> RigRecording:
    """Return the recording without its stations."""
    cameras = {
        name: MountedCamera(Camera.from_dict(rest), body)
        for name, body, rest in named_tables(document.camera, "camera")
    }
    targets = {
        name: MountedTarget(Target.from_dict(rest), body)
        for name, body, rest in named_tables(document.target, "target")
    }
    return RigRecording(document.name, cameras, targets, (), None, document.source)


def _stations(
    document: _RigDocument, cameras: Mapping[str, MountedCamera], root: Path
) -> tuple[Station, ...]:
    views: dict[str, list[_ViewDocument]] = {station.name: [] for station in document.station}
    for one in document.view:
        if one.station not in views:
            raise InputError(
                f"view of {one.station[:60]!r}: no such station or camera", code=Code.INVALID_FIELD
            )
        views[one.station].append(one)
    return tuple(_station(station, views[station.name], cameras, root) for station in document.station)


def _station(
    station: _StationDocument, seen: list[_ViewDocument], cameras: Mapping[str, MountedCamera], root: Path
) -> Station:
    with located(f"station {station.name[:60]}: T_base_flange"):
        pose = Pose(station.T_base_flange)
    views: list[CameraView] = []
    for one in seen:
        where = f"station {station.name[:60]}, camera {one.camera[:60]}"
        if one.camera not in cameras:
            raise InputError(f"{where}: no such station or camera", code=Code.INVALID_FIELD)
        ids, pixels, sigmas = read_corners(inside(root, one.corners, f"{where}: corners"))
        view = View(
            station.name,
            pose,
            ids,
            pixels,
            one.image,
            station.timestamp_s,
            station.joints_rad,
            sigmas,
        )
        if view.image is not None:
            size = image_size(inside(root, view.image, f"{where}: image"))
            expected = cameras[one.camera].camera.size_px
            if size is not None and size != expected:
                raise InputError(
                    f"{where}: image {view.image} has {size[0]} x {size[1]} pixels, the camera "
                    f"{expected[0]} x {expected[1]}",
                    code=Code.IMAGE_SIZE,
                    hint="the camera must be calibrated at the size of the images",
                )
        views.append(CameraView(one.camera, one.target, view))
    if not views:
        raise InputError(
            f"station {station.name[:60]}: no camera saw a target",
            code=Code.NO_POINTS,
            hint="leave the station out",
        )
    return Station(tuple(views))


def _truth(
    tables: list[_TruthDocument],
    cameras: Mapping[str, MountedCamera],
    targets: Mapping[str, MountedTarget],
) -> RigTruth | None:
    if not tables:
        return None
    of_cameras: dict[str, Pose] = {}
    of_targets: dict[str, Pose] = {}
    for table in tables:
        for body in Body:
            for what, known, poses in (("camera", cameras, of_cameras), ("target", targets, of_targets)):
                pose_name = f"T_camera_{body.value}" if what == "camera" else f"T_{body.value}_target"
                rows = getattr(table, pose_name)
                if rows is None:
                    continue
                if table.name not in known or known[table.name].body is not body:
                    raise InputError(
                        f"truth: no {what} {table.name[:60]!r} on the {body.value}", code=Code.INVALID_FIELD
                    )
                with located(f"truth of {table.name}"):
                    poses[table.name] = Pose(rows)
    return RigTruth(of_cameras, of_targets)
