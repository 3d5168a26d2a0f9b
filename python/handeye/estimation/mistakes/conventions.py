"""Mistakes of all views at once: poses in another direction, unit or convention than they were taken for.

Each is a reading: a change of all robot poses, or of the size of the target, under which the views would
agree. The congruence of screws between pairs of views is blind to the direction, as a motion and its
conjugates share angle and translation; so every reading is tried by solving, and the evidence decides.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.errors import InputError
from handeye.estimation.mistakes.consensus import nearest_rotations
from handeye.estimation.mistakes.sightings import Sightings, inverted, twists
from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose
from handeye.types.recording import Recording
from handeye.types.target import Target
from handeye.types.view import View

MM_PER_M = 1000.0
# Lengths that are taken for metres by mistake.
UNITS_M = {
    "millimetres": 1e-3,
    "centimetres": 1e-2,
    "decimetres": 1e-1,
    "inches": 0.0254,
    "feet": 0.3048,
    "kilometres": 1e3,
}
# A factor this near to that of a unit may be that unit; nearer to one than this it is no mistake of units.
UNIT_RANGE = 1.6
SMALLEST_SCALE_ERROR = 0.05
# Usual sizes: median distance of the flange from the base, and between neighbouring points of a target.
USUAL_REACH_M = (0.05, 10.0)
USUAL_PITCH_M = (1e-3, 0.6)


@dataclass(frozen=True)
class Reading:
    """Another way to understand the robot poses of all views.

    Parameters
    ----------
    code
        Code of the finding.
    name
        Name for `repaired`.
    sentence
        What was probably done.
    poses
        From the poses (K, 4, 4) `T_base_flange` as given to those that were meant.
    """

    code: str
    name: str
    sentence: str
    poses: Callable[[FloatArray], FloatArray]


def _inverse(poses: FloatArray) -> FloatArray:
    return inverted(poses)


def _transposed(poses: FloatArray) -> FloatArray:
    return _with_rotations(poses, np.swapaxes(poses[:, :3, :3], 1, 2))


def _scalar_first(poses: FloatArray) -> FloatArray:
    """Undo a quaternion w, x, y, z that was read as x, y, z, w."""
    return _requaternioned(poses, [1, 2, 3, 0])


def _scalar_last(poses: FloatArray) -> FloatArray:
    """Undo a quaternion x, y, z, w that was read as w, x, y, z."""
    return _requaternioned(poses, [3, 0, 1, 2])


def _degrees(poses: FloatArray) -> FloatArray:
    """Undo rotation vectors in radians that were read as degrees."""
    twist = twists(poses)[:, 3:] * (180 / np.pi)
    turned = _core.se3_exp(np.concatenate([np.zeros_like(twist), twist], axis=1))
    return _with_rotations(poses, turned[:, :3, :3])


def _fixed_to_moving(poses: FloatArray) -> FloatArray:
    """Undo angles about the moving x, y, z axes that were read as about the fixed x, y, z axes."""
    return _with_rotations(poses, _about_moving(_fixed_angles(poses[:, :3, :3])))


def _moving_to_fixed(poses: FloatArray) -> FloatArray:
    """Undo angles about the fixed x, y, z axes that were read as about the moving x, y, z axes."""
    # Rz Ry Rx of the angles, which about moving axes are those of the transpose with the signs changed.
    angles = -_fixed_angles(np.swapaxes(poses[:, :3, :3], 1, 2))
    return _with_rotations(poses, np.swapaxes(_about_moving(-angles), 1, 2))


READINGS = (
    Reading(
        "wrong_direction",
        "inverse",
        "the robot poses are those of the base in the flange (T_flange_base) where T_base_flange is expected",
        _inverse,
    ),
    Reading("wrong_rotation", "transposed", "the rotations of the robot poses are transposed", _transposed),
    Reading(
        "wrong_rotation",
        "scalar_first",
        "the robot's quaternions are in the order w, x, y, z and were read as x, y, z, w",
        _scalar_first,
    ),
    Reading(
        "wrong_rotation",
        "scalar_last",
        "the robot's quaternions are in the order x, y, z, w and were read as w, x, y, z",
        _scalar_last,
    ),
    Reading(
        "wrong_unit",
        "radians",
        "the robot's rotation vectors are in radians and were read as degrees",
        _degrees,
    ),
    Reading(
        "wrong_rotation",
        "moving_axes",
        "the robot's angles are about moving x, y, z axes and were read as about fixed ones",
        _fixed_to_moving,
    ),
    Reading(
        "wrong_rotation",
        "fixed_axes",
        "the robot's angles are about fixed x, y, z axes and were read as about moving ones",
        _moving_to_fixed,
    ),
)


def read_as(sightings: Sightings, reading: Reading) -> Sightings:
    """Return sightings with the robot poses understood in another way."""
    given = sightings.motions
    flipped = sightings.mounting is Mounting.EYE_IN_HAND
    meant = reading.poses(inverted(given) if flipped else given)
    return sightings.with_motions(inverted(meant) if flipped else meant)


def scale_of(sightings: Sightings, X: FloatArray) -> float | None:
    """Find the factor on the target's size that fits the robot's translations best, from rotations alone.

    ``s t_C = R_X R_A t_Y + R_X t_A + t_X`` is linear in t_X, t_Y and s once R_X is known. None where the
    views do not tell.
    """
    count = len(sightings)
    rotation = X[:3, :3]
    turned = rotation @ sightings.motions[:, :3, :3]
    lengths = -sightings.poses[:, :3, 3]
    moved = -(sightings.motions[:, :3, 3] @ rotation.T)
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


def rotation_consensus(sightings: Sightings) -> FloatArray:
    """X (4, 4) with the rotation that most pairs of views agree on, whatever their translations."""
    first, second = np.triu_indices(len(sightings), 1)
    alpha = twists(sightings.motions[first] @ inverted(sightings.motions[second]))[:, 3:]
    beta = twists(sightings.poses[first] @ inverted(sightings.poses[second]))[:, 3:]
    # Axes of motions of equal angle; others belong to a bad view.
    gap = np.abs(np.linalg.norm(alpha, axis=1) - np.linalg.norm(beta, axis=1))
    good = gap <= max(float(np.median(gap)) * 2, 1e-3)
    X = np.eye(4)
    X[:3, :3] = nearest_rotations((beta[good].T @ alpha[good])[np.newaxis])[0]
    return X


@dataclass(frozen=True)
class Scale:
    """A factor between the lengths of the robot and those of the target.

    Parameters
    ----------
    factor
        By which the target would have to be larger (as the robot's lengths have it).
    blamed
        "robot" or "target".
    unit
        Name of the unit that was taken for metres, None if the factor is no unit's.
    """

    factor: float
    blamed: str
    unit: str | None

    @property
    def sentence(self) -> str:
        """What was probably done."""
        if self.unit is None:
            return (
                f"the lengths of the target are {1 / self.factor:.4g} of what the robot's translations say: "
                "is the pitch of its points right, and the unit of the poses?"
            )
        whose = "translations of the robot poses" if self.blamed == "robot" else "measures of the target"
        return f"the {whose} are in {self.unit} and were taken for metres"


def possible_scales(factor: float, reach_m: float, pitch_m: float) -> list[Scale]:
    """Return what a factor on the target's size may mean: units near it, and itself; nothing near one.

    `reach_m` is how far the flange is from the base and `pitch_m` the distance between neighbouring points,
    as given: whichever is unusual is blamed.
    """
    if abs(math.log(factor)) < math.log1p(SMALLEST_SCALE_ERROR):
        return []
    found: list[Scale] = []
    for unit, metres in UNITS_M.items():
        # Lengths of the robot in millimetres say 1000 where it is 1 m: the target would have to be 1000 times
        # larger.
        for blamed, given, usual, expected in (
            ("robot", reach_m, USUAL_REACH_M, 1 / metres),
            ("target", pitch_m, USUAL_PITCH_M, metres),
        ):
            near = abs(math.log(factor / expected)) < math.log(UNIT_RANGE)
            if near and usual[0] <= given * metres <= usual[1]:
                found.append(Scale(expected, blamed, unit))
    unusual = not USUAL_REACH_M[0] <= reach_m <= USUAL_REACH_M[1]
    return [*found, Scale(factor, "robot" if unusual else "target", None)]


def pitch_of(target: Target) -> float:
    """Distance between the first two points of a target in metres."""
    return float(np.linalg.norm(target.points[1] - target.points[0]))


def repaired(recording: Recording, name: str) -> Recording:
    """Return a recording with all robot poses read in another way; `name` as in the evidence of the finding.

    Raises
    ------
    InputError
        No reading of this name.
    """
    reading = next((r for r in READINGS if r.name == name), None)
    if reading is None:
        raise InputError(f"reading {name!r}, expected one of {', '.join(r.name for r in READINGS)}")
    poses = reading.poses(np.array([view.T_base_flange.matrix for view in recording.views]).reshape(-1, 4, 4))
    views = [
        View(
            view.name,
            Pose(pose),
            view.point_ids,
            view.pixels,
            view.image,
            view.timestamp_s,
            view.joints_rad,
        )
        for view, pose in zip(recording.views, poses, strict=True)
    ]
    return recording.with_views(views)


def _with_rotations(poses: FloatArray, rotations: FloatArray) -> FloatArray:
    changed = poses.copy()
    changed[:, :3, :3] = rotations
    return changed


def _requaternioned(poses: FloatArray, order: list[int]) -> FloatArray:
    changed = poses.copy()
    for i, pose in enumerate(poses):
        quaternion = Pose(pose).quaternion_xyzw[order]
        changed[i, :3, :3] = Pose.from_quaternion([0, 0, 0], quaternion).rotation
    return changed


def _fixed_angles(rotations: FloatArray) -> FloatArray:
    """(K, 3) angles a, b, c of Rz(c) Ry(b) Rx(a)."""
    b = np.arcsin(np.clip(-rotations[:, 2, 0], -1, 1))
    a = np.arctan2(rotations[:, 2, 1], rotations[:, 2, 2])
    c = np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0])
    return np.stack([a, b, c], axis=1)


def _about_moving(angles: FloatArray) -> FloatArray:
    """(K, 3, 3) Rx(a) Ry(b) Rz(c) of angles (K, 3)."""
    twist = np.zeros((3, len(angles), 6))
    for axis in range(3):
        twist[axis, :, 3 + axis] = angles[:, axis]
    x, y, z = (_core.se3_exp(twist[axis])[:, :3, :3] for axis in range(3))
    return x @ y @ z
