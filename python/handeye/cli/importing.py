"""`handeye import`: from the layouts of others to a recording of ours."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_new_folder
from handeye.cli.source import Source
from handeye.datasets import check_written, check_written_rig, write_recording, write_rig
from handeye.importing import Opened, OpenedRig, is_rig

if TYPE_CHECKING:
    from rich.console import Console


def import_folder(
    folder: Path,
    destination: Path,
    /,
    *,
    images: bool = False,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Turn a folder of images and robot poses into a recording.

    Pictures with a file of poses, bags of ROS and the layouts of other tools are recognised (docs: import).
    The target is found in the images and, if the files hold no camera, the camera is calibrated from them.
    The recording keeps corners, poses, camera and target, so solving it again needs no image. A recording is
    copied, with another camera if given.

    Parameters
    ----------
    folder
        Folder with the images and poses, or a bag.
    destination
        Folder of the recording, which does not exist yet or is empty.
    images
        Copy the images too.
    """
    check_new_folder(destination)
    if source.only is None and is_rig(folder):
        return _import_rig(source.open_rig(folder), destination, images=images)
    opened = source.open(folder, arm.described())
    if images and all(view.image is None for view in opened.recording.views):
        raise UsageError(
            f"--images: the pictures of {folder} are in no files of their own",
            hint="leave it out: the recording has their points, and solves without them",
        )
    write_recording(opened.recording, destination, images_from=opened.folder if images else None)
    check_written(opened.recording, destination)
    data = _data(opened, destination)
    return Answer(data, lambda console: _show(console, opened, destination))


def _import_rig(opened: OpenedRig, destination: Path, *, images: bool) -> Answer:
    recording = opened.recording
    write_rig(recording, destination, images_from=opened.folder if images else None)
    check_written_rig(recording, destination)
    missed = {f"{name}, {view}": why for name, found in opened.missed.items() for view, why in found.items()}
    data = {
        "recording": recording.name,
        "layout": opened.layout,
        "destination": str(destination),
        "cameras": {
            name: {
                "on": one.body.value,
                "camera_origin": opened.camera_origins[name].value,
                "camera": one.camera.to_dict(),
            }
            for name, one in recording.cameras.items()
        },
        "targets": {
            name: {"on": one.body.value, "target": one.target.to_dict()}
            for name, one in recording.targets.items()
        },
        "stations": [station.name for station in recording.stations],
        "missed": missed,
        "warnings": [str(warning) for warning in opened.warnings],
    }
    return Answer(data, lambda console: _show_rig(console, opened, missed, destination))


def _show_rig(console: "Console", opened: OpenedRig, missed: dict[str, str], destination: Path) -> None:
    from handeye.cli.wording import heading, notices, pairs  # noqa: PLC0415

    recording = opened.recording
    heading(console, recording.name, f"{len(recording)} stations")
    rows = [("layout", opened.layout)]
    rows += [
        (f"camera {name}", f"on the {one.body.value}, {opened.camera_origins[name].value}")
        for name, one in recording.cameras.items()
    ]
    rows += [
        (f"target {name}", f"on the {one.body.value}, {one.target.family}")
        for name, one in recording.targets.items()
    ]
    pairs(console, [*rows, ("written", str(destination))])
    notices(console, "Left out", (f"{name}: {why}" for name, why in missed.items()))
    notices(console, "Warnings", map(str, opened.warnings))


def _data(opened: Opened, destination: Path) -> dict[str, Any]:
    return {
        "recording": opened.recording.name,
        "layout": opened.layout,
        "destination": str(destination),
        "mounting": opened.recording.mounting.value,
        "camera_origin": opened.camera_origin.value,
        **({} if opened.timing is None else {"timing": opened.timing.to_dict()}),
        "camera": opened.recording.camera.to_dict(),
        "target": opened.recording.target.to_dict(),
        "views": {
            "imported": [view.name for view in opened.recording.views],
            "rejected": [{"name": name, "reason": why} for name, why in opened.missed.items()],
        },
        "warnings": [str(warning) for warning in opened.warnings],
    }


def _show(console: "Console", opened: Opened, destination: Path) -> None:
    from handeye.cli.wording import MOUNTINGS, camera_line, heading, notices, pairs  # noqa: PLC0415

    recording = opened.recording
    note = f"{MOUNTINGS[recording.mounting]}, {len(recording)} views, {len(opened.missed)} without the target"
    heading(console, recording.name, note)
    rows = [
        ("layout", opened.layout),
        ("target", f"{recording.target.family}, {recording.target.point_count} points"),
        ("camera", camera_line(opened)),
        *([] if opened.timing is None else [("timing", str(opened.timing))]),
        ("written", str(destination)),
    ]
    pairs(console, rows)
    notices(console, "Left out", (f"{name}: {why}" for name, why in opened.missed.items()))
    notices(console, "Warnings", map(str, opened.warnings))
