"""Robot poses from a CSV file, such as candidates for the next view.

Either a header with the columns ``x,y,z,qx,qy,qz,qw`` (any order, optionally `name`): metres and a unit
quaternion; or no header and 16 numbers a line: `T_base_flange` by rows. Lines that are empty or begin with #
are skipped.
"""

import os
from dataclasses import dataclass
from pathlib import Path

from handeye.datasets.plausibility import DataWarning, pose_warnings
from handeye.datasets.reading import MIB, located, number, read_text
from handeye.errors import InputError
from handeye.types import Pose

COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw")
MAX_BYTES = 64 * MIB
MAX_POSES = 1_000_000
MAX_NAME_LENGTH = 200
_EXPECTED = "expected the header x,y,z,qx,qy,qz,qw, or 16 numbers a line"


@dataclass(frozen=True)
class PoseTable:
    """Robot poses with names.

    Attributes
    ----------
    names
        Name of each pose; where the file gives none, ``line N``.
    poses
        `T_base_flange` of each.
    warnings
        Values that are possible but hardly meant.
    """

    names: tuple[str, ...]
    poses: tuple[Pose, ...]
    warnings: tuple[DataWarning, ...] = ()

    def __len__(self) -> int:
        return len(self.poses)


def read_poses_csv(path: str | os.PathLike[str]) -> PoseTable:
    """Read a file of poses.

    Raises
    ------
    InputError
        Not such a file, no pose in it, or a pose that is not rigid; the message names the line.
    """
    file = Path(path)
    rows = _rows(read_text(file, MAX_BYTES))
    if not rows:
        raise InputError(f"{file}: no poses, {_EXPECTED}", code="no_poses")
    if len(rows) > MAX_POSES:
        raise InputError(f"{file}: more than {MAX_POSES} lines", code="too_large")
    first = [field.lower() for field in rows[0][1]]
    if set(COLUMNS) <= set(first):
        named = _with_header(file, first, rows[1:])
    elif len(first) == 16:
        named = _matrices(file, rows)
    else:
        found = ",".join(rows[0][1])[:60]
        raise InputError(f"{file}: line {rows[0][0]}: {found!r}, {_EXPECTED}", code="wrong_shape")
    if not named:
        raise InputError(f"{file}: no poses after the header", code="no_poses")
    names, poses = zip(*named, strict=True)
    return PoseTable(names, poses, tuple(pose_warnings(named)))


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """Return line numbers and fields."""
    return [
        (index, [field.strip().strip('"') for field in line.replace(";", ",").replace("\t", ",").split(",")])
        for index, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]


def _with_header(file: Path, header: list[str], rows: list[tuple[int, list[str]]]) -> list[tuple[str, Pose]]:
    unknown = [column[:40] for column in header if column not in {*COLUMNS, "name"}]
    if unknown or len(set(header)) < len(header):
        raise InputError(
            f"{file}: columns {', '.join(column[:40] for column in header)}, expected each of "
            f"{', '.join(COLUMNS)} once and perhaps name",
            code="invalid_field",
        )
    named: list[tuple[str, Pose]] = []
    for index, fields in rows:
        where = f"{file}: line {index}"
        if len(fields) != len(header):
            raise InputError(f"{where}: {len(fields)} values, expected {len(header)}", code="wrong_shape")
        row = dict(zip(header, fields, strict=True))
        values = [number(row[column], f"{where}: {column}") for column in COLUMNS]
        with located(where):
            named.append((row.get("name", "")[:MAX_NAME_LENGTH] or f"line {index}", _pose(values)))
    return named


def _pose(values: list[float]) -> Pose:
    return Pose.from_quaternion(values[:3], values[3:])


def _matrices(file: Path, rows: list[tuple[int, list[str]]]) -> list[tuple[str, Pose]]:
    named: list[tuple[str, Pose]] = []
    for index, fields in rows:
        where = f"{file}: line {index}"
        if len(fields) != 16:
            raise InputError(f"{where}: {len(fields)} values, expected 16", code="wrong_shape")
        values = [number(field, where) for field in fields]
        with located(where):
            named.append((f"line {index}", Pose([values[i : i + 4] for i in range(0, 16, 4)])))
    return named
