"""Are mistakes found and named? Simulated recordings with one planted mistake each, and clean ones.

A mistake is named correctly if it is the only one that is named, with its code and, where it concerns single
views, exactly these views. What it costs is the error of the hand-eye against that of the same recording
without the mistake, both by the same solve.
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import InputError
from handeye.estimation import solve
from handeye.estimation.mistakes import CODES
from handeye.estimation.mistakes.relabel import reflections, turns
from handeye.simulation.cells import TARGET, CellOptions, ErrorKind, simulate
from handeye.studies.protocol import true_hand_eye
from handeye.types import Chessboard, CircleGrid, Mounting, Pose, Recording, Target, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.validation import metrics

RUNS_PER_PIECE = 6
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


EXPECTED = {
    Mistake.FLIP: "view_flipped",
    Mistake.SWAP: "view_shuffled",
    Mistake.SHIFT: "view_shuffled",
    Mistake.MOVING: "view_moving",
    Mistake.GROSS_POSE: "gross_pose",
    Mistake.WRONG_UNIT: "wrong_unit",
    Mistake.WRONG_DIRECTION: "wrong_direction",
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


@dataclass(frozen=True)
class Run:
    """One recording: whether all was said that is wrong with it, and the errors with and without.

    `translation_mm` and `rotation_deg` are NaN where the recording was refused.
    """

    named: bool
    said: tuple[str, ...]
    translation_mm: float
    rotation_deg: float
    clean_translation_mm: float
    clean_rotation_deg: float


@dataclass(frozen=True)
class Mistakes:
    """All recordings per planted mistake, and those with none."""

    model: ModelName
    seed: int
    kinds: dict[Mistake, tuple[Run, ...]]
    clean: tuple[Run, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        planted = [run for runs in self.kinds.values() for run in runs]
        return {
            "study": "mistakes",
            "model": self.model.value,
            "seed": self.seed,
            "views": list(CELL.views),
            "kinds": {kind.value: _kind(runs) for kind, runs in self.kinds.items()},
            "planted": _kind(planted),
            "clean": {
                "trials": len(self.clean),
                "false_alarms": float(np.mean([not run.named for run in self.clean])),
            },
        }


def _kind(runs: Sequence[Run]) -> dict[str, Any]:
    answered = [run for run in runs if np.isfinite(run.translation_mm)]
    values: dict[str, Any] = {
        "trials": len(runs),
        "named": float(np.mean([run.named for run in runs])),
        "answered": len(answered) / len(runs),
    }
    for name in ("translation_mm", "rotation_deg"):
        error = float(np.mean([getattr(run, name) for run in answered])) if answered else None
        clean = float(np.mean([getattr(run, f"clean_{name}") for run in answered])) if answered else None
        values[name], values[f"clean_{name}"] = error, clean
        quantity = name.partition("_")[0]
        values[f"{quantity}_ratio"] = error / clean if error is not None and clean else None
    return values


def study_mistakes(
    *,
    kinds: Sequence[Mistake] = tuple(Mistake),
    model: ModelName = ModelName.AUTO,
    trials: int = 50,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Mistakes:
    """Plant each mistake in `trials` made-up recordings, and none in as many.

    Mountings, targets and errors of the arm take turns.

    Raises
    ------
    SolveError
        A cell could not be drawn, or an estimate failed.
    """
    planted: list[Mistake | None] = [*map(Mistake, kinds), None]
    jobs = [
        _Job(kind, ModelName(model), seed, tuple(range(i, min(i + RUNS_PER_PIECE, trials))))
        for kind in planted
        for i in range(0, trials, RUNS_PER_PIECE)
    ]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    results = {
        kind: tuple(run for job, runs in zip(jobs, done, strict=True) if job.mistake is kind for run in runs)
        for kind in planted
    }
    named = {kind: runs for kind, runs in results.items() if kind is not None}
    return Mistakes(ModelName(model), seed, named, results[None])


@dataclass(frozen=True)
class _Job:
    mistake: Mistake | None
    model: ModelName
    seed: int
    numbers: tuple[int, ...]


def _run(job: _Job) -> list[Run]:
    return [_one(job, number) for number in job.numbers]


def made_up(number: int, seed: int) -> Recording:
    """Return a clean recording; targets, mountings and errors of the arm take turns."""
    cell = replace(
        CELL,
        target=TARGETS[number % len(TARGETS)],
        mounting=list(Mounting)[number // len(TARGETS) % 2],
    )
    return simulate(KINDS[number // (2 * len(TARGETS)) % len(KINDS)], number, cell, seed=seed)


def _one(job: _Job, number: int) -> Run:
    clean = made_up(number, job.seed)
    if job.mistake is None:
        said, translation_mm, rotation_deg = _outcome(clean, job.model)
        return Run(not said, tuple(code for code, _ in said), *(translation_mm, rotation_deg) * 2)
    random = np.random.default_rng([job.seed, number, zlib.crc32(job.mistake.encode())])
    recording, views = plant(clean, job.mistake, random)
    _, *before = _outcome(clean, job.model)
    said, *after = _outcome(recording, job.model)
    named = said == [(EXPECTED[job.mistake], sorted(views))]
    return Run(named, tuple(code for code, _ in said), *after, *before)


def _outcome(recording: Recording, model: ModelName) -> tuple[list[tuple[str, list[str]]], float, float]:
    """What a solve said, with the views (none where it concerns all), and its errors; NaN if it refused."""
    try:
        calibration = solve(recording, model)
    except InputError as error:
        return [(error.code, [])], float("nan"), float("nan")
    said = [(f.code, sorted(f.evidence["views"])) for f in calibration.diagnosis if f.code in CODES]
    error = metrics.absolute_error(calibration.X, true_hand_eye(recording))
    return said, error.translation_mm, error.rotation_deg


def plant(recording: Recording, mistake: Mistake, random: np.random.Generator) -> tuple[Recording, list[str]]:
    """Plant a mistake; also the names of the views with it, empty if it is in all."""
    views = list(recording.views)
    k = int(random.integers(len(views)))
    view = views[k]
    if mistake is Mistake.FLIP:
        others = [*turns(recording.target)[1:], *reflections(recording.target)]
        views[k] = others[int(random.integers(len(others)))].applied(view)
        return recording.with_views(views), [view.name]
    if mistake is Mistake.SWAP:
        other = (k + 1 + int(random.integers(len(views) - 1))) % len(views)
        views[k], views[other] = _with_image(view, views[other]), _with_image(views[other], view)
        return recording.with_views(views), [view.name, views[other].name]
    if mistake is Mistake.SHIFT:
        count = len(views)
        # Most of the list must be right for the rest to be told from it; else it is the whole list.
        length = int(random.integers(3, count // 2)) if random.uniform() < 0.5 and count > 7 else count
        first = int(random.integers(count - length + 1))
        row = views[first : first + length]
        views[first : first + length] = map(_with_image, row, [*row[1:], row[0]])
        return recording.with_views(views), [] if length == count else [v.name for v in row]
    if mistake is Mistake.MOVING:
        views[k] = _at(view, view.T_base_flange @ Pose.exp(_moved(views, k, random)))
        return recording.with_views(views), [view.name]
    if mistake is Mistake.GROSS_POSE:
        error = Pose.exp(_twist(random, GROSS_MM, GROSS_DEG))
        views[k] = _at(view, view.T_base_flange @ error)
        return recording.with_views(views), [view.name]
    if mistake is Mistake.WRONG_UNIT:
        return _in_another_unit(recording, random), []
    # Inverted poses, or the camera said to be where it is not: the same numbers for another reason.
    if random.uniform() < 0.5:
        other_mounting = next(m for m in Mounting if m is not recording.mounting)
        return replace(recording, mounting=other_mounting), []
    return recording.with_views(_at(v, v.T_base_flange.inverse()) for v in views), []


def _at(view: View, pose: Pose) -> View:
    # Joint angles would tell another story than the pose.
    return replace(view, T_base_flange=pose, joints_rad=None)


def _with_image(view: View, other: View) -> View:
    return replace(view, point_ids=other.point_ids, pixels=other.pixels)


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


def _in_another_unit(recording: Recording, random: np.random.Generator) -> Recording:
    """Translations of the robot, its rotation vectors, or the target's measures taken for another unit."""
    what = random.uniform()
    if what < 0.25:
        return _larger_target(recording, MM_PER_M)
    if what < 0.5:
        return recording.with_views(_at(v, _degrees_for_radians(v.T_base_flange)) for v in recording.views)
    per_metre = (MM_PER_M, MM_PER_M, 100.0, 1 / 0.0254)[int(random.integers(4))]
    return recording.with_views(_at(v, _in_unit(v.T_base_flange, per_metre)) for v in recording.views)


def _in_unit(pose: Pose, per_metre: float) -> Pose:
    matrix = pose.matrix.copy()
    matrix[:3, 3] *= per_metre
    return Pose(matrix)


def _degrees_for_radians(pose: Pose) -> Pose:
    """Return what comes out where a rotation vector in radians is read as degrees."""
    vector = np.deg2rad(pose.log()[3:])
    matrix = Pose.exp([0, 0, 0, *vector]).matrix.copy()
    matrix[:3, 3] = pose.translation
    return Pose(matrix)


def _larger_target(recording: Recording, factor: float) -> Recording:
    target = recording.target
    if isinstance(target, Chessboard):
        return replace(recording, target=replace(target, pitch_m=target.pitch_m * factor))
    if isinstance(target, CircleGrid):
        larger = replace(target, pitch_m=target.pitch_m * factor, diameter_m=target.diameter_m * factor)
        return replace(recording, target=larger)
    raise InputError(f"{target.family}: no board of these studies")
