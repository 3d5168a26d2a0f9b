"""A recording that was written counts once it was read back and compared."""

import os

from handeye.codes import Code
from handeye.datasets.recording_format import read_recording
from handeye.datasets.rig_format import read_rig
from handeye.errors import InputError, OutputError
from handeye.types import Recording, RigRecording


def check_written(recording: Recording, folder: str | os.PathLike[str]) -> None:
    """Read a recording that was just written back, and compare it.

    Parameters
    ----------
    recording
        What was written.
    folder
        Where it was written.

    Raises
    ------
    OutputError
        It cannot be read or is not the same, but for images that were not copied and their names.

    Examples
    --------
    >>> write_recording(recording, "copy")
    >>> check_written(recording, "copy")
    """
    try:
        back = read_recording(folder).recording
    except InputError as error:
        raise OutputError(f"{folder}: does not read back: {error.message}", code=Code.NOT_EXACT) from error
    if _comparable(back) != _comparable(recording):
        raise OutputError(f"{folder}: does not read back as it was written", code=Code.NOT_EXACT)


def _comparable(recording: Recording) -> tuple[object, ...]:
    views = [{**view.to_dict(), "image": None} for view in recording.views]
    r = recording
    return r.name, r.mounting, r.camera, r.target, r.truth, r.source, views


def check_written_rig(recording: RigRecording, folder: str | os.PathLike[str]) -> None:
    """Read a recording of several cameras back, and compare it; of one camera and one target as that.

    Parameters
    ----------
    recording
        What was written.
    folder
        Where it was written.

    Raises
    ------
    OutputError
        As for `check_written`.

    Examples
    --------
    >>> write_rig(rig, "copy")
    >>> check_written_rig(rig, "copy")
    """
    if recording.single is not None:
        check_written(recording.single, folder)
        return
    try:
        back = read_rig(folder).recording
    except InputError as error:
        raise OutputError(f"{folder}: does not read back: {error.message}", code=Code.NOT_EXACT) from error
    if _comparable_rig(back) != _comparable_rig(recording):
        raise OutputError(f"{folder}: does not read back as it was written", code=Code.NOT_EXACT)


def _comparable_rig(recording: RigRecording) -> tuple[object, ...]:
    views = [
        (one.camera, one.target, {**one.view.to_dict(), "image": None})
        for station in recording.stations
        for one in station.views
    ]
    r = recording
    return r.name, dict(r.cameras), dict(r.targets), r.truth, r.source, views
