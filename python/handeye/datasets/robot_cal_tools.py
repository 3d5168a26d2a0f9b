"""The layout of robot_cal_tools (and of older examples of industrial_calibration).

::

    cal_data.yaml               list of {pose: poses/0.yaml, image: images/0.png}, paths relative to it
    poses/0.yaml                x, y, z (metres), qx, qy, qz, qw: T_base_flange
    target.yaml                 target_finder: {type, rows, cols, spacing | chessboard_dim, aruco_marker_dim,
    dictionary} camera_intr.yaml            intrinsics: {fx, fy, cx, cy}; camera_intr_calibrated.yaml is
    preferred to it pose_guesses.yaml           tells by its names where the camera sits:
    base_to_camera_guess means beside the robot

The modified circle grid has one larger dot, at the lower left (the origin of their frame, y up).
"""

import re
from pathlib import Path
from typing import Any

import msgspec

from handeye.codes import Code
from handeye.datasets.image_set import ImageSet, ImportOptions, Shot, common_image_size
from handeye.datasets.importer import Importer
from handeye.datasets.plausibility import DataWarning, camera_warnings, pose_warnings, target_warnings
from handeye.datasets.reading import inside, is_file, located
from handeye.datasets.yaml_reading import read_yaml
from handeye.errors import InputError
from handeye.types import Camera, Charuco, CircleGrid, Mounting, Pose, Target
from handeye.types.plain import read_document
from handeye.types.target.dictionaries import dictionary_of_number

LIST_FILES = ("cal_data.yaml", "data.yaml")
TARGET_FILE = "target.yaml"
CAMERA_FILES = ("camera_intr_calibrated.yaml", "camera_intr.yaml")
GUESS_FILE = "pose_guesses.yaml"
MAX_SHOTS = 100_000
# The files do not say how large the dots are; only the small shift of a circle's centre by perspective
# depends on it.
ASSUMED_DIAMETER_SHARE = 0.5


class Entry(msgspec.Struct):
    """One station: files of pose and image, relative to the list."""

    pose: str
    image: str


class _PoseDocument(msgspec.Struct):
    x: float
    y: float
    z: float
    qx: float
    qy: float
    qz: float
    qw: float


class Intrinsics(msgspec.Struct):
    """A pinhole camera, in pixels."""

    fx: float
    fy: float
    cx: float
    cy: float


class _CameraDocument(msgspec.Struct):
    intrinsics: Intrinsics


class Finder(msgspec.Struct):
    """The target, lengths in metres."""

    type: str
    rows: int
    cols: int
    spacing: float | None = None
    chessboard_dim: float | None = None
    aruco_marker_dim: float | None = None
    dictionary: int | None = None


class _TargetDocument(msgspec.Struct):
    target_finder: Finder


def recognises(folder: Path) -> bool:
    """Tell whether a folder has this layout: the file holds a list, or cannot be read at all."""
    listed = _list_file(folder)
    if listed is None:
        return False
    try:
        return not isinstance(read_yaml(folder / listed), dict)
    except InputError:
        return True


def read(folder: Path, options: ImportOptions) -> ImageSet:
    """Read a set.

    Raises
    ------
    InputError
        A file that is missing or not what it should be, a path that leaves the folder, or a kind of target
        that is not known here.
    """
    listed = _list_file(folder)
    if listed is None:
        raise InputError(f"{folder}: {LIST_FILES[0]} is missing", code=Code.MISSING_FILE)
    file = folder / listed
    entries = read_document(read_yaml(file), list[Entry], str(file), lax=True)
    shots = shots_of(entries, file)
    size = common_image_size(folder, shots)
    target, warnings = _target(folder, options)
    camera, camera_notes = _camera(folder, size)
    named_poses = ((shot.name, shot.T_base_flange) for shot in shots)
    return ImageSet(
        name=folder.resolve().name,
        layout=IMPORTER.name,
        folder=folder,
        mounting=options.mounting or _mounting(folder),
        target=target,
        shots=shots,
        image_size_px=size,
        camera=camera,
        source=f"robot_cal_tools layout, folder {folder.resolve().name}",
        warnings=(*warnings, *camera_notes, *pose_warnings(named_poses), *target_warnings(target)),
    )


def shots_of(entries: list[Entry], file: Path) -> tuple[Shot, ...]:
    """Return the stations of a list in a file.

    Raises
    ------
    InputError
        Too many, or a file of a pose that is missing, leaves the folder, or is no pose.
    """
    if len(entries) > MAX_SHOTS:
        raise InputError(f"{file}: {len(entries)} entries, expected at most {MAX_SHOTS}", code=Code.TOO_LARGE)
    return tuple(_shot(entry, name, file) for entry, name in zip(entries, _names(entries), strict=True))


def _list_file(folder: Path) -> str | None:
    """Return the name of the list of poses and images."""
    if is_file(folder / LIST_FILES[0]):
        return LIST_FILES[0]
    # The second name is too common to mean anything without a target beside it.
    return LIST_FILES[1] if is_file(folder / LIST_FILES[1]) and is_file(folder / TARGET_FILE) else None


def _shot(entry: Entry, name: str, file: Path) -> Shot:
    where = f"{file}: image {entry.image[:120]!r}"
    path = inside(file.parent, entry.pose, f"{where}: pose")
    document = read_document(read_yaml(path), _PoseDocument, str(path), lax=True)
    translation = [document.x, document.y, document.z]
    with located(str(path)):
        pose = Pose.from_quaternion(translation, [document.qx, document.qy, document.qz, document.qw])
    with located(where):
        return Shot(name, entry.image, pose)


def _names(entries: list[Entry]) -> list[str]:
    """Return the names of the views: those of the images, numbered where two images have one name."""
    stems = [re.sub(r"[^A-Za-z0-9_.-]", "_", Path(entry.image).stem)[:80] for entry in entries]
    if len({stem.lower() for stem in stems}) == len(stems):
        return stems
    return [f"{index:03d}_{stem}" for index, stem in enumerate(stems)]


def _target(folder: Path, options: ImportOptions) -> tuple[Target, tuple[DataWarning, ...]]:
    if options.target is not None:
        return options.target, ()
    file = folder / TARGET_FILE
    finder = read_document(read_yaml(file), _TargetDocument, str(file), lax=True).target_finder
    with located(str(file)):
        return target_of(finder)


def target_of(finder: Finder) -> tuple[Target, tuple[DataWarning, ...]]:
    """Return the target of a finder, and what was assumed.

    Raises
    ------
    InputError
        A kind of target that is not known here, or a measure that is missing.
    """
    if "ModifiedCircleGrid" in finder.type:
        spacing = _needed(finder.spacing, "spacing")
        # Their rows are counted from the top with the origin, the large dot, at the bottom.
        grid = CircleGrid(
            finder.rows,
            finder.cols,
            spacing,
            ASSUMED_DIAMETER_SHARE * spacing,
            marked=(finder.rows - 1) * finder.cols,
        )
        message = (
            f"{TARGET_FILE} does not say how large the dots are: {grid.diameter_m * 1e3:g} mm assumed, "
            "which matters only for the small shift of a circle's centre by perspective"
        )
        return grid, (DataWarning("diameter_assumed", message),)
    if "Charuco" in finder.type:
        number = _needed(finder.dictionary, "dictionary")
        board = Charuco(
            finder.rows,
            finder.cols,
            _needed(finder.chessboard_dim, "chessboard_dim"),
            _needed(finder.aruco_marker_dim, "aruco_marker_dim"),
            dictionary_of_number(number, "target_finder"),
        )
        return board, ()
    raise InputError(
        f"target_finder: type {finder.type[:80]!r}, expected a modified circle grid or a ChArUco board",
        code=Code.UNKNOWN_TARGET,
        hint="give the target yourself",
    )


def _needed(value: Any, field: str) -> Any:  # noqa: ANN401 - what is there is returned as it is
    if value is None:
        raise InputError(f"target_finder: {field} is missing", code=Code.INVALID_FIELD)
    return value


def _camera(folder: Path, size: tuple[int, int] | None) -> tuple[Camera | None, list[DataWarning]]:
    files = [name for name in CAMERA_FILES if is_file(folder / name)]
    if not files or size is None:
        return None, []
    file = folder / files[0]
    k = read_document(read_yaml(file), _CameraDocument, str(file), lax=True).intrinsics
    with located(str(file)):
        camera = Camera("pinhole", [k.fx, k.fy, k.cx, k.cy], *size)
    warnings = camera_warnings(camera)
    if len(files) > 1:
        message = f"the camera is taken from {files[0]}, not from {files[1]}"
        warnings.insert(0, DataWarning("camera_chosen", message))
    return camera, warnings


def _mounting(folder: Path) -> Mounting:
    file = folder / GUESS_FILE
    if not is_file(file):
        return Mounting.EYE_IN_HAND
    guesses = read_document(read_yaml(file), dict[str, Any], str(file), lax=True)
    return Mounting.EYE_TO_HAND if "base_to_camera_guess" in guesses else Mounting.EYE_IN_HAND


IMPORTER = Importer("robot_cal_tools", f"a folder with {LIST_FILES[0]} and {TARGET_FILE}", recognises, read)
