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

from handeye.datasets.corners import corners_text, read_corners
from handeye.datasets.image_header import image_size
from handeye.datasets.plausibility import DataWarning, recording_warnings
from handeye.datasets.reading import existing_folder, inside, located, read_text
from handeye.datasets.recording_format import Rows
from handeye.datasets.recording_header import FILE_NAME, FORMAT, MAX_BYTES, RIG_VERSION, read_versioned
from handeye.datasets.recording_writing import keep_image, write_recording
from handeye.datasets.toml_text import toml_text
from handeye.datasets.writing import new_folder, replace_file, write_file
from handeye.errors import InputError, OutputError
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
from handeye.types.plain import Document, read_document, without_none


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
    """A recording of several cameras or targets, its folder, and what looks wrong with it."""

    recording: RigRecording
    folder: Path
    warnings: tuple[DataWarning, ...] = ()


def read_rig(folder: str | os.PathLike[str]) -> LoadedRig:
    """Read a recording of version 2.

    Raises
    ------
    InputError
        As for `read_recording`; the message names file, station, view and field.
    """
    root = existing_folder(folder)
    file = root / FILE_NAME
    document = read_document(read_versioned(file), _RigDocument, str(file))
    with located(str(file)):
        if document.station_count not in {None, len(document.station)}:
            raise InputError(
                f"{len(document.station)} stations, but station_count is {document.station_count}",
                code="truncated",
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
    """Return what is possible but hardly meant in the views of any pair, each said once."""
    found = [
        warning
        for camera, target in recording.pairs
        for warning in recording_warnings(recording.pair(camera, target))
    ]
    return tuple({str(warning): warning for warning in found}.values())


def write_rig(
    recording: RigRecording,
    folder: str | os.PathLike[str],
    *,
    images_from: str | os.PathLike[str] | None = None,
) -> None:
    """Write a recording into a new folder: version 1 where there is one camera and one target.

    Raises
    ------
    OutputError
        The folder is not empty, an image is missing, or the system refuses to write.
    """
    single = recording.single
    if single is not None:
        write_recording(single, folder, images_from=images_from)
        return
    source = None if images_from is None else Path(images_from)
    with new_folder(Path(folder)) as partial:
        (partial / "corners").mkdir()
        views = [
            _write_view(station, one, partial, source)
            for station in recording.stations
            for one in station.views
        ]
        write_file(partial / FILE_NAME, _text(recording, views))


def update_rig(recording: RigRecording, folder: Path) -> None:
    """Write a recording over the one in a folder; a reader finds the new one or the old.

    It is version 2 also with one camera and one target. Images stay as they are, and views keep only those
    that lie there.

    Raises
    ------
    OutputError
        The system refuses to write.
    """
    try:
        (folder / "corners").mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written ({error})") from error
    tables: list[dict[str, Any]] = []
    for station in recording.stations:
        for one in station.views:
            path = folder / _corners(station, one)
            text = corners_text(one.view)
            # One of the same name holds the same view, or what a write left that was broken off.
            if not _holds(path, text):
                replace_file(path, text.encode())
            tables.append(_table(station, one, keep_image(one.view, folder, None, "")))
    replace_file(folder / FILE_NAME, _text(recording, tables))


def _holds(path: Path, text: str) -> bool:
    try:
        return read_text(path, MAX_BYTES) == text
    except InputError:
        return False


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


def header_of(recording: RigRecording) -> dict[str, Any]:
    """Return plain values of a recording without stations and truth; `recording_of` reads them back."""
    return _document(recording.with_stations(()), [], with_truth=False)


def recording_of(header: object) -> RigRecording:
    """Read what `header_of` wrote.

    Raises
    ------
    InputError
        A missing, unknown or unusable field.
    """
    return _header(read_document(header, _RigDocument, "recording"))


def _corners(station: Station, one: CameraView) -> str:
    return f"corners/{station.name}.{one.camera}.{one.target}.csv"


def _table(station: Station, one: CameraView, image: str | None) -> dict[str, Any]:
    return without_none(
        station=station.name,
        camera=one.camera,
        target=one.target,
        image=image,
        corners=_corners(station, one),
    )


def _write_view(station: Station, one: CameraView, folder: Path, images_from: Path | None) -> dict[str, Any]:
    write_file(folder / _corners(station, one), corners_text(one.view).encode())
    stem = f"{station.name}.{one.camera}.{one.target}"
    return _table(station, one, keep_image(one.view, folder, images_from, stem))


def _named(tables: list[dict[str, Any]], what: str) -> list[tuple[str, Body, dict[str, Any]]]:
    found: list[tuple[str, Body, dict[str, Any]]] = []
    for number, table in enumerate(tables, 1):
        rest = dict(table)
        name, on = rest.pop("name", None), rest.pop("on", None)
        if not isinstance(name, str) or name in {other for other, _, _ in found}:
            raise InputError(f"{what} {number}: expected a name of its own", code="invalid_field")
        if on not in set(Body):
            raise InputError(
                f"{what} {name[:60]!r}: on {str(on)[:60]!r}, expected flange or base", code="invalid_field"
            )
        found.append((name, Body(on), rest))
    return found


def _header(document: _RigDocument) -> RigRecording:
    """Return the recording without its stations."""
    cameras = {
        name: MountedCamera(Camera.from_dict(rest), body)
        for name, body, rest in _named(document.camera, "camera")
    }
    targets = {
        name: MountedTarget(Target.from_dict(rest), body)
        for name, body, rest in _named(document.target, "target")
    }
    return RigRecording(document.name, cameras, targets, (), None, document.source)


def _stations(
    document: _RigDocument, cameras: Mapping[str, MountedCamera], root: Path
) -> tuple[Station, ...]:
    views: dict[str, list[_ViewDocument]] = {station.name: [] for station in document.station}
    for one in document.view:
        if one.station not in views:
            raise InputError(f"view of {one.station[:60]!r}: no such station or camera", code="invalid_field")
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
            raise InputError(f"{where}: no such station or camera", code="invalid_field")
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
                    code="image_size",
                    hint="the camera must be calibrated at the size of the images",
                )
        views.append(CameraView(one.camera, one.target, view))
    if not views:
        raise InputError(
            f"station {station.name[:60]}: no camera saw a target",
            code="no_points",
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
                        f"truth: no {what} {table.name[:60]!r} on the {body.value}", code="invalid_field"
                    )
                with located(f"truth of {table.name}"):
                    poses[table.name] = Pose(rows)
    return RigTruth(of_cameras, of_targets)


def _text(recording: RigRecording, views: list[dict[str, Any]]) -> bytes:
    return toml_text(_document(recording, views, with_truth=True)).encode()


def _document(recording: RigRecording, views: list[dict[str, Any]], *, with_truth: bool) -> dict[str, Any]:
    truth: list[dict[str, Any]] = []
    if recording.truth is not None and with_truth:
        truth += [
            {"name": name, recording.cameras[name].mounting.x_name: pose.to_list()}
            for name, pose in recording.truth.cameras.items()
        ]
        truth += [
            {"name": name, recording.targets[name].pose_name: pose.to_list()}
            for name, pose in recording.truth.targets.items()
        ]
    return without_none(
        format=FORMAT,
        version=RIG_VERSION,
        name=recording.name,
        source=recording.source,
        station_count=len(recording),
        camera=[
            {"name": name, "on": one.body.value, **one.camera.to_dict()}
            for name, one in recording.cameras.items()
        ],
        target=[
            {"name": name, "on": one.body.value, **one.target.to_dict()}
            for name, one in recording.targets.items()
        ],
        truth=truth or None,
        station=[
            without_none(
                name=station.name,
                timestamp_s=station.views[0].view.timestamp_s,
                joints_rad=None if station.joints_rad is None else list(station.joints_rad),
                T_base_flange=station.T_base_flange.to_list(),
            )
            for station in recording.stations
        ],
        view=views,
    )
