"""Writing our recording of several cameras or targets, see `handeye.datasets.rig_format`."""

import os
from pathlib import Path
from typing import Any

from handeye.datasets.corners import corners_text
from handeye.datasets.reading import read_text
from handeye.datasets.recording_header import FILE_NAME, FORMAT, MAX_BYTES, RIG_VERSION
from handeye.datasets.recording_writing import keep_image, write_recording
from handeye.datasets.toml_text import toml_text
from handeye.datasets.writing import new_folder, replace_file, write_file
from handeye.errors import InputError, OutputError
from handeye.types import CameraView, RigRecording, Station
from handeye.types.plain import without_none


def write_rig(
    recording: RigRecording,
    folder: str | os.PathLike[str],
    *,
    images_from: str | os.PathLike[str] | None = None,
) -> None:
    """Write a recording into a new folder: version 1 where there is one camera and one target.

    Parameters
    ----------
    recording
        Several cameras or targets.
    folder
        A new folder.
    images_from
        Folder from which the images of the views are copied; None to leave them where they are.

    Raises
    ------
    OutputError
        The folder is not empty, an image is missing, or the system refuses to write.

    Examples
    --------
    >>> write_rig(rig, "rig")
    >>> Path("rig/recording.toml").exists()
    True
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


def header_of(recording: RigRecording) -> dict[str, Any]:
    """Return plain values of a recording without stations and truth.

    `handeye.datasets.rig_format.recording_of` reads them back.
    """
    return _document(recording.with_stations(()), [], with_truth=False)


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
