"""Pictures, and the robot's poses in a file of any kind: the folder that people have.

::

    im_01.png, im_02.png, ...   in the folder, or in one folder below it
    poses.csv                   or .txt, .json, .yaml: rows that name their picture, or as many as
                                pictures and in the order of their names (2 before 10)
    pose_01.yaml, ...           or one file for each picture, as Zivid and ViSP write them
    board.toml                  perhaps: the target, in our own words
    camera.yaml                 perhaps: the camera, in any format that `read_camera` knows

Where nothing says how the poses are written, the result is `UnreadPoses`, and the pictures have to tell.
"""

import itertools
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from handeye.codes import Code
from handeye.datasets.camera_files import read_camera
from handeye.datasets.image_header import IMAGE_SUFFIXES
from handeye.datasets.image_set import (
    ImageSet,
    ImportOptions,
    Shot,
    UnreadPoses,
    WrittenPoses,
    common_image_size,
)
from handeye.datasets.importer import Importer
from handeye.datasets.joint_states import read_joint_rows
from handeye.datasets.parameter_files import read_target
from handeye.datasets.plausibility import (
    DataWarning,
    accuracy_warnings,
    camera_warnings,
    pose_warnings,
    target_warnings,
)
from handeye.datasets.pose_files import read_pose_rows
from handeye.datasets.pose_rows import PoseRows
from handeye.datasets.reading import file_names, folder_names, is_file, located
from handeye.errors import InputError
from handeye.types import Camera, Mounting, Pose, Target

POSE_SUFFIXES = frozenset({".csv", ".tsv", ".txt", ".json", ".yaml", ".yml", ".xml", ".dat", ".tum"})
_TARGET = re.compile(
    r"(board|target|.*_board|.*_target)\.(toml|json|ya?ml)|(april|checkerboard|circlegrid).*\.ya?ml",
    re.IGNORECASE,
)
_CAMERA = re.compile(
    r"(camera.*|cam0?|ost|.*intrinsics?.*|calibration|camchain.*)\.(toml|json|ya?ml|xml|txt)", re.IGNORECASE
)
_MAX_PICTURES = 100_000
# More files than this are not opened to see whether they hold poses.
_MAX_OPENED = 20


def recognises(folder: Path) -> bool:
    """Tell whether there are pictures and a file of poses."""
    try:
        return bool(_pictures(folder)) and bool(_candidates(folder))
    except InputError:
        return False


def read(folder: Path, options: ImportOptions) -> ImageSet | UnreadPoses:
    """Read a set.

    Raises
    ------
    InputError
        No pictures or no file of poses, several of them, rows that cannot be matched to the pictures, or no
        target.
    """
    pictures = _pictures(folder)
    if not pictures:
        raise InputError(
            f"{folder}: no pictures, expected {', '.join(sorted(IMAGE_SUFFIXES))}", code=Code.NO_IMAGES
        )
    rows, file = _rows(folder, pictures, options)
    named_file = "a file of poses for each" if file == str(folder) else file
    chosen, warnings = _matched(folder, pictures, rows)
    rows = rows.select([row for row, _ in chosen])
    readings = rows.readings(options.stated)
    known = len(readings) == 1
    poses = rows.poses(readings[0]) if known else (Pose.identity(),) * len(rows)
    shots = _shots(folder, [picture for _, picture in chosen], poses, rows)
    size = common_image_size(folder, shots)
    target = stated_target(folder, options)
    camera, camera_notes = _camera(folder)
    images = ImageSet(
        name=folder.resolve().name,
        layout=IMPORTER.name,
        folder=folder,
        mounting=options.mounting or Mounting.EYE_IN_HAND,
        target=target,
        shots=shots,
        image_size_px=size,
        camera=camera,
        source=f"pictures and {named_file} in folder {folder.resolve().name}",
        warnings=(
            *warnings,
            *accuracy_warnings(rows.accuracies, file),
            *camera_notes,
            *target_warnings(target),
        ),
    )
    if known:
        named = zip((shot.name for shot in shots), poses, strict=True)
        written = None if rows.joints is not None else WrittenPoses(rows, readings[0], file)
        return replace(images, warnings=(*images.warnings, *pose_warnings(named)), written=written)
    return UnreadPoses(images, rows, readings, file)


def _pictures(folder: Path) -> list[str]:
    """Return the pictures in the folder or, if it has none, in the one folder below that has some."""
    own = _pictures_in(folder)
    if own:
        return own
    below = {name: _pictures_in(folder / name) for name in folder_names(folder)[:_MAX_OPENED]}
    filled = [f"{name}/{picture}" for name, found in below.items() for picture in found]
    return filled if sum(map(bool, below.values())) == 1 else []


def _pictures_in(folder: Path) -> list[str]:
    return [name for name in file_names(folder) if Path(name).suffix.lower() in IMAGE_SUFFIXES][
        :_MAX_PICTURES
    ]


def _rows(folder: Path, pictures: Sequence[str], options: ImportOptions) -> tuple[PoseRows, str]:
    """Return the rows, and the name of their file."""
    if options.poses is not None:
        path = _given(folder, options.poses)
        if path.is_dir():
            return _one_a_file(path, [path / name for name in _candidates(path)]), options.poses
        return _read_rows(path, options), options.poses
    names = _candidates(folder)
    if not names:
        raise InputError(
            f"{folder}: no file with the robot's poses",
            code=Code.MISSING_FILE,
            hint="name it with --poses; CSV, text, JSON and YAML are read",
        )
    if len(names) >= max(3, len(pictures)):
        return _one_a_file(folder, [folder / name for name in names]), str(folder)
    found: dict[str, PoseRows] = {}
    failures: list[str] = []
    for name in names[:_MAX_OPENED]:
        try:
            found[name] = _read_rows(folder / name, options)
        except InputError as error:
            if error.code in {Code.UNKNOWN_ARM, Code.WRONG_ARM}:
                raise
            failures.append(error.message)
    if len(found) > 1:
        fitting = {name: rows for name, rows in found.items() if len(rows) == len(pictures)}
        found = fitting if len(fitting) == 1 else found
    if len(found) > 1:
        raise InputError(
            f"{folder}: {' and '.join(found)} hold poses",
            code=Code.AMBIGUOUS_FORMAT,
            hint="name the right one with --poses",
        )
    if not found:
        raise InputError(
            f"{folder}: no file with the robot's poses: {'; '.join(failures)[:400]}", code=Code.NO_POSES
        )
    (name, rows), *_ = found.items()
    return rows, name


def _read_rows(path: Path, options: ImportOptions) -> PoseRows:
    joints = read_joint_rows(path, options.arm)
    return read_pose_rows(path) if joints is None else joints


def _given(folder: Path, name: str) -> Path:
    """Return the path of a file that the caller names: from where he stands, or in the folder."""
    here, inner = Path(name), folder / name
    paths = [path for path in (here, inner) if path.exists()]
    if len(paths) == 2 and not here.samefile(inner):
        raise InputError(
            f"--poses {name}: there is one here and one in {folder}",
            code=Code.AMBIGUOUS_FORMAT,
            hint=f"write ./{name} or {inner}",
        )
    if not paths:
        raise InputError(f"{name}: no such file, here or in {folder}", code=Code.MISSING_FILE)
    return paths[0]


def _candidates(folder: Path) -> list[str]:
    """Return the names of files that may hold poses, by their names alone."""
    return [
        name
        for name in file_names(folder)
        if Path(name).suffix.lower() in POSE_SUFFIXES
        and not _TARGET.fullmatch(name)
        and not _CAMERA.fullmatch(name)
        and not name.lower().startswith(("readme", "license", "hand_eye", "handeye"))
    ]


def _one_a_file(folder: Path, files: Sequence[Path]) -> PoseRows:
    """Return the rows of files that hold one pose each, named by the files."""
    parts = [read_pose_rows(file) for file in files]
    counts = {(len(part), part.values.shape[1], part.labels) for part in parts}
    if len(counts) != 1 or len(parts[0]) != 1:
        raise InputError(
            f"{folder}: {len(files)} files, expected one pose in each, all written the same way",
            code=Code.COUNTS_DIFFER,
            hint="name the file or the folder of poses with --poses",
        )
    first = parts[0]
    return replace(
        first,
        file=folder,
        names=tuple(file.stem for file in files),
        values=np.concatenate([part.values for part in parts]),
        places=tuple(file.name for file in files),
    )


def _matched(
    folder: Path, pictures: Sequence[str], rows: PoseRows
) -> tuple[list[tuple[int, str]], list[DataWarning]]:
    """Return pairs of row and picture: by name where rows have names, else in order."""
    if all(rows.names):
        for key in (str.lower, _base, _stem, _number):
            pairs = _by(key, pictures, rows.names)
            if len(pairs) == len(pictures) == len(rows):
                return pairs, []
            counted = _counted(pictures, rows.names) if key is _number else None
            if counted is not None:
                return counted
            if pairs:
                return pairs, _left_out(pictures, rows, pairs)
    if len(rows) != len(pictures):
        raise InputError(
            f"{rows.file}: {len(rows)} poses for {len(pictures)} pictures in {folder}, expected as many",
            code=Code.COUNTS_DIFFER,
            hint="name the picture of each pose in a column image, or remove what does not belong",
        )
    return list(enumerate(pictures)), []


def _by(key: Callable[[str], str], pictures: Sequence[str], names: Sequence[str]) -> list[tuple[int, str]]:
    """Return pairs of row and picture whose keys agree; none unless a key means one of each."""
    places: Mapping[str, list[str]] = {
        value: list(group) for value, group in itertools.groupby(sorted(pictures, key=key), key)
    }
    keys = [key(name.replace("\\", "/")) for name in names]
    if len(set(keys)) < len(keys) or "" in keys:
        return []
    return [(row, places[value][0]) for row, value in enumerate(keys) if len(places.get(value, ())) == 1]


def _base(name: str) -> str:
    return name.rsplit("/", maxsplit=1)[-1].lower()


def _stem(name: str) -> str:
    return Path(_base(name)).stem if Path(name).suffix.lower() in IMAGE_SUFFIXES else _base(name)


def _number(name: str) -> str:
    digits = re.findall(r"\d+", _stem(name))
    return str(int(digits[-1])) if digits and len(digits[-1]) < 18 else ""


def _counted(
    pictures: Sequence[str], names: Sequence[str]
) -> tuple[list[tuple[int, str]], list[DataWarning]] | None:
    """Return pairs by rank where as many poses as pictures are counted on, each from a number of its own."""
    numbers = [[_number(name) for name in part] for part in (names, pictures)]
    if len(names) != len(pictures) or not all(all(part) for part in numbers):
        return None
    counts = [sorted(map(int, part)) for part in numbers]
    if any(part != list(range(part[0], part[0] + len(part))) for part in counts):
        return None
    shift = counts[1][0] - counts[0][0]
    places = {int(number): picture for number, picture in zip(numbers[1], pictures, strict=True)}
    message = f"poses are counted from {counts[0][0]}, pictures from {counts[1][0]}: matched in order"
    return [(row, places[int(number) + shift]) for row, number in enumerate(numbers[0])], [
        DataWarning("counted_otherwise", message)
    ]


def _left_out(pictures: Sequence[str], rows: PoseRows, pairs: Sequence[tuple[int, str]]) -> list[DataWarning]:
    used_rows, used = {row for row, _ in pairs}, {picture for _, picture in pairs}
    warnings: list[DataWarning] = []
    for what, missing in (
        ("pictures without a pose", [picture for picture in pictures if picture not in used]),
        ("poses without a picture", [n for i, n in enumerate(rows.names) if i not in used_rows]),
    ):
        if missing:
            more = "" if len(missing) <= 10 else f" and {len(missing) - 10} more"
            message = f"{len(missing)} {what}, left out: {', '.join(missing[:10])}{more}"
            warnings.append(DataWarning(what.replace(" ", "_"), message))
    return warnings


def _shots(folder: Path, pictures: Sequence[str], poses: Sequence[Pose], rows: PoseRows) -> tuple[Shot, ...]:
    names = [re.sub(r"[^A-Za-z0-9_.-]", "_", Path(picture).stem)[:80] for picture in pictures]
    if len({name.lower() for name in names}) < len(names):
        names = [f"{index:03d}_{name}" for index, name in enumerate(names)]
    with located(str(folder)):
        joints = [None] * len(rows) if rows.joints is None else [tuple(row) for row in rows.joints.tolist()]
        return tuple(Shot(*parts) for parts in zip(names, pictures, poses, joints, strict=True))


def stated_target(folder: Path, options: ImportOptions) -> Target:
    """Return the target that is stated, or that the only such file in a folder describes.

    Raises
    ------
    InputError
        Neither.
    """
    if options.target is not None:
        return options.target
    files = [name for name in file_names(folder) if _TARGET.fullmatch(name)]
    if len(files) == 1 and options.pattern is None:
        return read_target(folder / files[0])
    missing = "what the calibration target is" if options.pattern is None else "how large its squares are"
    raise InputError(
        f"{folder}: the files do not say {missing}",
        code=Code.UNKNOWN_TARGET,
        hint="--target FILE for any family (handeye target writes such a file; ChArUco, ArUco, AprilGrid, "
        "circles), or --rows, --columns and --pitch-mm for a chessboard",
    )


def _camera(folder: Path) -> tuple[Camera | None, list[DataWarning]]:
    """Return the camera, if exactly one file looks like one and is."""
    files = [name for name in file_names(folder) if _CAMERA.fullmatch(name)]
    if len(files) != 1 or not is_file(folder / files[0]):
        if len(files) > 1:
            message = f"{' and '.join(files)[:200]} look like cameras; none is used, name one with --camera"
            return None, [DataWarning("camera_ambiguous", message)]
        return None, []
    try:
        camera = read_camera(folder / files[0])
    except InputError as error:
        return None, [DataWarning("camera_unread", f"{error.message}; the camera is not taken from it")]
    return camera, camera_warnings(camera)


IMPORTER = Importer(
    "pose-list",
    "pictures and a file of robot poses (CSV, text, JSON or YAML)",
    recognises,
    read,
    is_general=True,
)
