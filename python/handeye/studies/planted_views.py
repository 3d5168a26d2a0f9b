"""Mistakes planted in single views, or in what views belong to which poses."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handeye.errors import InputError
from handeye.estimation.faults.relabel import reflections, turns
from handeye.types import Mounting, Pose, Recording, View
from handeye.types.arrays import FloatArray
from handeye.types.units import MM_PER_M

MOVING_MM, MOVING_DEG = (5.0, 15.0), (0.3, 1.5)
GROSS_MM, GROSS_DEG = (40.0, 300.0), (4.0, 40.0)


def flip(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Label the board of one view turned, or mirrored."""
    k = int(random.integers(len(recording)))
    others = [*turns(recording.target)[1:], *reflections(recording.target)]
    view = recording.views[k]
    return _with(recording, k, others[int(random.integers(len(others)))].applied(view)), [view.name]


def swap(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Swap the images of two views."""
    views = list(recording.views)
    k = int(random.integers(len(views)))
    other = (k + 1 + int(random.integers(len(views) - 1))) % len(views)
    one, two = views[k], views[other]
    views[k], views[other] = _with_image(one, two), _with_image(two, one)
    return recording.with_views(views), [one.name, two.name]


def shift(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Shift the list of images by one, all of it or a few in a row."""
    views = list(recording.views)
    count = len(views)
    # Most of the list must be right for the rest to be told from it; else it is the whole list.
    length = int(random.integers(3, count // 2)) if random.uniform() < 0.5 and count > 7 else count
    first = int(random.integers(count - length + 1))
    row = views[first : first + length]
    views[first : first + length] = map(_with_image, row, [*row[1:], row[0]])
    return recording.with_views(views), [] if length == count else [v.name for v in row]


def moving(
    recording: Recording, random: np.random.Generator, least_mm: float = MOVING_MM[0]
) -> tuple[Recording, list[str]]:
    """Take one view on the move: off by `least_mm` or more."""
    k = int(random.integers(len(recording)))
    view = recording.views[k]
    off = Pose.exp(_moved(recording.views, k, random, (least_mm, MOVING_MM[1])))
    return _with(recording, k, at(view, view.T_base_flange @ off)), [view.name]


def gross_pose(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Put one robot pose far off."""
    k = int(random.integers(len(recording)))
    view = recording.views[k]
    off = Pose.exp(_twist(random, GROSS_MM, GROSS_DEG))
    return _with(recording, k, at(view, view.T_base_flange @ off)), [view.name]


def stale(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Leave robot poses unread."""
    views = list(recording.views)
    step = int(random.integers(2, 4))
    for k in range(len(views)):
        if k % step:
            views[k] = at(views[k], views[k - k % step].T_base_flange)
    return recording.with_views(views), []


def repeated(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Add one view again."""
    k = int(random.integers(len(recording)))
    copy = replace(recording.views[k], name=f"{recording.views[k].name}_copy")
    return recording.with_views([*recording.views, copy]), [copy.name]


def false_points(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Put a few points of one view in the wrong place."""
    k = int(random.integers(len(recording)))
    view = recording.views[k]
    pixels = np.array(view.pixels)
    wrong = random.choice(len(view), max(1, len(view) // 12), replace=False)
    inward = np.sign(np.array(recording.camera.size_px) / 2 - pixels[wrong])
    pixels[wrong] += inward * random.uniform(8, 30, (len(wrong), 2))
    return _with(recording, k, replace(view, pixels=pixels)), [view.name]


def few_rotations(recording: Recording, random: np.random.Generator) -> tuple[Recording, list[str]]:
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
    return replace(at(view, pose), pixels=pixels)


def _projected(recording: Recording, pose: Pose, points: FloatArray) -> FloatArray:
    seen = points @ pose.rotation.T + pose.translation
    return recording.camera.project(seen)[0]


def _with(recording: Recording, k: int, view: View) -> Recording:
    views = list(recording.views)
    views[k] = view
    return recording.with_views(views)


def _with_image(view: View, other: View) -> View:
    return replace(view, point_ids=other.point_ids, pixels=other.pixels, sigmas_px=other.sigmas_px)


def _twist(
    random: np.random.Generator, millimetres: tuple[float, float], degrees: tuple[float, float]
) -> FloatArray:
    shift = _direction(random) * between(random, millimetres) / MM_PER_M
    return np.concatenate([shift, _direction(random) * np.deg2rad(between(random, degrees))])


def _moved(
    views: Sequence[View], k: int, random: np.random.Generator, millimetres: tuple[float, float]
) -> FloatArray:
    """Return a twist in the flange frame: any small one, or a part of the way to the next view."""
    if random.uniform() < 0.5 or k + 1 == len(views):
        return _twist(random, millimetres, MOVING_DEG)
    way = (views[k].T_base_flange.inverse() @ views[k + 1].T_base_flange).log()
    length = max(float(np.linalg.norm(way[:3])), 1e-6)  # some arms only turn from one view to the next
    return way * min(between(random, millimetres) / MM_PER_M / length, 0.25)


def at(view: View, pose: Pose) -> View:
    """Return a view at another robot pose."""
    # Joint angles would tell another story than the pose.
    return replace(view, T_base_flange=pose, joints_rad=None)


def between(random: np.random.Generator, bounds: tuple[float, float]) -> float:
    """Draw a size, logarithms alike."""
    low, high = bounds
    return low * (high / low) ** random.uniform()


def _direction(random: np.random.Generator) -> FloatArray:
    vector = random.standard_normal(3)
    return vector / np.linalg.norm(vector)
