"""From a folder with several cameras to a recording of stations.

Read are recordings of version 2, and folders with a folder for each camera, each of which could be opened on
its own::

    camera1/image/0001.png, ...   pictures, in the folder of the camera or one folder below
    camera1/pose/0001.csv, ...    the robot's poses: one file each, or any file of poses
    camera1/intrinsics.yaml       perhaps: the camera
    camera2/...

Pictures of one name, taken at one pose, are a station.
"""

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from handeye.codes import Code
from handeye.datasets import DataWarning, holds_several, read_rig, recording_warnings, rig_warnings
from handeye.datasets.image_header import IMAGE_SUFFIXES
from handeye.datasets.reading import file_names, folder_names, is_file
from handeye.datasets.recording_header import FILE_NAME
from handeye.errors import HandeyeError, InputError, UnstatedError
from handeye.importing.opening import CameraOrigin, Opened, SourceOptions, open_folder
from handeye.types import (
    Body,
    Camera,
    CameraView,
    MountedCamera,
    MountedTarget,
    Mounting,
    RigRecording,
    View,
)
from handeye.types.rig import TARGET

_CAMERA_FOLDER = re.compile(r"cam(era)?[_-]?[a-z0-9_-]{0,30}", re.ASCII | re.IGNORECASE)
_POSES_FOLDER = re.compile(r"(robot_?)?poses?", re.ASCII | re.IGNORECASE)
LAYOUT = "camera_folders"
# Poses of one name that differ by more are of two stops of the arm.
SAME_STOP_M, SAME_STOP_RAD = 1e-6, 1e-6


@dataclass(frozen=True, eq=False)
class OpenedRig:
    """A recording of several cameras and how it came about; the fields are those of `Opened`, by camera."""

    recording: RigRecording
    folder: Path
    layout: str
    camera_origins: Mapping[str, CameraOrigin] = field(default_factory=dict[str, CameraOrigin])
    missed: Mapping[str, Mapping[str, str]] = field(default_factory=dict[str, Mapping[str, str]])
    warnings: tuple[DataWarning, ...] = ()


def is_rig(path: str | os.PathLike[str]) -> bool:
    """Tell whether a folder holds several cameras; anything else is for `open_folder`."""
    try:
        folder = Path(path)
        if is_file(folder) and folder.name == FILE_NAME:
            folder = folder.parent
        if is_file(folder / FILE_NAME):
            return holds_several(folder)
        return folder.is_dir() and len(_camera_folders(folder)) > 1
    except (HandeyeError, OSError, TypeError, ValueError):
        return False  # opening it says what is wrong with it


def open_rig(
    path: str | os.PathLike[str],
    options: SourceOptions | None = None,
    *,
    cameras: Mapping[str, Camera] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> OpenedRig:
    """Read a folder with several cameras.

    Parameters
    ----------
    path
        The folder.
    options
        What its files leave open; mounting and target are those of all cameras.
    cameras
        Calibrations in the order of the cameras' names, such as a chain of Kalibr; in the place of what the
        files say.
    progress
        Called with the number of images done and of all images of the camera that is looked at.

    Raises
    ------
    InputError, DegenerateError, DetectionError
        As for `open_folder`; the message names the camera.

    Examples
    --------
    >>> from handeye.datasets import write_rig
    >>> write_rig(rig, "my_rig")
    >>> sorted(open_rig("my_rig").recording.cameras)
    ['front', 'left', 'right', 'side']
    """
    folder = Path(path)
    folder = folder.parent if is_file(folder) else folder
    options = options or SourceOptions()
    if options.camera is not None:
        raise InputError(
            f"{folder}: one camera given for several",
            code=Code.SEVERAL_CAMERAS,
            hint="give a chain of Kalibr with as many cameras, or put a file into the folder of each camera",
        )
    if is_file(folder / FILE_NAME):
        loaded = read_rig(folder)
        recording = _with_cameras(loaded.recording, cameras)
        origin = CameraOrigin.FILES if cameras is None else CameraOrigin.GIVEN
        return OpenedRig(
            recording,
            loaded.folder,
            "handeye",
            dict.fromkeys(recording.cameras, origin),
            warnings=rig_warnings(recording),
        )
    return _of_folders(folder, options, cameras, progress)


def one_camera(opened: OpenedRig, name: str) -> Opened:
    """Return what one camera saw of the target that it saw most, of those that the arm moves against it.

    Raises
    ------
    InputError
        No such camera, or it saw no such target.
    """
    recording = opened.recording
    seen = [
        recording.pair(camera, target)
        for camera, target in recording.pairs
        if camera == name and recording.moves(camera, target)
    ]
    if not seen:
        known = ", ".join(recording.cameras)
        raise InputError(
            f"{opened.folder}: camera {name[:60]!r} saw no target that the arm moves; there are {known}",
            code=Code.SEVERAL_CAMERAS,
        )
    found = replace(max(seen, key=len), name=f"{recording.name} {name}")
    return Opened(
        found,
        opened.folder,
        opened.layout,
        opened.camera_origins[name],
        opened.missed.get(name, {}),
        warnings=recording_warnings(found),
    )


def _with_cameras(recording: RigRecording, cameras: Mapping[str, Camera] | None) -> RigRecording:
    if cameras is None:
        return recording
    given = _by_name(list(recording.cameras), cameras)
    mounted = {name: replace(one, camera=given[name]) for name, one in recording.cameras.items()}
    return replace(recording, cameras=mounted)


def _by_name(names: list[str], cameras: Mapping[str, Camera]) -> dict[str, Camera]:
    if set(cameras) == set(names):
        return dict(cameras)
    if len(cameras) != len(names):
        raise InputError(
            f"{len(cameras)} cameras given ({', '.join(cameras)[:80]}) for {len(names)} "
            f"({', '.join(names)[:80]})",
            code=Code.SEVERAL_CAMERAS,
            hint="give as many as there are, in the order of their names",
        )
    return dict(zip(names, cameras.values(), strict=True))


def _camera_folders(folder: Path) -> list[str]:
    return [
        name
        for name in folder_names(folder)
        if _CAMERA_FOLDER.fullmatch(name) and _has_pictures(folder / name)
    ]


def _has_pictures(folder: Path) -> bool:
    places = [folder, *(folder / name for name in folder_names(folder)[:20])]
    return any(Path(name).suffix.lower() in IMAGE_SUFFIXES for place in places for name in file_names(place))


def _of_folders(
    folder: Path,
    options: SourceOptions,
    cameras: Mapping[str, Camera] | None,
    progress: Callable[[int, int], None] | None,
) -> OpenedRig:
    names = _camera_folders(folder)
    given = None if cameras is None else _by_name(names, cameras)
    mounted: dict[str, MountedCamera] = {}
    targets: dict[str, MountedTarget] = {}
    origins: dict[str, CameraOrigin] = {}
    missed: dict[str, Mapping[str, str]] = {}
    warnings: dict[str, DataWarning] = {}
    stations: dict[str, list[CameraView]] = {}
    for name in names:
        own = replace(
            options,
            camera=None if given is None else given[name],
            poses=options.poses or _poses_folder(folder / name),
        )
        try:
            opened = open_folder(folder / name, own, progress=progress)
        except UnstatedError:
            raise  # names its file and the options
        except HandeyeError as error:
            raise type(error)(f"camera {name}: {error.message}", code=error.code, hint=error.hint) from error
        in_hand = opened.recording.mounting is Mounting.EYE_IN_HAND
        mounted[name] = MountedCamera(opened.recording.camera, Body.FLANGE if in_hand else Body.BASE)
        target = MountedTarget(opened.recording.target, Body.BASE if in_hand else Body.FLANGE)
        if targets.setdefault(TARGET, target) != target:
            raise InputError(
                f"camera {name}: another target or mounting than that of {names[0]}", code=Code.INVALID_FIELD
            )
        origins[name], missed[name] = opened.camera_origin, opened.missed
        warnings |= {str(warning): warning for warning in opened.warnings}
        for view in opened.recording.views:
            kept = replace(view, image=None if view.image is None else f"{name}/{view.image}")
            _add(stations, name, kept)
    recording = RigRecording.of_views(
        folder.resolve().name,
        mounted,
        targets,
        [view for views in stations.values() for view in views],
        source=f"folders {', '.join(names)} in folder {folder.resolve().name}",
    )
    return OpenedRig(recording, folder, LAYOUT, origins, missed, tuple(warnings.values()))


def _poses_folder(folder: Path) -> str | None:
    fitting = [name for name in folder_names(folder) if _POSES_FOLDER.fullmatch(name)]
    return fitting[0] if len(fitting) == 1 else None


def _add(stations: dict[str, list[CameraView]], camera: str, view: View) -> None:
    """Add a view to the station of its name, or to one of its own if the arm stood elsewhere."""
    there = stations.get(view.name)
    if there:
        first = there[0].view
        apart = first.T_base_flange.inverse() @ view.T_base_flange
        if (
            abs(apart.translation).max() < SAME_STOP_M
            and apart.rotation_angle_rad < SAME_STOP_RAD
            and first.joints_rad == view.joints_rad
        ):
            same = replace(view, T_base_flange=first.T_base_flange, timestamp_s=first.timestamp_s)
            there.append(CameraView(camera, TARGET, same))
            return
        view = replace(view, name=f"{view.name}.{camera}"[:100])
    stations.setdefault(view.name, []).append(CameraView(camera, TARGET, view))
