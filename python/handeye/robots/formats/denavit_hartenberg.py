"""Tables of Denavit and Hartenberg: the standard one (1955) and the modified one (Craig 1986).

Standard: ``T_i = Rz(theta + q) Tz(d) Tx(a) Rx(alpha)``; modified:
``T_i = Rx(alpha) Tx(a) Rz(theta + q) Tz(d)``, with q added to d where a joint slides. Base and flange, which
no table holds, are transforms of their own. Axes that are nearly parallel, as those of real arms are, meet
far away: d is large there, and the table is exact all the same.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from handeye.robots.formats.base import ArmFormat, CorrectedArm, commented, with_z_axes
from handeye.robots.model import Arm
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose

# Axes that are turned against each other by less are parallel: they would meet beyond any use of a number.
_PARALLEL_RAD = 1e-8
_HEAD = "joint,a_m,alpha_rad,d_m,theta_rad,slides"


@dataclass(frozen=True, eq=False)
class Table:
    """Rows (n, 4) of a, alpha, d, theta, and the transforms before the first and behind the last."""

    rows: FloatArray
    T_base_first: Pose
    T_last_flange: Pose


def standard_table(arm: Arm) -> Table:
    """Return the standard table of an arm."""
    placed = with_z_axes(arm)
    frames = _frames(placed)
    end = frames[-1]
    return Table(
        np.array([_standard(before, after) for before, after in pairwise(frames)]),
        Pose(frames[0]),
        Pose(np.linalg.inv(end)) @ _flange_at_zero(placed),
    )


def modified_table(arm: Arm) -> Table:
    """Return the modified table of an arm."""
    placed = with_z_axes(arm)
    # Frame i of the modified table lies on axis i, where that of the standard table lies on axis i + 1.
    frames = _frames(placed)
    on_axes = [*frames[:-1]]
    for i, frame in enumerate(frames[1:-1]):
        on_axes[i] = _on_axis(frames[i], frame)
    first = frames[0]
    rows = [_modified(before, after) for before, after in pairwise([first, *on_axes])]
    return Table(np.array(rows), Pose(first), Pose(np.linalg.inv(on_axes[-1])) @ _flange_at_zero(placed))


def _flange_at_zero(arm: Arm) -> Pose:
    pose = Pose.identity()
    for joint in arm.joints:
        pose = pose @ joint.placement
    return pose @ arm.T_last_flange


def _frames(arm: Arm) -> list[FloatArray]:
    """Frames (4, 4) at zero of a standard table: z along each axis in turn, x along the common normals.

    The first is that of the first joint, the last, behind the last joint, the same as the one before it.
    """
    axes: list[FloatArray] = []
    pose = Pose.identity()
    for joint in arm.joints:
        pose = pose @ joint.placement
        axes.append(pose.matrix)
    frames = [axes[0]]
    for axis in axes[1:]:
        frames.append(_next(frames[-1], axis))
    frames.append(frames[-1])
    return frames


def _next(before: FloatArray, axis: FloatArray) -> FloatArray:
    """Frame on the next axis, where the common normal from the z axis of the one before meets it."""
    z, there = before[:3, 2], axis[:3, 2]
    apart = axis[:3, 3] - before[:3, 3]
    normal = np.cross(z, there)
    sine = float(np.linalg.norm(normal))
    if sine < _PARALLEL_RAD:
        across = apart - (apart @ z) * z
        length = float(np.linalg.norm(across))
        x = across / length if length > 0 else before[:3, 0]
        origin = before[:3, 3] + across if length > 0 else before[:3, 3]
        # On the axis itself, at the height of the frame before.
        origin = axis[:3, 3] + ((origin - axis[:3, 3]) @ there) * there
    else:
        x = normal / sine
        along = float(np.cross(apart, z) @ normal) / sine**2
        origin = axis[:3, 3] + along * there
    x = x - (x @ there) * there
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([x, np.cross(there, x), there])
    frame[:3, 3] = origin
    return frame


def _on_axis(before: FloatArray, after: FloatArray) -> FloatArray:
    """Frame on the z axis of the one before, where the common normal to the next begins, x along it."""
    z, x = before[:3, 2], after[:3, 0]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    frame[:3, 3] = before[:3, 3] + ((after[:3, 3] - before[:3, 3]) @ z) * z
    return frame


def _standard(before: FloatArray, after: FloatArray) -> list[float]:
    """a, alpha, d, theta of ``before^-1 after = Rz(theta) Tz(d) Tx(a) Rx(alpha)``."""
    T = np.linalg.inv(before) @ after
    theta = float(np.arctan2(T[1, 0], T[0, 0]))
    alpha = float(np.arctan2(T[2, 1], T[2, 2]))
    return [float(np.cos(theta) * T[0, 3] + np.sin(theta) * T[1, 3]), alpha, float(T[2, 3]), theta]


def _modified(before: FloatArray, after: FloatArray) -> list[float]:
    """a, alpha, d, theta of ``before^-1 after = Rx(alpha) Tx(a) Rz(theta) Tz(d)``."""
    T = np.linalg.inv(before) @ after
    alpha = float(np.arctan2(-T[1, 2], T[2, 2]))
    theta = float(np.arctan2(-T[0, 1], T[0, 0]))
    d = float(-np.sin(alpha) * T[1, 3] + np.cos(alpha) * T[2, 3])
    return [float(T[0, 3]), alpha, d, theta]


def _text(table: Table, arm: CorrectedArm, how: str) -> str:
    lines = [_HEAD]
    for joint, row in zip(arm.described.joints, table.rows, strict=True):
        name = "".join(c for c in joint.name if c.isprintable() and c not in ',"')
        lines.append(",".join([name, *(repr(float(value)) for value in row), "01"[joint.sliding]]))
    notes = [*arm.notes, how]
    for what, pose in (("base to first", table.T_base_first), ("last to flange", table.T_last_flange)):
        numbers = " ".join(repr(float(value)) for value in pose.matrix[:3].ravel())
        notes.append(f"{what}, three rows of four: {numbers}")
    return commented(tuple(notes), "#") + "\n".join(lines) + "\n"


def _write_standard(arm: CorrectedArm) -> str:
    return _text(standard_table(arm.built), arm, "T = Rz(theta + q) Tz(d) Tx(a) Rx(alpha)")


def _write_modified(arm: CorrectedArm) -> str:
    return _text(modified_table(arm.built), arm, "T = Rx(alpha) Tx(a) Rz(theta + q) Tz(d)")


FORMATS = (
    ArmFormat("dh", "table of Denavit and Hartenberg", whole=True, text=_write_standard),
    ArmFormat("dh_modified", "modified table of Denavit and Hartenberg", whole=True, text=_write_modified),
)
