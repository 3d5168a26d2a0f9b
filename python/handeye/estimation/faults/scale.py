"""How large the target is by the robot's motions, whatever it is said to be."""

import numpy as np

from handeye.estimation.faults.consensus import nearest_rotations
from handeye.estimation.faults.stations import inverted, twists
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.target import Target


def reach_of(measurements: Measurements) -> float:
    """Median distance of the flange from the base in metres."""
    return float(np.median([np.linalg.norm(view.T_base_flange.translation) for view in measurements.views]))


def pitch_of(target: Target) -> float:
    """Distance between the first two points of a target in metres."""
    return float(np.linalg.norm(target.points[1] - target.points[0]))


def scale_of(measurements: Measurements) -> float | None:
    """Find the factor on the target's size that fits the robot's translations best, from rotations alone.

    ``s t_C = R_X R_A t_Y + R_X t_A + t_X`` is linear in t_X, t_Y and s once R_X is known. None where the
    views do not tell.
    """
    count = len(measurements)
    motions, poses = measurements.motions, measurements.camera_poses
    rotation = _common_rotation(motions, poses)
    turned = rotation @ motions[:, :3, :3]
    lengths = -poses[:, :3, 3]
    moved = -(motions[:, :3, 3] @ rotation.T)
    size = max(float(np.linalg.norm(lengths, axis=1).mean()), 1e-12)
    system = np.concatenate(
        [np.broadcast_to(np.eye(3), turned.shape), turned, lengths[:, :, np.newaxis] / size], axis=2
    )
    kept = np.arange(count)
    scale: float | None = None
    for _ in range(3):
        rows, right = system[kept].reshape(-1, 7), moved[kept].reshape(-1)
        normal = rows.T @ rows
        if len(kept) < 3 or np.linalg.cond(normal) > 1e10:
            return None
        answer = np.linalg.solve(normal, rows.T @ right)
        scale = float(answer[6]) / size
        # Again without the views that fit worst: one may be bad.
        misfit = np.linalg.norm(system @ answer - moved, axis=1)
        kept = np.argsort(misfit)[: max(4, int(np.ceil(0.7 * count)))]
    return scale if scale is not None and scale > 0 else None


def _common_rotation(motions: FloatArray, poses: FloatArray) -> FloatArray:
    """(3, 3) rotation of X that most pairs of views agree on, whatever their translations."""
    first, second = np.triu_indices(len(poses), 1)
    alpha = twists(motions[first] @ inverted(motions[second]))[:, 3:]
    beta = twists(poses[first] @ inverted(poses[second]))[:, 3:]
    # Axes of motions of equal angle; others belong to a bad view.
    gap = np.abs(np.linalg.norm(alpha, axis=1) - np.linalg.norm(beta, axis=1))
    good = gap <= max(float(np.median(gap)) * 2, 1e-3)
    return nearest_rotations((beta[good].T @ alpha[good])[np.newaxis])[0]
