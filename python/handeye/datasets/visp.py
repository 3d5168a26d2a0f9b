"""Poses as the hand-eye tutorials of ViSP write them: two files for each picture.

::

    pose_rPe_1.yaml, ...    T_base_flange      rows: 6, cols: 1, data: x, y, z in metres, theta u in radians
    pose_cPo_1.yaml, ...    T_camera_target    (pose_fPe_1.yaml instead of pose_rPe_1.yaml in newer versions)

Source: ViSP, `vpPoseVector::saveYAML` and "Tutorial: Camera extrinsic calibration". Without `pose_cPo` the
pictures are read as any pictures with one file of poses each.
"""

import re
from pathlib import Path

from handeye.codes import Code
from handeye.datasets.image_set import ImportOptions
from handeye.datasets.importer import Importer
from handeye.datasets.plausibility import pose_warnings
from handeye.datasets.pose_files import read_pose_rows
from handeye.datasets.pose_pairs import PosePair, PosePairs
from handeye.datasets.pose_rows import Reading
from handeye.datasets.reading import file_names
from handeye.errors import InputError
from handeye.notations import NOTATIONS, Unit
from handeye.types import Mounting, Pose

_FILE = re.compile(r"pose_([rf]Pe|cPo)_(\d{1,9})\.yaml")
_READING = Reading(NOTATIONS["rotation_vector"], Unit.M)


def recognises(folder: Path) -> bool:
    """Tell whether a folder has poses of robot and target."""
    try:
        return len(_files(folder)[1]) > 0 < len(_files(folder)[0])
    except InputError:
        return False


def read(folder: Path, options: ImportOptions) -> PosePairs:
    """Read a folder of poses.

    Raises
    ------
    InputError
        A file that is no pose, or no number with both poses.
    """
    robot, target = _files(folder)
    both = sorted(robot.keys() & target.keys())
    pairs = tuple(
        PosePair(f"pose_{k:02d}", _pose(folder / robot[k]), _pose(folder / target[k])) for k in both
    )
    return PosePairs(
        name=folder.resolve().name,
        layout=IMPORTER.name,
        mounting=options.mounting or Mounting.EYE_IN_HAND,
        pairs=pairs,
        source=f"poses of ViSP in folder {folder.resolve().name}",
        warnings=tuple(pose_warnings((pair.name, pair.T_base_flange) for pair in pairs)),
    )


def _files(folder: Path) -> tuple[dict[int, str], dict[int, str]]:
    """Return the files of the robot's poses and of the target's, by their numbers."""
    if not folder.is_dir():
        return {}, {}
    found: tuple[dict[int, str], dict[int, str]] = ({}, {})
    for name in file_names(folder):
        match = _FILE.fullmatch(name)
        if match:
            found[match.group(1) == "cPo"][int(match.group(2))] = name
    return found


def _pose(path: Path) -> Pose:
    rows = read_pose_rows(path)
    if len(rows) != 1:
        raise InputError(f"{path}: {len(rows)} poses, expected one", code=Code.WRONG_SHAPE)
    return rows.poses(_READING)[0]


IMPORTER = Importer("visp", "a folder with pose_rPe_1.yaml and pose_cPo_1.yaml of ViSP", recognises, read)
