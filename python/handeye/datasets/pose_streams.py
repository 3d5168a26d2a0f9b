"""Two streams of poses with times, robot and target, as calibrations on the move are recorded.

==================  ==================================================================================
ethz                ``..B_H..csv`` and ``..W_E..csv``: t, x, y, z, qx, qy, qz, qw; hand in base, camera
                    in target (ethz-asl/hand_eye_calibration, README, "Formats" and "Frames")
kinhec              ``ID_robot.csv`` and ``ID_camera.csv`` with named columns, ``ID_groundtruth.json``
                    (kinhec 1.1.0, `Sequence.to_csv`); its Parquet files have to be exported first
tum                 ``.._robot.tum`` and ``.._camera.tum``, also hand, flange, target, board, ...: t, x, y,
                    z, qx, qy, qz, qw (TUM RGB-D benchmark, "File formats"; kinhec, `Sequence.to_tum`)
==================  ==================================================================================

All are in metres and seconds. The camera's clock may run beside that of the robot, and in TUM files the pose
of the target in the camera may also be that of the camera in the target: what agrees with the robot is found.
"""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import cast

import numpy as np

from handeye.codes import Code
from handeye.datasets.bags.contents import matrices
from handeye.datasets.bags.tracks import Track, rising
from handeye.datasets.image_set import ImportOptions
from handeye.datasets.importer import Importer
from handeye.datasets.pose_pairs import PoseStreams
from handeye.datasets.reading import MIB, existing_folder, file_names, located, number, read_text
from handeye.errors import InputError
from handeye.types import Mounting
from handeye.types.arrays import FloatArray

MAX_BYTES = 64 * MIB
MAX_ROWS = 500_000
_POSE = ("px", "py", "pz", "qx", "qy", "qz", "qw")
_ETHZ = (re.compile(r"(.*)b_h(.*)\.csv", re.IGNORECASE), re.compile(r"(.*)w_e(.*)\.csv", re.IGNORECASE))
_KINHEC = (re.compile(r"(.+)_robot\.csv"), re.compile(r"(.+)_camera\.csv"))
_TUM = (
    re.compile(r"(.*?)_?(?:robot|hand|flange|gripper|ee|tcp|arm)()\.(?:tum|txt)", re.IGNORECASE),
    re.compile(r"(.*?)_?(?:camera|cam|target|board|marker|tag|eye)()\.(?:tum|txt)", re.IGNORECASE),
)


def _pair(folder: Path, patterns: tuple[re.Pattern[str], re.Pattern[str]]) -> tuple[str, str] | None:
    """Return the names of the two files; None where there is none, or more than one pair."""
    if not folder.is_dir():
        return None
    try:
        names = file_names(folder)
    except InputError:
        return None
    found = [{m.groups(): n for n in names if (m := pattern.fullmatch(n))} for pattern in patterns]
    both = [key for key in found[0] if key in found[1]]
    return (found[0][both[0]], found[1][both[0]]) if len(both) == 1 else None


def _needed(folder: Path, patterns: tuple[re.Pattern[str], re.Pattern[str]], what: str) -> tuple[Path, Path]:
    pair = _pair(existing_folder(folder), patterns)
    if pair is None:
        raise InputError(f"{folder}: expected one pair of files, {what}", code=Code.MISSING_FILE)
    return folder / pair[0], folder / pair[1]


def _read_ethz(folder: Path, options: ImportOptions) -> PoseStreams:
    robot, seen = _needed(folder, _ETHZ, "such as poses_B_H.csv and poses_W_E.csv")
    eye = _plain(seen)
    turned = Track(eye.times_s, np.asarray(np.linalg.inv(eye.poses), dtype=np.float64), eye.words)
    return PoseStreams(
        folder.resolve().name, "ethz", _source(robot, seen), options.mounting, _plain(robot), turned
    )


def _is_tum(folder: Path) -> bool:
    """Tell whether both files begin with a time and a pose: their names alone say little."""
    pair = _pair(folder, _TUM)
    try:
        return pair is not None and all(
            len(_table(folder / name, _lines(folder / name)[:1], 8, may_miss=False)) for name in pair
        )
    except InputError:
        return False


def _read_tum(folder: Path, options: ImportOptions) -> PoseStreams:
    robot, seen = _needed(folder, _TUM, "such as a_robot.tum and a_camera.tum")
    return PoseStreams(
        folder.resolve().name,
        "tum",
        _source(robot, seen),
        options.mounting,
        _plain(robot),
        _plain(seen),
        True,
    )


def _read_kinhec(folder: Path, options: ImportOptions) -> PoseStreams:
    robot, seen = _needed(folder, _KINHEC, "such as a_robot.csv and a_camera.csv")
    name = robot.name.removesuffix("_robot.csv")
    mounting = options.mounting or _configuration(folder / f"{name}_groundtruth.json")
    columns, table = _named(robot)
    joints = [columns.index(c) for c in columns if re.fullmatch(r"q\d{1,2}_meas", c)]
    arm = rising(
        table[:, columns.index("t")],
        _named_poses(columns, table, "base_ee_meas", robot),
        robot.name,
        table[:, joints] if joints else None,
    )
    columns, table = _named(seen)
    target = rising(
        table[:, columns.index("t")], _named_poses(columns, table, "cam_target_meas", seen), seen.name
    )
    return PoseStreams(name, "kinhec", _source(robot, seen), mounting, arm, target)


def _configuration(path: Path) -> Mounting | None:
    try:
        document = cast("object", json.loads(read_text(path, MAX_BYTES)))
    except (InputError, ValueError, RecursionError):
        return None
    said = cast("dict[str, object]", document).get("configuration") if isinstance(document, dict) else None
    return {"eye_in_hand": Mounting.EYE_IN_HAND, "eye_to_hand": Mounting.EYE_TO_HAND}.get(str(said))


def _named_poses(columns: Sequence[str], table: FloatArray, prefix: str, path: Path) -> FloatArray:
    wanted = [f"{prefix}_{part}" for part in _POSE]
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}", code=Code.INVALID_FIELD)
    return matrices(tuple(row) for row in table[:, [columns.index(name) for name in wanted]].tolist())


def _named(path: Path) -> tuple[list[str], FloatArray]:
    lines = _lines(path)
    columns = [part.strip() for part in lines[0][1].split(",")]
    if len(set(columns)) < len(columns):
        raise InputError(f"{path}: two columns of one name", code=Code.INVALID_FIELD)
    if "t" not in columns:
        raise InputError(f"{path}: no column t", code=Code.INVALID_FIELD)
    if len(lines) == 1:
        raise InputError(f"{path}: no poses in it", code=Code.NO_POSES)
    return columns, _table(path, lines[1:], len(columns), may_miss=True)


def _plain(path: Path) -> Track:
    """Return the track of a file with t, x, y, z, qx, qy, qz, qw in each line."""
    table = _table(path, _lines(path), 8, may_miss=False)
    return rising(table[:, 0], matrices(tuple(row) for row in table[:, 1:].tolist()), path.name)


def _lines(path: Path) -> list[tuple[int, str]]:
    lines = read_text(path, MAX_BYTES).splitlines()
    if len(lines) > MAX_ROWS:
        raise InputError(f"{path}: {len(lines)} lines, expected at most {MAX_ROWS}", code=Code.TOO_LARGE)
    kept = [
        (n, line.strip()) for n, line in enumerate(lines, start=1) if line.strip() and line.strip()[0] != "#"
    ]
    if not kept:
        raise InputError(f"{path}: no poses in it", code=Code.NO_POSES)
    return kept


def _table(path: Path, lines: Sequence[tuple[int, str]], width: int, *, may_miss: bool) -> FloatArray:
    """Return the numbers (N, width) of lines; NaN for an empty field or a truth value, where one may be."""
    rows: list[list[float]] = []
    for n, line in lines:
        with located(f"{path}: line {n}"):
            # A comma with a space behind it is one separator, as NumPy writes it.
            words = [word.strip() for word in line.split(",")] if "," in line else line.split()
            if len(words) != width:
                raise InputError(f"{len(words)} values, expected {width}", code=Code.WRONG_SHAPE)
            rows.append([_number(word, may_miss=may_miss) for word in words])
    return np.array(rows, dtype=np.float64)


def _number(word: str, *, may_miss: bool) -> float:
    if may_miss and word.lower() in {"", "nan", "true", "false"}:
        return float("nan")
    return number(word, "value")


def _source(robot: Path, seen: Path) -> str:
    return f"poses over time in {robot.name} and {seen.name}"


ETHZ = Importer(
    "ethz",
    "two files like poses_B_H.csv and poses_W_E.csv of ethz-asl",
    lambda p: _pair(p, _ETHZ) is not None,
    _read_ethz,
)
KINHEC = Importer(
    "kinhec",
    "two files like a_robot.csv and a_camera.csv of KinHEC",
    lambda p: _pair(p, _KINHEC) is not None,
    _read_kinhec,
)
TUM = Importer("tum", "two files like a_robot.tum and a_camera.tum", _is_tum, _read_tum)
