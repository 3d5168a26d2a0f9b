"""One entry for folders: recordings pass, images are searched for the target first."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from pathlib import Path

from handeye.codes import Code
from handeye.datasets import (
    DataWarning,
    ImageSet,
    LoadedRecording,
    PosePairs,
    Shot,
    Statement,
    UnreadPoses,
    load,
    recording_warnings,
)
from handeye.datasets.bags import Contents
from handeye.datasets.image_set import ImportOptions, WrittenPoses
from handeye.datasets.pose_list import stated_target
from handeye.datasets.pose_pairs import PoseStreams
from handeye.datasets.pose_rows import NOTHING_STATED, PoseRows
from handeye.detection import Detection, Image, Reason, detect_all
from handeye.errors import DetectionError, HandeyeError, InputError, UnstatedError
from handeye.estimation import Measurements
from handeye.importing.bag_choice import NOTHING_CHOSEN, BagOptions
from handeye.importing.bags import Timing, pictures_of
from handeye.importing.own_camera import calibrated_from_used_views, camera_of_views
from handeye.importing.readings import MIN_VIEWS, compare
from handeye.importing.streams import pairs_of
from handeye.importing.unstated import misread, unstated
from handeye.robots import Arm
from handeye.types import Camera, Mounting, Recording, Target
from handeye.types.arrays import FloatArray

# So many images from the first on, all with a board of another size: the size was given wrongly, and looking
# at the rest, which is slow where nothing is found, would only say so again.
ENOUGH_OF_WRONG_SIZE = 4


class CameraOrigin(StrEnum):
    """Where the camera's parameters came from."""

    GIVEN = "given"
    """From the caller."""
    FILES = "files"
    """From the folder."""
    CALIBRATED = "calibrated"
    """From an ordinary camera calibration of the same images."""


@dataclass(frozen=True)
class SourceOptions:
    """What the files of a folder may leave open.

    Parameters
    ----------
    layout
        Name of the layout; None to recognise it.
    target
        The calibration target; takes the place of what the files say.
    pattern
        Rows and columns of inner corners of a chessboard whose square size is in the files.
    mounting
        Where the camera sits; None for what the files say, or else in the hand.
    camera
        The camera; None for what the files say, or else calibrated from the images.
    poses
        File or folder with the robot's poses, where several fit.
    stated
        How these poses are written, as far as it is said.
    bag
        What counts in a bag.
    arm
        The robot, whose joints a bag or a file of poses may have in place of poses.

    Examples
    --------
    >>> SourceOptions(poses="poses.csv").poses
    'poses.csv'
    """

    layout: str | None = None
    target: Target | None = None
    pattern: tuple[int, int] | None = None
    mounting: Mounting | None = None
    camera: Camera | None = None
    poses: str | None = None
    stated: Statement = NOTHING_STATED
    bag: BagOptions = NOTHING_CHOSEN
    arm: Arm | None = None


@dataclass(frozen=True, eq=False)
class Opened:
    """A recording and how it came about.

    Attributes
    ----------
    recording
        Ready to be solved.
    folder
        Where it was read from; images are relative to it.
    layout
        Name of the layout, `handeye` for a recording.
    camera_origin
        Where the camera's parameters came from.
    missed
        Name of each image without the target, and why.
    warnings
        Values that are possible but hardly meant.
    timing
        How pictures and poses lie in time; None where they are no bag's.
    """

    recording: Recording
    folder: Path
    layout: str
    camera_origin: CameraOrigin
    missed: Mapping[str, str] = field(default_factory=dict[str, str])
    warnings: tuple[DataWarning, ...] = ()
    timing: Timing | None = None


def open_folder(
    path: str | os.PathLike[str],
    options: SourceOptions | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> Opened:
    """Read a folder of any known layout; where there are only images, find the target in them.

    Parameters
    ----------
    path
        The folder.
    options
        What its files leave open.
    progress
        Called with the number of images done and of all images, first with none done.

    Raises
    ------
    InputError
        Nothing that can be read, an image missing or damaged, too few views to calibrate the camera from, a
        camera of another size than the images, or nothing that says how the robot's poses are written: then
        the message names the way that agrees with the images.
    DegenerateError
        The views do not determine the camera.
    DetectionError
        The target is in none of the images.

    Examples
    --------
    >>> from handeye.datasets.shipped import shipped_recording
    >>> open_folder(shipped_recording()).recording.mounting.value
    'eye_in_hand'
    """
    opened = open_any(path, options, progress=progress)
    if isinstance(opened, PosePairs):
        raise InputError(
            f"{opened.name}: poses of the target without pictures, expected pictures or corners",
            code=Code.NO_PICTURES,
            hint="handeye solve, replay, check and export take it; other commands need what the camera saw",
        )
    return opened


def open_any(
    path: str | os.PathLike[str],
    options: SourceOptions | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> Opened | PosePairs:
    """Read what `open_folder` reads, and sets that hold poses of the target instead of pictures.

    Raises
    ------
    InputError, DegenerateError, DetectionError
        As `open_folder`.
    """
    options = options or SourceOptions()
    loaded = load(
        path,
        layout=options.layout,
        target=options.target,
        pattern=options.pattern,
        mounting=options.mounting,
        poses=options.poses,
        stated=options.stated,
        arm=options.arm,
    )
    if isinstance(loaded, LoadedRecording):
        return _of_recording(loaded, options.camera)
    if isinstance(loaded, PosePairs):
        return loaded
    if isinstance(loaded, PoseStreams):
        return pairs_of(loaded)
    if isinstance(loaded, Contents):
        return _of_bag(loaded, options, progress or _nothing)
    if isinstance(loaded, UnreadPoses):
        opened = _of_images(loaded.images, options.camera, progress or _nothing)
        raise told_by_pictures(loaded, opened.recording, options.mounting)
    opened = _of_images(loaded, options.camera, progress or _nothing)
    if loaded.written is not None:
        _check_written(loaded, loaded.written, opened.recording)
    return opened


def _nothing(done: int, total: int) -> None:
    """Report no progress."""


def _of_recording(loaded: LoadedRecording, camera: Camera | None) -> Opened:
    if camera is None:
        return Opened(
            loaded.recording, loaded.folder, "handeye", CameraOrigin.FILES, warnings=loaded.warnings
        )
    _check_size(camera, loaded.recording.camera.size_px, f"the pictures of {loaded.recording.name}")
    recording = replace(loaded.recording, camera=camera)
    return Opened(
        recording, loaded.folder, "handeye", CameraOrigin.GIVEN, warnings=recording_warnings(recording)
    )


def _of_images(images: ImageSet, given: Camera | None, progress: Callable[[int, int], None]) -> Opened:
    found, missed, size = _detect(images, progress)
    camera, origin = _camera(images, given, found, size)
    views = [
        shot.with_points(detection.point_ids, detection.pixels, detection.sigmas_px)
        for shot in images.shots
        if (detection := found.get(shot.name)) is not None
    ]
    recording = images.recording(camera, views)
    if origin is CameraOrigin.CALIBRATED:
        recording = calibrated_from_used_views(recording)
    # What both the set and the recording made of it look at is said once.
    notes = dict.fromkeys(detection.note for detection in found.values() if detection.note)
    differs = [DataWarning("target_differs", note) for note in notes]
    warnings = {
        warning.code: warning for warning in (*images.warnings, *differs, *recording_warnings(recording))
    }
    return Opened(recording, images.folder, images.layout, origin, missed, tuple(warnings.values()))


def _of_bag(contents: Contents, options: SourceOptions, progress: Callable[[int, int], None]) -> Opened:
    place = contents.path if contents.path.is_dir() else contents.path.parent
    target = stated_target(place, ImportOptions(options.target, options.pattern))
    mounting = options.mounting or Mounting.EYE_IN_HAND
    pictures = pictures_of(contents, options.bag, options.arm, target, mounting)
    opened = _of_images(pictures.images(), options.camera, progress)
    timing = pictures.timing(opened.recording)
    if timing.lag is not None and pictures.misses_stations(timing.lag):
        pictures.shift(timing.lag)
        opened = _of_images(pictures.images(), options.camera, progress)
        timing = pictures.timing(opened.recording)
    return replace(opened, timing=timing)


def _detect(
    images: ImageSet, progress: Callable[[int, int], None]
) -> tuple[Mapping[str, Detection], dict[str, str], tuple[int, int]]:
    """Find the target in the images; what was found, why the others have nothing, and the size of the images.

    Raises
    ------
    InputError
        An image is missing or damaged: that is an accident, not a view without the target.
    DetectionError
        The target is in no image, or the first ones show one of another size.
    """
    total, done, wrong = len(images.shots), 0, 0
    sizes: dict[str, tuple[int, int]] = {}

    def read(shot: Shot) -> Image:
        image = images.grey(shot)
        sizes[shot.name] = (image.shape[1], image.shape[0])
        return image

    def count(name: str, outcome: Detection | HandeyeError) -> None:
        nonlocal done, wrong
        if isinstance(outcome, InputError):
            where = f"image of view {name}"
            raise InputError(f"{where}: {outcome.message}", code=outcome.code, hint=outcome.hint) from outcome
        done += 1
        progress(done, total)
        if isinstance(outcome, DetectionError) and outcome.code in {Reason.WRONG_SIZE, Reason.OTHER_BOARD}:
            wrong += 1
            if wrong == done == ENOUGH_OF_WRONG_SIZE:
                raise DetectionError(
                    f"the first {done} of {total} images show another target; {outcome.message}",
                    code=Code.NOT_DETECTED,
                    hint=outcome.hint,
                ) from outcome

    progress(done, total)
    readers = [(shot.name, partial(read, shot)) for shot in images.shots]
    batch = detect_all(readers, images.target, progress=count)
    batch.raise_if_none()
    missed = {name: error.message.removeprefix(f"{name}: ") for name, error in batch.failed.items()}
    return batch.found, missed, sizes.get(images.shots[-1].name) or images.image_size_px or (0, 0)


def _camera(
    images: ImageSet, given: Camera | None, found: Mapping[str, Detection], size: tuple[int, int]
) -> tuple[Camera, CameraOrigin]:
    for camera, origin in ((given, CameraOrigin.GIVEN), (images.camera, CameraOrigin.FILES)):
        if camera is not None:
            _check_size(camera, size, f"the pictures in {images.folder}")
            return camera, origin
    return camera_of_views(images.target, found, size), CameraOrigin.CALIBRATED


def _check_size(camera: Camera, size: tuple[int, int], what: str) -> None:
    if camera.size_px != size:
        raise InputError(
            f"the camera is calibrated for {camera.width_px} x {camera.height_px} pixels, {what} have "
            f"{size[0]} x {size[1]}",
            code=Code.IMAGE_SIZE,
            hint="give the calibration at the size of the pictures, or leave the camera out: it is then "
            "calibrated from the pictures",
        )


def told_by_pictures(unread: UnreadPoses, recording: Recording, mounting: Mounting | None) -> UnstatedError:
    """Return the error that says which way to read the robot's poses agrees with the pictures."""
    rows, seen = _rows_and_target(unread.images, unread.rows, recording)
    mountings = tuple(Mounting) if mounting is None else (mounting,)
    agreements = compare(rows, unread.readings, seen, mountings)
    return unstated(unread, agreements, mounting_stated=mounting is not None, views=len(rows))


def _check_written(images: ImageSet, written: WrittenPoses, recording: Recording) -> None:
    """Refuse poses that fit the pictures under another reading than the one that is stated, and not under it.

    Other mistakes are left to those who look for them: numbers tell more here than the poses made of them.
    """
    rows, seen = _rows_and_target(images, written.rows, recording)
    stated = compare(rows, (written.reading,), seen, (recording.mounting,))
    if len(rows) < MIN_VIEWS or any(agreement.fits for agreement in stated):
        return
    silent = replace(rows, stated=NOTHING_STATED, degrees=None)
    error = misread(written, stated, compare(silent, silent.readings(), seen, (recording.mounting,)))
    if error is not None:
        raise error


def _rows_and_target(images: ImageSet, rows: PoseRows, recording: Recording) -> tuple[PoseRows, FloatArray]:
    """Return the rows of the views that are usable, and the poses of the target (N, 4, 4) in these."""
    measurements = Measurements.of_recording(recording)
    places = {shot.name: row for row, shot in enumerate(images.shots)}
    return rows.select([places[view.name] for view in measurements.views]), measurements.camera_poses
