"""Mistakes planted in clean recordings, as they are made.

Every kind draws one of its ways to be made; what it is called when found is in `EXPECTED`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import StrEnum

import numpy as np

from handeye.errors import InputError
from handeye.estimation.faults.kinds.mirrored_pictures import flipped
from handeye.estimation.faults.kinds.numbers import Numbers
from handeye.estimation.faults.kinds.sheared_pictures import sheared
from handeye.estimation.faults.kinds.wrong_unit import larger
from handeye.estimation.faults.relabel import reflections, turns
from handeye.notations import NOTATIONS
from handeye.simulation.cells import TARGET, CellOptions, ErrorKind, simulate
from handeye.types import Camera, CircleGrid, Mounting, Pose, Recording, Target, View
from handeye.types.arrays import FloatArray

MM_PER_M = 1000.0


class Mistake(StrEnum):
    """What is planted."""

    FLIP = "flip"
    """The board of one view labelled turned, or mirrored."""
    SWAP = "swap"
    """The images of two views swapped."""
    SHIFT = "shift"
    """The list of images shifted by one, all of it or a few in a row."""
    MOVING = "moving"
    """One view off by what the arm moves meanwhile, in any direction or towards the next view."""
    GROSS_POSE = "gross_pose"
    """One robot pose far off."""
    WRONG_UNIT = "wrong_unit"
    """Robot translations or measures of the target in another unit, or rotations in radians for degrees."""
    WRONG_DIRECTION = "wrong_direction"
    """Robot poses inverted, or the other mounting given."""
    WRONG_ROTATION = "wrong_rotation"
    """Rotations in another notation or order, transposed, with wrong signs, or in a left-handed frame."""
    MIRRORED = "mirrored"
    """Pictures flipped left to right or upside down."""
    BOARD_SIZE = "board_size"
    """The target larger or smaller than stated by 8 to 40 %."""
    CAMERA_SIZE = "camera_size"
    """A camera calibrated for pictures of another size."""
    CROPPED = "cropped"
    """Pictures cut, the camera as before."""
    STRETCHED = "stretched"
    """Pictures resized unequally, the camera as before."""
    DISTORTION = "distortion"
    """Another lens's coefficients."""
    SHEARED = "sheared"
    """Every row of the pictures shifted against the one before."""
    STALE = "stale"
    """Robot poses that were not read again."""
    REPEATED = "repeated"
    """One view there twice."""
    FALSE_POINTS = "false_points"
    """A few points of one view in the wrong place."""
    FEW_ROTATIONS = "few_rotations"
    """Views whose rotations share one axis."""


EXPECTED = {
    Mistake.FLIP: "view_flipped",
    Mistake.SWAP: "view_shuffled",
    Mistake.SHIFT: "view_shuffled",
    Mistake.MOVING: "view_moving",
    Mistake.GROSS_POSE: "gross_pose",
    Mistake.WRONG_UNIT: "wrong_unit",
    Mistake.WRONG_DIRECTION: "wrong_direction",
    Mistake.WRONG_ROTATION: "wrong_rotation",
    Mistake.MIRRORED: "mirrored_pictures",
    Mistake.BOARD_SIZE: "board_size",
    Mistake.CAMERA_SIZE: "camera_other_size",
    Mistake.CROPPED: "pictures_cropped",
    Mistake.STRETCHED: "pictures_stretched",
    Mistake.DISTORTION: "wrong_distortion",
    Mistake.SHEARED: "pictures_sheared",
    Mistake.STALE: "stale_poses",
    Mistake.REPEATED: "view_repeated",
    Mistake.FALSE_POINTS: "points_outlying",
    Mistake.FEW_ROTATIONS: "degenerate",
}
TARGETS: tuple[Target, ...] = (TARGET, CircleGrid(4, 4, 0.06, 0.03))
KINDS = tuple(kind for kind in ErrorKind if kind is not ErrorKind.WRONG_INTRINSICS)
CELL = CellOptions(
    views=(8, 20),
    pixel_sigma_px=(0.05, 0.3),
    translation_sigma_m=(0.02e-3, 1e-3),
    rotation_sigma_deg=(0.002, 0.05),
)
MOVING_MM, MOVING_DEG = (5.0, 15.0), (0.3, 1.5)
GROSS_MM, GROSS_DEG = (40.0, 300.0), (4.0, 40.0)
# Notations as people mix them up: written in the one, read in the other.
MIXED_UP = (
    ("kuka", "ur"),
    ("ur", "kuka"),
    ("rotation_vector_deg", "fanuc"),
    ("fanuc", "rotation_vector_deg"),
    ("kuka", "fanuc"),
    ("fanuc", "kuka"),
    ("doosan", "fanuc"),
    ("staubli", "fanuc"),
    ("fanuc", "ur"),
    ("ur", "fanuc"),
    ("doosan", "kuka"),
    ("staubli", "kuka"),
)


def made_up(number: int, seed: int) -> Recording:
    """Return a clean recording; targets, mountings and errors of the arm take turns."""
    cell = replace(
        CELL,
        target=TARGETS[number % len(TARGETS)],
        mounting=list(Mounting)[number // len(TARGETS) % 2],
    )
    return simulate(KINDS[number // (2 * len(TARGETS)) % len(KINDS)], number, cell, seed=seed)


def can_be_planted(recording: Recording, mistake: Mistake) -> bool:
    """Tell whether a recording can have a mistake."""
    if mistake is Mistake.FEW_ROTATIONS:
        return recording.truth is not None and None not in (recording.truth.X, recording.truth.Y)
    if mistake is Mistake.DISTORTION:
        return recording.camera.lens in {"pinhole", "brown_conrady_5"}
    return True


def plant(recording: Recording, mistake: Mistake, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Plant a mistake; also the names of the views with it, empty if it is in all."""
    return _PLANTERS[mistake](recording, random)


def _flip(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    k = int(random.integers(len(recording)))
    others = [*turns(recording.target)[1:], *reflections(recording.target)]
    view = recording.views[k]
    return _with(recording, k, others[int(random.integers(len(others)))].applied(view)), [view.name]


def _swap(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    views = list(recording.views)
    k = int(random.integers(len(views)))
    other = (k + 1 + int(random.integers(len(views) - 1))) % len(views)
    one, two = views[k], views[other]
    views[k], views[other] = _with_image(one, two), _with_image(two, one)
    return recording.with_views(views), [one.name, two.name]


def _shift(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    views = list(recording.views)
    count = len(views)
    # Most of the list must be right for the rest to be told from it; else it is the whole list.
    length = int(random.integers(3, count // 2)) if random.uniform() < 0.5 and count > 7 else count
    first = int(random.integers(count - length + 1))
    row = views[first : first + length]
    views[first : first + length] = map(_with_image, row, [*row[1:], row[0]])
    return recording.with_views(views), [] if length == count else [v.name for v in row]


def _moving(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    k = int(random.integers(len(recording)))
    view = recording.views[k]
    off = Pose.exp(_moved(recording.views, k, random))
    return _with(recording, k, _at(view, view.T_base_flange @ off)), [view.name]


def _gross_pose(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    k = int(random.integers(len(recording)))
    view = recording.views[k]
    off = Pose.exp(_twist(random, GROSS_MM, GROSS_DEG))
    return _with(recording, k, _at(view, view.T_base_flange @ off)), [view.name]


def _wrong_unit(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Translations of the robot, its rotation vectors, or the target's measures taken for another unit."""
    what = random.uniform()
    if what < 0.25:
        return replace(recording, target=larger(recording.target, MM_PER_M)), []
    if what < 0.5:
        factor = np.deg2rad(1.0) if random.uniform() < 0.5 else np.rad2deg(1.0)
        return recording.with_views(
            _at(v, _turned_more(v.T_base_flange, factor)) for v in recording.views
        ), []
    per_metre = (MM_PER_M, MM_PER_M, 100.0, 1 / 0.0254)[int(random.integers(4))]
    return recording.with_views(_at(v, _in_unit(v.T_base_flange, per_metre)) for v in recording.views), []


def _wrong_direction(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    # Inverted poses, or the camera said to be where it is not: the same numbers for another reason.
    if random.uniform() < 0.5:
        other = next(m for m in Mounting if m is not recording.mounting)
        return replace(recording, mounting=other), []
    return recording.with_views(_at(v, v.T_base_flange.inverse()) for v in recording.views), []


def _wrong_rotation(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    poses = np.array([view.T_base_flange.matrix for view in recording.views])
    what = random.uniform()
    if what < 0.1:
        changed = poses.copy()
        changed[:, :3, :3] = np.swapaxes(poses[:, :3, :3], 1, 2)
    elif what < 0.2:
        changed = _reordered(poses, real_first=bool(random.integers(2)))
    elif what < 0.4:
        given = NOTATIONS[("kuka", "fanuc", "staubli")[int(random.integers(3))]]
        signs = ((-1.0, -1.0, -1.0), (-1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, -1.0))
        changed = Numbers(given).read_as(poses, meant=given, factors=signs[int(random.integers(4))])
    elif what < 0.5:
        mirror = np.ones(4)
        mirror[int(random.integers(3))] = -1
        changed = poses * np.outer(mirror, mirror)
    else:
        written, read = MIXED_UP[int(random.integers(len(MIXED_UP)))]
        changed = Numbers(NOTATIONS[written]).read_as(poses, meant=NOTATIONS[read])
    pairs = zip(recording.views, changed, strict=True)
    return recording.with_views(_at(view, Pose(matrix)) for view, matrix in pairs), []


def _mirrored(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    return flipped(recording, int(random.integers(2))), []


def _board_size(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    share = _between(random, (0.08, 0.4))
    factor = 1 + share if random.uniform() < 0.5 else 1 / (1 + share)
    return replace(recording, target=larger(recording.target, factor)), []


def _other_camera(recording: Recording, parameters: FloatArray) -> tuple[Recording, list[str]]:
    camera = recording.camera
    return replace(recording, camera=Camera(camera.lens, parameters, *camera.size_px, camera.covariance)), []


def _camera_size(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    parameters = recording.camera.parameters.copy()
    parameters[:4] *= (0.5, 2 / 3, 0.8, 1.25, 1.5, 2.0)[int(random.integers(6))]
    return _other_camera(recording, parameters)


def _cropped(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    parameters = recording.camera.parameters.copy()
    # The corner of the region that is left: pixels are counted from there.
    low, high = (0.06 * side for side in recording.camera.size_px), 0.25
    corner = np.array([_between(random, (value, value * high / 0.06)) for value in low])
    parameters[2:4] += corner
    return _other_camera(recording, parameters)


def _stretched(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    parameters = recording.camera.parameters.copy()
    axis, factor = int(random.integers(2)), (0.75, 5 / 6, 1.2, 4 / 3)[int(random.integers(4))]
    parameters[[axis, 2 + axis]] *= factor
    return _other_camera(recording, parameters)


def _distortion(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    camera = recording.camera
    size = _between(random, (0.15, 0.35)) * (1 if random.uniform() < 0.5 else -1)
    added = np.zeros(5)
    added[:2] = size, -0.5 * size
    own = np.zeros(5)
    if camera.lens == "brown_conrady_5":
        own = camera.distortion
    elif len(camera.distortion):
        raise InputError(f"{camera.lens}: no lens of these studies")
    parameters = np.concatenate([camera.parameters[:4], own + added])
    return replace(recording, camera=Camera("brown_conrady_5", parameters, *camera.size_px)), []


def _sheared(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    size = _between(random, (0.015, 0.08)) * (1 if random.uniform() < 0.5 else -1)
    return sheared(recording, size), []


def _stale(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    views = list(recording.views)
    step = int(random.integers(2, 4))
    for k in range(len(views)):
        if k % step:
            views[k] = _at(views[k], views[k - k % step].T_base_flange)
    return recording.with_views(views), []


def _repeated(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    k = int(random.integers(len(recording)))
    copy = replace(recording.views[k], name=f"{recording.views[k].name}_copy")
    return recording.with_views([*recording.views, copy]), [copy.name]


def _false_points(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    k = int(random.integers(len(recording)))
    view = recording.views[k]
    pixels = np.array(view.pixels)
    wrong = random.choice(len(view), max(1, len(view) // 12), replace=False)
    inward = np.sign(np.array(recording.camera.size_px) / 2 - pixels[wrong])
    pixels[wrong] += inward * random.uniform(8, 30, (len(wrong), 2))
    return _with(recording, k, replace(view, pixels=pixels)), [view.name]


def _few_rotations(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Return views as if the arm had only turned about one axis: the noise of each stays."""
    about = recording.views[0].T_base_flange
    axis = _direction(random)
    # The board stays in sight: all turns are about its centre.
    centre = Pose.exp(np.concatenate([_truth(recording)[1].matrix[:3] @ _centre(recording), np.zeros(3)]))
    views: list[View] = []
    for view in recording.views:
        turn = Pose.exp(np.concatenate([0.03 * _direction(random), axis * random.uniform(-0.4, 0.4)]))
        around = centre @ turn @ centre.inverse()
        in_hand = recording.mounting is Mounting.EYE_IN_HAND
        views.append(_seen_from(recording, view, around @ about if in_hand else about @ around))
    return recording.with_views(views), []


def _centre(recording: Recording) -> FloatArray:
    return np.append(recording.target.points.mean(axis=0), 1.0)


def _truth(recording: Recording) -> tuple[Pose, Pose]:
    truth = recording.truth
    if truth is None or truth.X is None or truth.Y is None:
        raise InputError(f"{recording.name}: X and Y are not known, and views cannot be made from them")
    return truth.X, truth.Y


def _seen_from(recording: Recording, view: View, pose: Pose) -> View:
    """Return a view from another robot pose, what its pixels miss the truth by kept."""
    X, Y = _truth(recording)
    points = recording.target.points[view.point_ids]
    residual = view.pixels - _projected(
        recording, X @ recording.mounting.chain(view.T_base_flange) @ Y, points
    )
    pixels = _projected(recording, X @ recording.mounting.chain(pose) @ Y, points) + residual
    return replace(_at(view, pose), pixels=pixels)


def _projected(recording: Recording, pose: Pose, points: FloatArray) -> FloatArray:
    seen = points @ pose.rotation.T + pose.translation
    return recording.camera.project(seen)[0]


_PLANTERS: dict[Mistake, Callable[[Recording, np.random.Generator], tuple[Recording, list[str]]]] = {
    Mistake.FLIP: _flip,
    Mistake.SWAP: _swap,
    Mistake.SHIFT: _shift,
    Mistake.MOVING: _moving,
    Mistake.GROSS_POSE: _gross_pose,
    Mistake.WRONG_UNIT: _wrong_unit,
    Mistake.WRONG_DIRECTION: _wrong_direction,
    Mistake.WRONG_ROTATION: _wrong_rotation,
    Mistake.MIRRORED: _mirrored,
    Mistake.BOARD_SIZE: _board_size,
    Mistake.CAMERA_SIZE: _camera_size,
    Mistake.CROPPED: _cropped,
    Mistake.STRETCHED: _stretched,
    Mistake.DISTORTION: _distortion,
    Mistake.SHEARED: _sheared,
    Mistake.STALE: _stale,
    Mistake.REPEATED: _repeated,
    Mistake.FALSE_POINTS: _false_points,
    Mistake.FEW_ROTATIONS: _few_rotations,
}


def _with(recording: Recording, k: int, view: View) -> Recording:
    views = list(recording.views)
    views[k] = view
    return recording.with_views(views)


def _at(view: View, pose: Pose) -> View:
    # Joint angles would tell another story than the pose.
    return replace(view, T_base_flange=pose, joints_rad=None)


def _with_image(view: View, other: View) -> View:
    return replace(view, point_ids=other.point_ids, pixels=other.pixels, sigmas_px=other.sigmas_px)


def _between(random: np.random.Generator, bounds: tuple[float, float]) -> float:
    low, high = bounds
    return low * (high / low) ** random.uniform()


def _direction(random: np.random.Generator) -> FloatArray:
    vector = random.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _twist(
    random: np.random.Generator, millimetres: tuple[float, float], degrees: tuple[float, float]
) -> FloatArray:
    shift = _direction(random) * _between(random, millimetres) / MM_PER_M
    return np.concatenate([shift, _direction(random) * np.deg2rad(_between(random, degrees))])


def _moved(views: Sequence[View], k: int, random: np.random.Generator) -> FloatArray:
    """Return a twist in the flange frame: any small one, or a part of the way to the next view."""
    if random.uniform() < 0.5 or k + 1 == len(views):
        return _twist(random, MOVING_MM, MOVING_DEG)
    way = (views[k].T_base_flange.inverse() @ views[k + 1].T_base_flange).log()
    share = _between(random, MOVING_MM) / MM_PER_M / float(np.linalg.norm(way[:3]))
    return way * min(share, 0.25)


def _in_unit(pose: Pose, per_metre: float) -> Pose:
    matrix = pose.matrix.copy()
    matrix[:3, 3] *= per_metre
    return Pose(matrix)


def _turned_more(pose: Pose, factor: float) -> Pose:
    """Return what comes out where the unit of a rotation vector is mistaken."""
    matrix = Pose.exp([0, 0, 0, *(factor * pose.log()[3:])]).matrix.copy()
    matrix[:3, 3] = pose.translation
    return Pose(matrix)


def _reordered(poses: FloatArray, *, real_first: bool) -> FloatArray:
    """Return poses (K, 4, 4) whose quaternions were written in one order and read in the other."""
    changed = poses.copy()
    for matrix, pose in zip(changed, poses, strict=True):
        quaternion = np.roll(Pose(pose).quaternion_xyzw, 1 if real_first else -1)
        matrix[:3, :3] = Pose.from_quaternion([0, 0, 0], quaternion).rotation
    return changed
