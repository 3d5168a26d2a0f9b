"""The samples of MoveIt Calibration: what its widget saves, and the list of pairs in its tests.

::

    - effector_wrt_world: [16 numbers by rows]      T_base_flange, metres
      object_wrt_sensor:  [16 numbers by rows]      T_camera_target

or JSON, ``[[T_base_flange, T_camera_target], ...]`` with 4 x 4 lists. Source: moveit_calibration,
`handeye_control_widget.cpp` and `test/pose_samples.json`. The mounting is not in the files.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import cast

from handeye.codes import Code
from handeye.datasets.documents import SUFFIXES, read_document_file
from handeye.datasets.image_set import ImportOptions
from handeye.datasets.importer import Importer
from handeye.datasets.plausibility import DataWarning, pose_warnings
from handeye.datasets.pose_pairs import PosePairs, numbered
from handeye.datasets.reading import is_file, located
from handeye.errors import InputError
from handeye.notations import NOTATIONS
from handeye.types import Mounting, Pose

_KEYS = ("effector_wrt_world", "object_wrt_sensor")


def recognises(path: Path) -> bool:
    """Tell whether it is a file of samples, by its first entry."""
    if path.suffix.lower() not in SUFFIXES or not is_file(path):
        return False
    try:
        return _pair(_first(read_document_file(path))) is not None
    except InputError:
        return False


def read(path: Path, options: ImportOptions) -> PosePairs:
    """Read a file of samples.

    Raises
    ------
    InputError
        Not such a file, or a matrix that is not rigid; the message names the sample.
    """
    document = read_document_file(path)
    entries = cast("list[object]", document) if isinstance(document, list) else []
    poses: list[tuple[Pose, Pose]] = []
    for index, entry in enumerate(entries, start=1):
        pair = _pair(entry)
        with located(f"{path}: sample {index}"):
            if pair is None:
                raise InputError(f"expected {' and '.join(_KEYS)}", code=Code.INVALID_FIELD)
            poses.append((_pose(pair[0]), _pose(pair[1])))
    pairs = numbered(poses)
    warnings = pose_warnings((pair.name, pair.T_base_flange) for pair in pairs)
    if options.mounting is None:
        message = "the samples do not say where the camera sits: taken to be in the hand (--mounting)"
        warnings.insert(0, DataWarning("mounting_assumed", message))
    return PosePairs(
        name=path.stem,
        layout=IMPORTER.name,
        mounting=options.mounting or Mounting.EYE_IN_HAND,
        pairs=pairs,
        source=f"samples of MoveIt Calibration, {path.name}",
        warnings=tuple(warnings),
    )


def _first(document: object) -> object:
    entries = cast("list[object]", document) if isinstance(document, list) else []
    return entries[0] if entries else None


def _pair(entry: object) -> tuple[object, object] | None:
    """Return the two matrices of a sample; None if it is none."""
    if isinstance(entry, Mapping):
        table = cast("Mapping[str, object]", entry)
        return (table[_KEYS[0]], table[_KEYS[1]]) if set(_KEYS) <= set(table) else None
    pair = cast("list[object]", entry) if isinstance(entry, list) else []
    nested = len(pair) == 2 and all(isinstance(m, list) and len(cast("list[object]", m)) == 4 for m in pair)
    return (pair[0], pair[1]) if nested else None


def _pose(item: object) -> Pose:
    rows = cast("list[object]", item) if isinstance(item, list) else []
    flat = [v for row in rows for v in (cast("list[object]", row) if isinstance(row, list) else [row])]
    try:
        numbers = [float(cast("str", value)) for value in flat]
    except (TypeError, ValueError) as error:
        raise InputError(f"a matrix with {str(error)[:80]}", code=Code.NOT_NUMBERS) from error
    if len(numbers) != 16:
        raise InputError(f"a matrix of {len(numbers)} numbers, expected 16", code=Code.WRONG_SHAPE)
    return NOTATIONS["matrix"].pose(numbers)


IMPORTER = Importer("moveit_samples", "a file of samples of MoveIt Calibration", recognises, read)
