"""Files of robot poses, of any kind: rows first, poses once it is said how they are written."""

import os
from dataclasses import dataclass
from pathlib import Path

from handeye.codes import Code
from handeye.datasets.documents import SUFFIXES
from handeye.datasets.plausibility import DataWarning, pose_warnings
from handeye.datasets.pose_documents import read_pose_document
from handeye.datasets.pose_rows import QUATERNION, PoseRows, Reading, Statement
from handeye.datasets.pose_text import read_pose_text_file
from handeye.errors import InputError
from handeye.notations import NOTATIONS, Notation, Unit
from handeye.types import Pose


@dataclass(frozen=True)
class PoseTable:
    """Robot poses with names.

    Attributes
    ----------
    names
        Name of each pose; where the file gives none, its place, such as ``line 4``.
    poses
        `T_base_flange` of each.
    warnings
        Values that are possible but hardly meant.

    Examples
    --------
    >>> table = PoseTable(("home",), (Pose.identity(),))
    >>> dict(zip(table.names, table.poses))["home"].translation
    array([0., 0., 0.])
    """

    names: tuple[str, ...]
    poses: tuple[Pose, ...]
    warnings: tuple[DataWarning, ...] = ()

    def __len__(self) -> int:
        return len(self.poses)


def read_pose_rows(path: str | os.PathLike[str]) -> PoseRows:
    r"""Read the rows of a CSV, text, JSON, YAML or FileStorage file.

    Raises
    ------
    InputError
        Not such a file, or no poses in it.

    Examples
    --------
    >>> _ = Path("poses.csv").write_text("x,y,z,qx,qy,qz,qw\n0.4,0,0.5,0,0,0,1\n")
    >>> read_pose_rows("poses.csv").labels
    ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
    """
    file = Path(path)
    return (read_pose_document if file.suffix.lower() in SUFFIXES else read_pose_text_file)(file)


def read_poses(path: str | os.PathLike[str], stated: Statement | None = None) -> PoseTable:
    r"""Read poses where no pictures can tell how they are written, such as candidates for the next view.

    Where nothing is stated only our own ways are read: the columns x, y, z, qx, qy, qz, qw or matrices of 16
    numbers by rows, both in metres.

    Parameters
    ----------
    path
        The file.
    stated
        How the poses are written; None for our own ways.

    Raises
    ------
    InputError
        Not such a file, no pose in it, a pose that is not rigid, or it is not said how the poses are written.

    Examples
    --------
    >>> _ = Path("poses.csv").write_text("x,y,z,qx,qy,qz,qw\n0.4,0,0.5,0,0,0,1\n")
    >>> read_poses("poses.csv").poses[0].translation  # metres
    array([0.4, 0. , 0.5])
    """
    rows = read_pose_rows(path)
    readings = rows.readings(stated)
    reading = readings[0]
    if len(readings) > 1:
        said = (stated or Statement()).over(rows.stated)
        own = _own(rows)
        if own is None or said.notation not in {None, own}:
            raise InputError(
                f"{path}: {rows.places[0]}: {rows.values.shape[1]} numbers, and nothing says how the poses "
                "are written; expected the header x,y,z,qx,qy,qz,qw, or 16 numbers a line",
                code=Code.NOTATION_UNSTATED,
                hint="say it with --notation and --unit; docs/conventions.md has the table of notations",
            )
        reading = Reading(own, said.unit or Unit.M, said.direction or reading.direction)
    poses = rows.poses(reading)
    names = tuple(name or place for name, place in zip(rows.names, rows.places, strict=True))
    return PoseTable(names, poses, tuple(pose_warnings(zip(names, poses, strict=True))))


def _own(rows: PoseRows) -> Notation | None:
    if rows.labels[-4:] == QUATERNION:
        return NOTATIONS["quaternion_xyzw"]
    return NOTATIONS["matrix"] if rows.values.shape[1] == 16 and not rows.labels else None
