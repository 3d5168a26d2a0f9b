"""Mistakes planted in all views of a recording alike: units, conventions, target, pictures and camera."""

from dataclasses import replace

import numpy as np

from handeye.errors import InputError
from handeye.estimation.faults.kinds.mirrored_pictures import flipped
from handeye.estimation.faults.kinds.numbers import Numbers
from handeye.estimation.faults.kinds.sheared_pictures import sheared as sheared_by
from handeye.estimation.faults.kinds.wrong_unit import larger
from handeye.notations import NOTATIONS
from handeye.studies.planted_views import at, between
from handeye.types import Camera, Mounting, Pose, Recording
from handeye.types.arrays import FloatArray
from handeye.types.units import MM_PER_M

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


def wrong_unit(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Translations of the robot, its rotation vectors, or the target's measures taken for another unit."""
    what = random.uniform()
    if what < 0.25:
        return replace(recording, target=larger(recording.target, MM_PER_M)), []
    if what < 0.5:
        factor = np.deg2rad(1.0) if random.uniform() < 0.5 else np.rad2deg(1.0)
        return recording.with_views(at(v, _turned_more(v.T_base_flange, factor)) for v in recording.views), []
    per_metre = (MM_PER_M, MM_PER_M, 100.0, 1 / 0.0254)[int(random.integers(4))]
    return recording.with_views(at(v, _in_unit(v.T_base_flange, per_metre)) for v in recording.views), []


def wrong_direction(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Invert the poses, or give the other mounting."""
    # Inverted poses, or the camera said to be where it is not: the same numbers for another reason.
    if random.uniform() < 0.5:
        other = next(m for m in Mounting if m is not recording.mounting)
        return replace(recording, mounting=other), []
    return recording.with_views(at(v, v.T_base_flange.inverse()) for v in recording.views), []


def wrong_rotation(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Read the rotations in another way than they were written."""
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
    return recording.with_views(at(view, Pose(matrix)) for view, matrix in pairs), []


def mirrored(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Flip the pictures."""
    return flipped(recording, int(random.integers(2))), []


def board_size(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Make the target larger or smaller than it was."""
    share = between(random, (0.08, 0.4))
    factor = 1 + share if random.uniform() < 0.5 else 1 / (1 + share)
    return replace(recording, target=larger(recording.target, factor)), []


def _other_camera(recording: Recording, parameters: FloatArray) -> tuple[Recording, list[str]]:
    camera = recording.camera
    return replace(recording, camera=Camera(camera.lens, parameters, *camera.size_px, camera.covariance)), []


def camera_size(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Give a camera calibrated for another size."""
    parameters = recording.camera.parameters.copy()
    parameters[:4] *= (0.5, 2 / 3, 0.8, 1.25, 1.5, 2.0)[int(random.integers(6))]
    return _other_camera(recording, parameters)


def cropped(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Cut the pictures, the camera as before."""
    parameters = recording.camera.parameters.copy()
    # The corner of the region that is left: pixels are counted from there.
    low, high = (0.06 * side for side in recording.camera.size_px), 0.25
    corner = np.array([between(random, (value, value * high / 0.06)) for value in low])
    parameters[2:4] += corner
    return _other_camera(recording, parameters)


def stretched(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Resize the pictures unequally, the camera as before."""
    parameters = recording.camera.parameters.copy()
    axis, factor = int(random.integers(2)), (0.75, 5 / 6, 1.2, 4 / 3)[int(random.integers(4))]
    parameters[[axis, 2 + axis]] *= factor
    return _other_camera(recording, parameters)


def distortion(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Give the coefficients of another lens."""
    camera = recording.camera
    size = between(random, (0.15, 0.35)) * (1 if random.uniform() < 0.5 else -1)
    added = np.zeros(5)
    added[:2] = size, -0.5 * size
    own = np.zeros(5)
    if camera.lens == "brown_conrady_5":
        own = camera.distortion
    elif len(camera.distortion):
        raise InputError(f"{camera.lens}: no lens of these studies")
    parameters = np.concatenate([camera.parameters[:4], own + added])
    return replace(recording, camera=Camera("brown_conrady_5", parameters, *camera.size_px)), []


def sheared(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Shift every row of the pictures against the one before."""
    size = between(random, (0.015, 0.08)) * (1 if random.uniform() < 0.5 else -1)
    return sheared_by(recording, size), []


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
