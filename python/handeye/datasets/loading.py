"""One door for all data: our recordings and the layouts of others."""

import os
from pathlib import Path

from handeye.codes import Code
from handeye.datasets import (
    certifiable,
    easy_handeye2,
    industrial_calibration,
    moveit_samples,
    pose_list,
    pose_streams,
    recording_format,
    robot_cal_tools,
    rwhe_calib,
    visp,
)
from handeye.datasets.bags import importer as bags
from handeye.datasets.image_set import ImportOptions
from handeye.datasets.importer import Imported, Importer
from handeye.datasets.joint_states import Forward
from handeye.datasets.pose_rows import NOTHING_STATED, Statement
from handeye.datasets.reading import existing_folder, file_names, is_file
from handeye.datasets.recording_format import LoadedRecording
from handeye.datasets.recording_header import FILE_NAME
from handeye.errors import InputError
from handeye.types import Mounting, Target

IMPORTERS: dict[str, Importer] = {
    importer.name: importer
    for importer in (
        rwhe_calib.IMPORTER,
        robot_cal_tools.IMPORTER,
        industrial_calibration.IMPORTER,
        easy_handeye2.IMPORTER,
        moveit_samples.IMPORTER,
        visp.IMPORTER,
        pose_streams.ETHZ,
        pose_streams.KINHEC,
        pose_streams.TUM,
        certifiable.IMPORTER,
        bags.IMPORTER,
        pose_list.IMPORTER,
    )
}
# Loading these runs or rebuilds whatever their author put in.
_NEVER_LOADED = frozenset({".mat", ".pkl", ".pickle", ".npy", ".npz"})
_MAX_LISTED = 10


def load(
    path: str | os.PathLike[str],
    *,
    layout: str | None = None,
    target: Target | None = None,
    pattern: tuple[int, int] | None = None,
    mounting: Mounting | None = None,
    poses: str | None = None,
    stated: Statement | None = None,
    arm: Forward | None = None,
) -> LoadedRecording | Imported:
    """Read a folder: a recording of ours, or images and poses in a layout of others.

    Parameters
    ----------
    path
        The folder, or the file in it that tells the layout (such as `recording.toml`).
    layout
        Name of one of `IMPORTERS`; None to recognise it.
    target, pattern, mounting, poses, stated, arm
        What the files of others leave open, see `ImportOptions`; a recording leaves nothing open.

    Returns
    -------
    LoadedRecording, ImageSet, UnreadPoses, PosePairs, PoseStreams or Contents
        An `ImageSet` has no points yet: they are still to be detected; of `UnreadPoses` not even the robot's
        poses are known; `PosePairs` and `PoseStreams` never had pictures; of the `Contents` of a bag it is
        still to be chosen what counts.

    Raises
    ------
    InputError
        Nothing that can be read, or not what it claims to be.

    Examples
    --------
    >>> load(folder).recording.mounting.value
    'eye_in_hand'
    """
    options = ImportOptions(target, pattern, mounting, poses, stated or NOTHING_STATED, arm)
    folder = _place(path)
    if layout is not None:
        importer = IMPORTERS.get(layout)
        if importer is None:
            raise InputError(
                f"layout {layout!r}, expected one of {', '.join(IMPORTERS)}", code=Code.UNKNOWN_FORMAT
            )
        return importer.read(folder, options)
    if is_file(folder / FILE_NAME):
        if options != ImportOptions(arm=arm):
            raise InputError(
                f"{folder}: a recording says its target, mounting and poses itself",
                code=Code.OPTIONS_UNUSED,
                hint=f"leave the options out, or change {FILE_NAME}",
            )
        return recording_format.read_recording(folder)
    if poses is not None or options.stated != NOTHING_STATED:
        return pose_list.IMPORTER.read(folder, options)
    fitting = recognise(folder)
    if not fitting:
        raise _not_recognised(folder)
    if len(fitting) > 1:
        names = " and ".join(importer.name for importer in fitting)
        raise InputError(f"{folder}: looks like {names}", code=Code.AMBIGUOUS_FORMAT, hint="name the layout")
    return fitting[0].read(folder, options)


def recognise(folder: Path) -> list[Importer]:
    """Return the importers that recognise a folder or a file; a general one only where no other does."""
    fitting = [importer for importer in IMPORTERS.values() if importer.recognises(folder)]
    return [importer for importer in fitting if not importer.is_general] or fitting


def _place(path: str | os.PathLike[str]) -> Path:
    """Return the folder, or the file that is read alone, that is meant by a path."""
    try:
        given = Path(path)
        if given.suffix.lower() in _NEVER_LOADED:
            raise InputError(
                f"{given}: files of this kind are never loaded, as they can run code of their author",
                code=Code.UNKNOWN_FORMAT,
                hint="give the folder with the text files",
            )
        known = {FILE_NAME, rwhe_calib.POSES_FILE, *robot_cal_tools.LIST_FILES}
        if is_file(given):
            return given.parent if given.name in known else given
        return existing_folder(given)
    except (TypeError, ValueError) as error:
        raise InputError(f"{path!r}: not a path ({error})", code=Code.UNREADABLE) from error


def _holds_parquet(folder: Path) -> bool:
    """Tell whether a folder has tables of Parquet, in it or as LeRobot lays them out."""
    try:
        named = any(name.lower().endswith(".parquet") for name in file_names(folder))
    except InputError:
        return False
    return named or (is_file(folder / "meta" / "info.json") and (folder / "data").is_dir())


def _not_recognised(folder: Path) -> InputError:
    kinds = "; ".join([f"a folder with {FILE_NAME}", *(i.looks_like for i in IMPORTERS.values())])
    below: list[str] = []
    try:
        with os.scandir(folder) as entries:
            for entry, _ in zip(entries, range(1000), strict=False):
                inner = folder / entry.name
                if entry.is_dir() and (recognise(inner) or is_file(inner / FILE_NAME)):
                    below.append(entry.name)
    except OSError:
        below = []
    hint = (
        f"below it there are {', '.join(sorted(below)[:_MAX_LISTED])}: give one of these" if below else None
    )
    if hint is None and _holds_parquet(folder):
        hint = (
            "Parquet is not read: write its poses as CSV (pandas: to_csv) and its pictures as files beside it"
        )
    return InputError(
        f"{folder}: nothing that can be read, expected {kinds}", code=Code.UNKNOWN_FORMAT, hint=hint
    )
