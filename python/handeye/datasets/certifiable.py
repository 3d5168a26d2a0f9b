"""Pairs of poses as the certifiable calibration of Wise et al. (arXiv 2507.23045) reads them.

::

    tag_0_cam_1_A.csv      qw, qx, qy, qz, x, y, z      the hand in the base, metres
    tag_0_cam_1_B.csv      one line each for one of A   the tag in the camera

with ``A X = Y B``, X of the tag and Y of the camera (utiasSTARS/certifiable-rwhe-calibration,
`experiments/rw_multi_eye_multi_hand.jl`): the tag moves with the hand, the camera stands. For a camera in the
hand A is the base in the hand.
"""

import re
from pathlib import Path

from handeye.codes import Code
from handeye.datasets.image_set import ImportOptions
from handeye.datasets.importer import Importer
from handeye.datasets.plausibility import DataWarning, pose_warnings
from handeye.datasets.pose_pairs import PosePairs, numbered
from handeye.datasets.reading import MIB, file_names, is_file, located, number, read_text
from handeye.errors import InputError
from handeye.notations import NOTATIONS, Unit
from handeye.types import Mounting, Pose

MAX_BYTES = 16 * MIB
_FILE = re.compile(r"tag_(\d{1,9})_cam_(\d{1,9})_([AB])\.csv")


def recognises(path: Path) -> bool:
    """Tell whether it is such a file, or a folder with some."""
    try:
        return bool(_pairs(path))
    except InputError:
        return False


def read(path: Path, options: ImportOptions) -> PosePairs:
    """Read the poses of one tag and one camera.

    Raises
    ------
    InputError
        Several tags or cameras, files of different lengths, or a line that is no pose.
    """
    pairs = _pairs(path)
    if len(pairs) != 1:
        raise InputError(
            f"{path}: {', '.join(sorted(pairs)[:20]) or 'no tag'}, expected one tag and one camera",
            code=Code.AMBIGUOUS_FORMAT,
            hint="give one file, such as tag_0_cam_1_A.csv; all cameras at once need a recording",
        )
    ((name, (first, second)),) = pairs.items()
    hand, seen = _poses(first), _poses(second)
    if len(hand) != len(seen):
        raise InputError(
            f"{first}: {len(hand)} poses, {second.name} has {len(seen)}", code=Code.COUNTS_DIFFER
        )
    mounting = options.mounting or Mounting.EYE_TO_HAND
    base_flange = hand if mounting is Mounting.EYE_TO_HAND else [pose.inverse() for pose in hand]
    stations = numbered(list(zip(base_flange, seen, strict=True)))
    warnings = pose_warnings((pair.name, pair.T_base_flange) for pair in stations)
    if options.mounting is None:
        said = "the poses do not say where the camera sits: taken to stand beside the robot (--mounting)"
        warnings.insert(0, DataWarning("mounting_assumed", said))
    return PosePairs(name, IMPORTER.name, mounting, stations, f"pairs of poses, {name}", tuple(warnings))


def _pairs(path: Path) -> dict[str, tuple[Path, Path]]:
    """Return the two files of every tag and camera, by their names."""
    alone = _FILE.fullmatch(path.name) if is_file(path) else None
    folder = path.parent if alone else path
    if not folder.is_dir():
        return {}
    found = [m for name in file_names(folder) if (m := _FILE.fullmatch(name))]
    files = {m.groups(): folder / m.group() for m in found}
    return {
        f"tag_{tag}_cam_{camera}": (a, files[tag, camera, "B"])
        for (tag, camera, part), a in files.items()
        if part == "A"
        and (tag, camera, "B") in files
        and (alone is None or alone.groups()[:2] == (tag, camera))
    }


def _poses(path: Path) -> list[Pose]:
    poses: list[Pose] = []
    for n, line in enumerate(read_text(path, MAX_BYTES).splitlines(), start=1):
        if line.strip():
            with located(f"{path}: line {n}"):
                values = [number(word, "value") for word in line.split(",")]
                poses.append(NOTATIONS["wxyz_position"].pose(values, Unit.M))
    return poses


IMPORTER = Importer("certifiable", "tag_0_cam_0_A.csv and tag_0_cam_0_B.csv of Wise et al.", recognises, read)
