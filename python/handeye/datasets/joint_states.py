"""Joint positions in place of poses: the joint states that MoveIt Calibration saves.

::

    joint_names: [shoulder_pan_joint, ...]
    joint_values: [[0.1, -1.2, ...], ...]         radians (metres for sliding joints), one list a sample

Source: moveit_calibration, `handeye_control_widget.cpp`. The arm's description turns them into poses.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol, cast

import numpy as np

from handeye.codes import Code
from handeye.datasets.documents import SUFFIXES, read_document_file
from handeye.datasets.pose_rows import PoseRows, Statement
from handeye.errors import InputError
from handeye.notations import NOTATIONS, Direction, Unit
from handeye.types.arrays import FloatArray

MAX_JOINTS, MAX_ROWS = 100, 100_000
_KEYS = frozenset({"joint_names", "joint_values"})


class Forward(Protocol):
    """An arm as far as it turns joint positions into poses."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, base first."""
        ...

    def forward(self, joints: FloatArray) -> FloatArray:
        """(N, 4, 4) `T_base_flange` at joint positions (N, n)."""
        ...


def read_joint_rows(path: Path, arm: Forward | None) -> PoseRows | None:
    """Read joint states as rows of matrices; None where the file is none of joint states.

    Raises
    ------
    InputError
        No arm to turn them into poses, joints that it does not have, or a sample of another length.
    """
    if path.suffix.lower() not in SUFFIXES:
        return None
    try:
        document = read_document_file(path)
    except InputError:
        return None
    table: Mapping[str, object] = (
        cast("Mapping[str, object]", document) if isinstance(document, Mapping) else {}
    )
    if not set(table) >= _KEYS:
        return None
    if arm is None:
        raise InputError(
            f"{path}: joint positions in place of poses",
            code=Code.UNKNOWN_ARM,
            hint="name the arm or its URDF with --robot",
        )
    names, samples = _list(table, "joint_names", path), _list(table, "joint_values", path)
    missing = [name for name in arm.joint_names if name not in names]
    if missing:
        raise InputError(
            f"{path}: joints {', '.join(map(str, names))[:200]}, expected {', '.join(arm.joint_names)}",
            code=Code.WRONG_ARM,
            hint="give the description of this robot with --robot",
        )
    values = np.array([_numbers(row, len(names), f"{path}: sample {k}") for k, row in enumerate(samples, 1)])
    joints = values[:, [names.index(name) for name in arm.joint_names]]
    return PoseRows(
        path,
        ("",) * len(joints),
        np.asarray(arm.forward(joints), dtype=np.float64).reshape(-1, 16),
        tuple(f"sample {k}" for k in range(1, len(joints) + 1)),
        stated=Statement(NOTATIONS["matrix"], Unit.M, Direction.FLANGE_IN_BASE),
        joints=joints,
    )


def _list(table: Mapping[str, object], key: str, path: Path) -> list[object]:
    items = table[key]
    found = cast("list[object]", items) if isinstance(items, list) else []
    if not 0 < len(found) <= (MAX_JOINTS if key == "joint_names" else MAX_ROWS):
        raise InputError(f"{path}: {key}: expected a list", code=Code.INVALID_FIELD)
    return found


def _numbers(row: object, count: int, where: str) -> list[float]:
    items = cast("list[object]", row) if isinstance(row, list) else []
    try:
        values = [float(cast("str", item)) for item in items]
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: {str(error)[:80]}", code=Code.NOT_NUMBERS) from error
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(
            f"{where}: {len(values)} values, expected {count} finite ones", code=Code.WRONG_SHAPE
        )
    return values
