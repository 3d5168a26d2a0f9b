"""The layout of Ali, Suominen, Gotchev and Ruiz Morales, Sensors 19(12) 2837, 2019.

::

    01.png, 02.png, ... or im_01.png, ...   images of a chessboard
    RobotPosesVec.txt                       T_base_flange, 16 numbers a line by rows, metres, in the order of
    the images squaresize.txt or square size.txt       such as "15mm" or "200mm or 20cm"
    GroundTruth.txt                         simulated sets only: "hand2eye = " and 16 numbers

The number of corners is not in the files: it is known here for the published sets and asked for otherwise.
`RobotPoses.mat` holds the same poses again and is not read.
"""

import re
from pathlib import Path

from handeye.codes import Code
from handeye.datasets.image_header import IMAGE_SUFFIXES
from handeye.datasets.image_set import ImageSet, ImportOptions, Shot, common_image_size
from handeye.datasets.importer import Importer
from handeye.datasets.plausibility import DataWarning, pose_warnings, target_warnings
from handeye.datasets.reading import MIB, file_names, is_file, located, number, read_text
from handeye.errors import InputError
from handeye.types import Chessboard, Mounting, Pose, Target, Truth

POSES_FILE = "RobotPosesVec.txt"
TRUTH_FILE = "GroundTruth.txt"
SOURCE = (
    "Ali, Suominen, Gotchev, Ruiz Morales: Methods for Simultaneous Robot-World-Hand-Eye Calibration: "
    "A Comparative Study. Sensors 19(12), 2837, 2019"
)
# Rows and columns of inner corners of the published sets.
PUBLISHED_PATTERNS = {
    "CS_synthetic_1": (6, 9),
    "CS_synthetic_2": (6, 9),
    "CS_synthetic_3": (6, 9),
    "kuka_1": (17, 28),
    "kuka_2": (17, 24),
}
_SQUARE_SIZE_FILE = re.compile(r"square[ _-]?size\.txt", re.IGNORECASE)
_LENGTH = re.compile(r"(?<![\d.])([\d.]+)\s*(mm|cm|m)(?![a-z])", re.IGNORECASE | re.ASCII)
_METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
_MAX_BYTES = 8 * MIB


def recognises(folder: Path) -> bool:
    """Tell whether a folder has this layout."""
    return is_file(folder / POSES_FILE)


def read(folder: Path, options: ImportOptions) -> ImageSet:
    """Read a set.

    Raises
    ------
    InputError
        A file that is missing or not what it should be; as many poses as images are expected; the pattern is
        not known.
    """
    poses = read_poses(folder / POSES_FILE)
    images = [name for name in file_names(folder) if Path(name).suffix.lower() in IMAGE_SUFFIXES]
    if len(poses) != len(images):
        raise InputError(
            f"{folder}: {len(poses)} poses in {POSES_FILE} but {len(images)} images, expected as many",
            code=Code.COUNTS_DIFFER,
            hint="each line of the poses belongs to one image, in the order of the names",
        )
    shots = _shots(folder, images, poses)
    square_m = _square_size(folder)
    target, warnings = _target(folder, square_m, options)
    truth = None
    if is_file(folder / TRUTH_FILE):
        truth = Truth(X=read_hand_to_eye(folder / TRUTH_FILE))
    name = folder.resolve().name
    named_poses = ((shot.name, shot.T_base_flange) for shot in shots)
    return ImageSet(
        name=name,
        layout=IMPORTER.name,
        folder=folder,
        mounting=options.mounting or Mounting.EYE_IN_HAND,
        target=target,
        shots=shots,
        image_size_px=common_image_size(folder, shots),
        truth=truth,
        source=SOURCE if name in PUBLISHED_PATTERNS else f"{IMPORTER.name} layout, folder {name}",
        warnings=(*warnings, *pose_warnings(named_poses), *target_warnings(target)),
    )


def read_poses(path: Path) -> list[Pose]:
    """Return the poses of a file with 16 numbers a line.

    Raises
    ------
    InputError
        Not such a file; the message names the line.
    """
    poses: list[Pose] = []
    for index, line in enumerate(read_text(path, _MAX_BYTES).splitlines(), start=1):
        where = f"{path}: line {index}"
        fields = line.replace(",", " ").split()
        if not fields:
            continue
        if len(fields) != 16:
            raise InputError(
                f"{where}: {len(fields)} numbers, expected 16 (a 4 x 4 matrix by rows)", code=Code.WRONG_SHAPE
            )
        values = [number(field, where) for field in fields]
        with located(where):
            poses.append(Pose([values[0:4], values[4:8], values[8:12], values[12:16]]))
    return poses


def read_hand_to_eye(path: Path) -> Pose:
    """Return the true `T_camera_flange`, the matrix `hand2eye`.

    The other matrix, `base2grid`, is not used: it depends on which corner of the board is called the first.

    Raises
    ------
    InputError
        No such matrix in the file, or not a rigid transform.
    """
    _, found, rest = read_text(path, MIB).partition("hand2eye")
    fields = rest.lstrip(" \t=:").split()[:16]
    if not found or len(fields) < 16:
        raise InputError(f"{path}: expected 'hand2eye =' and a 4 x 4 matrix", code=Code.INVALID_FIELD)
    where = f"{path}: hand2eye"
    values = [number(field, where) for field in fields]
    with located(where):
        return Pose([values[0:4], values[4:8], values[8:12], values[12:16]])


def read_square_size(path: Path) -> float:
    """Return the side of a square in metres from a text such as ``15mm`` or ``200mm or 20cm``.

    Raises
    ------
    InputError
        No length with its unit, or lengths that contradict each other.
    """
    text = read_text(path, MIB)
    lengths = [number(value, str(path)) * _METRES[unit.lower()] for value, unit in _LENGTH.findall(text)]
    hint = "write for example 15mm"
    if not lengths or min(lengths) <= 0:
        raise InputError(
            f"{path}: {text[:40]!r}, expected a length with its unit (mm, cm or m)",
            code=Code.INVALID_FIELD,
            hint=hint,
        )
    if max(lengths) > min(lengths) * (1 + 1e-9):
        raise InputError(f"{path}: {text[:40]!r} contradicts itself", code=Code.INVALID_FIELD, hint=hint)
    return lengths[0]


def _shots(folder: Path, images: list[str], poses: list[Pose]) -> tuple[Shot, ...]:
    shots: dict[str, Shot] = {}
    for image, pose in zip(images, poses, strict=True):
        name = re.sub(r"[^A-Za-z0-9_.-]", "_", Path(image).stem)
        if name.lower() in shots:
            raise InputError(
                f"{folder}: {image} and {shots[name.lower()].image} have one name", code=Code.DUPLICATE_VIEW
            )
        with located(str(folder)):
            shots[name.lower()] = Shot(name, image, pose)
    return tuple(shots.values())


def _square_size(folder: Path) -> float | None:
    files = [name for name in file_names(folder) if _SQUARE_SIZE_FILE.fullmatch(name)]
    sizes = {name: read_square_size(folder / name) for name in files}
    if len(set(sizes.values())) > 1:
        raise InputError(f"{folder}: {' and '.join(sizes)} contradict each other", code=Code.INVALID_FIELD)
    return next(iter(sizes.values()), None)


def _target(
    folder: Path, square_m: float | None, options: ImportOptions
) -> tuple[Target, tuple[DataWarning, ...]]:
    if options.target is not None:
        given = options.target
        if (
            square_m is not None
            and isinstance(given, Chessboard)
            and abs(given.pitch_m / square_m - 1) > 1e-6
        ):
            message = f"the given squares of {given.pitch_m:g} m are used, but {folder} says {square_m:g} m"
            return given, (DataWarning("target_differs", message),)
        return given, ()
    pattern = options.pattern or PUBLISHED_PATTERNS.get(folder.resolve().name)
    if pattern is None:
        raise InputError(
            f"{folder}: the number of corners of the chessboard is not in the files",
            code=Code.PATTERN_UNKNOWN,
            hint="give --rows and --columns of inner corners, or --target FILE for any other board: "
            "ChArUco, AprilGrid, ArUco markers, circles; handeye target writes such a file",
        )
    if square_m is None:
        raise InputError(
            f"{folder}: the size of the squares is not in the files, expected squaresize.txt",
            code=Code.MISSING_FILE,
            hint="write a file squaresize.txt with for example 15mm",
        )
    return Chessboard(*pattern, square_m), ()


IMPORTER = Importer("rwhe-calib", f"a folder with {POSES_FILE} and images", recognises, read)
