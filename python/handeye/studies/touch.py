"""Does the tool land where it is said to? Made-up cells, seen and touched where nobody looked before.

In every cell parts of known size are put at random places of a box, each seen from one posture and touched
from another. Where the tool truly lands is known, so the stated radius can be counted; and with views chosen
one by one, whether planning for the touch error makes it smaller.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import SolveError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.estimation.measurements import view_pose
from handeye.estimation.touch import Touches, touch_error
from handeye.estimation.work import Work, touch_map
from handeye.planning.prediction import Sight, gains
from handeye.planning.touch import FEWEST_VIEWS, touch_criterion
from handeye.robots import ArmKinematics
from handeye.simulation.cells import (
    MIXTURES,
    CellOptions,
    ErrorKind,
    SimulatedCell,
    draw_views,
    simulate_cell,
    simulated_arm,
)
from handeye.studies.touch_choice import by_hindsight
from handeye.types import Chessboard, Mounting, Pose, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.types.touch import WorkBox
from handeye.types.units import MM_PER_M

# What is seen and touched: a part of this size, known exactly.
PART = Chessboard(4, 4, 0.02)
SIDE_M = (0.3, 0.3, 0.15)
TOOL_TILT_RAD = float(np.deg2rad(30.0))
START = 3
_TRIES = 40


@dataclass(frozen=True)
class TouchStudy:
    """What is tried.

    Parameters
    ----------
    cells
        Cells of each mounting, with the arm described and not.
    touches
        Random places and postures in each.
    pool, views
        Views that can be chosen from, and how many are.
    asked_mm
        Touch error to stop at; None to skip what is planned.
    """

    cells: int = 50
    touches: int = 100
    pool: int = 40
    views: int = 10
    most_views: int = 20
    asked_mm: float | None = None
    seed: int = 0


@dataclass(frozen=True)
class CellResult:
    """One cell: share of touches within the radius, errors and radii, and what planning gave.

    `choices_mm` are root mean square errors foretold by all views: of views chosen by entropy, by touch
    error, and of the best choice that there is.
    """

    held: float
    error_mm: float
    radius_mm: float
    as_reported_mm: float
    entropy_mm: float = float("nan")
    touch_mm: float = float("nan")
    pool_mm: float = float("nan")
    choices_mm: tuple[float, float, float] = (float("nan"), float("nan"), float("nan"))
    asked_held: float = float("nan")
    asked_met: bool = False
    asked_views: int = 0


@dataclass(frozen=True)
class Group:
    """Cells alike in mounting, and in whether the arm is described."""

    mounting: Mounting
    arm_known: bool

    @property
    def name(self) -> str:
        """Stable name."""
        return f"{self.mounting.value}_{'described' if self.arm_known else 'not_described'}"


GROUPS = tuple(Group(mounting, known) for mounting in Mounting for known in (True, False))


def study_touch(
    options: TouchStudy, *, workers: Workers = 1, progress: Progress | None = None
) -> dict[str, Any]:
    """Count how often touches land within the stated radius.

    Raises
    ------
    SolveError
        An estimate failed.
    """
    jobs = [_Job(options, group, number) for group in GROUPS for number in range(options.cells)]
    done = run_all(_one, jobs, workers=workers, progress=progress)
    groups = {
        group.name: _summed([r for job, r in zip(jobs, done, strict=True) if job.group is group])
        for group in GROUPS
    }
    return {
        "study": "touch",
        "seed": options.seed,
        "cells": options.cells,
        "touches": options.touches,
        "asked_mm": options.asked_mm,
        "groups": groups,
    }


def _summed(results: Sequence[CellResult]) -> dict[str, Any]:
    def mean(name: str) -> float:
        return float(np.mean([getattr(result, name) for result in results]))

    met = [result for result in results if result.asked_met]
    held = np.array([result.held for result in results])
    return {
        "held": mean("held"),
        "held_standard_error": float(np.std(held) / np.sqrt(len(held))),
        "error_mm": mean("error_mm"),
        "radius_mm": mean("radius_mm"),
        "as_reported_mm": mean("as_reported_mm"),
        "planned_by_entropy_mm": mean("entropy_mm"),
        "planned_by_touch_mm": mean("touch_mm"),
        "whole_pool_mm": mean("pool_mm"),
        **{
            f"foretold_{name}_mm": float(np.mean([result.choices_mm[i] for result in results]))
            for i, name in enumerate(("by_entropy", "by_touch", "best"))
        },
        "asked_met": len(met),
        "asked_held": float(np.mean([result.asked_held for result in met])) if met else float("nan"),
        "asked_views": float(np.mean([result.asked_views for result in met])) if met else float("nan"),
    }


@dataclass(frozen=True)
class _Job:
    options: TouchStudy
    group: Group
    number: int


def _one(job: _Job) -> CellResult:
    options = job.options
    kind = MIXTURES[job.number % len(MIXTURES)]
    cell = CellOptions(mounting=job.group.mounting)
    simulated = simulate_cell(kind, job.number, cell, seed=options.seed)
    measurements = Measurements.of_recording(simulated.recording)
    estimator = make_estimator(ModelName.AUTO, _arm(job.group))
    random = np.random.default_rng([options.seed, 7, job.number])
    estimate = estimator(measurements)
    work = Work(_box(simulated))
    held, errors, radii = _tried(random, simulated, estimate, work, options.touches)
    where = touch_map(estimate, measurements, work)
    result = CellResult(held, errors, radii, MM_PER_M * where.as_reported_m)
    if options.asked_mm is None:
        return result
    return _planned(job, kind, result)


def _arm(group: Group) -> ArmKinematics | None:
    return ArmKinematics(simulated_arm()) if group.arm_known else None


def _box(cell: SimulatedCell) -> WorkBox:
    """Return a box of work around where the board lies, or was in the middle of the views."""
    recording = cell.recording
    middle = cell.Y.act(recording.target.points).mean(axis=0)
    if recording.mounting is Mounting.EYE_TO_HAND:
        middle = np.mean([view.T_base_flange.act([middle])[0] for view in recording.views], axis=0)
    low, high = middle - np.array(SIDE_M) / 2, middle + np.array(SIDE_M) / 2
    (a, b, c), (d, e, f) = low.tolist(), high.tolist()
    return WorkBox((a, b, c), (d, e, f))


def _tried(
    random: np.random.Generator, cell: SimulatedCell, estimate: Estimate, work: Work, count: int
) -> tuple[float, float, float]:
    """Return the share of touches within their radius, the mean error and the mean radius, millimetres."""
    errors, radii = touched(random, cell, estimate, work, count)
    return (
        float(np.mean(errors <= radii)),
        MM_PER_M * float(errors.mean()),
        MM_PER_M * float(radii.mean()),
    )


def touched(
    random: np.random.Generator, cell: SimulatedCell, estimate: Estimate, work: Work, count: int
) -> tuple[FloatArray, FloatArray]:
    """See and touch at random places of the box: errors (count,) and stated radii (count,), metres.

    Raises
    ------
    SolveError
        The box cannot be seen or reached.
    """
    if work.box is None or cell.arm is None:
        raise AssertionError  # of a mixture over a stated box
    tool = np.array(work.tool_m)
    low, high = np.array(work.box.lower_m), np.array(work.box.upper_m)
    errors: list[float] = []
    radii: list[float] = []
    for _ in range(_TRIES * count):
        if len(errors) == count:
            return np.array(errors), np.array(radii)
        place = random.uniform(low, high)
        looked = _look_at(random, cell, estimate, place)
        if looked is None:
            continue
        seeing, seen_from, believed = looked
        reached = _reach(random, estimate, believed, tool, seeing)
        if reached is None:
            continue
        touching, touched_from = reached
        landed = (cell.arm.stand(random, touching[np.newaxis])[0] @ [*tool, 1.0])[:3]
        known = estimate.arm is not None
        one = Touches(
            believed[np.newaxis],
            seen_from[np.newaxis],
            touched_from[np.newaxis],
            tool,
            seeing[np.newaxis] if known else None,
            touching[np.newaxis] if known else None,
            work.depth,
        )
        errors.append(float(np.linalg.norm(landed - place)))
        radii.append(float(touch_error(estimate, one).radii_m[0]))
    raise SolveError(
        f"{len(errors)} of {count} places seen and touched in {_TRIES * count} tries", code=Code.NO_VIEWS
    )


def _look_at(
    random: np.random.Generator, cell: SimulatedCell, estimate: Estimate, place: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """See a part: joints (n,), reported pose (4, 4), and where the place is believed to be (3,)."""
    recording, arm = cell.recording, cell.arm
    if arm is None:
        raise AssertionError  # of a mixture
    in_hand = recording.mounting is Mounting.EYE_IN_HAND
    centre = PART.points.mean(axis=0)
    if in_hand:
        part = np.diag([1.0, -1.0, -1.0, 1.0])
        part[:3, 3] = place - part[:3, :3] @ centre
        options = CellOptions(mounting=recording.mounting, target=PART, distance_m=(0.4, 0.7))
        try:
            joints, _ = draw_views(random, simulated_arm(), cell.camera, cell.X, Pose(part), 1, options)
        except SolveError:
            return None
        seeing = joints[0]
        camera_base = cell.X.matrix @ Pose(arm.stand(random, joints)[0]).inverse().matrix
        seen = camera_base @ part
    else:
        seeing = np.array(recording.views[0].joints_rad)
        camera_base = cell.X.matrix
        turn = Pose.exp([0, 0, 0, *random.normal(0, np.deg2rad(15.0), 3)]).matrix
        seen = turn.copy()
        seen[:3, 3] = (camera_base @ [*place, 1.0])[:3] - seen[:3, :3] @ centre
    pixels, inside = cell.camera.project(PART.points @ seen[:3, :3].T + seen[:3, 3])
    if not inside.all() or (pixels < 0).any() or (pixels > np.array(cell.camera.size_px) - 1).any():
        return None
    view = View("part", Pose.identity(), np.arange(PART.point_count), pixels)
    found = view_pose(estimate.camera, PART, view).T_camera_target.act([centre])[0]
    reported = simulated_arm().forward(seeing)
    at_base = estimate.X.inverse().act([found])[0]
    believed = _standing(estimate, seeing)[:3] @ [*at_base, 1.0] if in_hand else at_base
    return seeing, reported, believed


def _standing(estimate: Estimate, joints: FloatArray) -> FloatArray:
    """(4, 4) where the flange stands by what is known of the arm, when its joints are read as (n,)."""
    reported = simulated_arm().forward(joints)
    return estimate.poses_as_built(reported[np.newaxis], joints[np.newaxis])[0]


def _reach(
    random: np.random.Generator,
    estimate: Estimate,
    place: FloatArray,
    tool: FloatArray,
    seeing: FloatArray,
) -> tuple[FloatArray, FloatArray] | None:
    """Send the tool to a place: joints (n,) and reported pose (4, 4); None if out of reach."""
    down = np.diag([1.0, -1.0, -1.0, 1.0])
    axis = random.standard_normal(3)
    tilt = random.uniform(0, TOOL_TILT_RAD) / float(np.linalg.norm(axis)) * axis
    roll = Pose.exp([0, 0, 0, 0, 0, random.uniform(-1.5, 1.5)])
    goal = down @ (Pose.exp([0, 0, 0, *tilt]) @ roll).matrix
    aim = place
    joints = seeing
    for _ in range(3):
        goal[:3, 3] = aim - goal[:3, :3] @ tool
        found, reached = simulated_arm().inverse_all(goal[np.newaxis], joints, attempts=10)
        if not reached[0]:
            return None
        joints = found[0]
        # The controller has its own arm in mind; the tool is to be where ours is known to be.
        aim = aim + place - _standing(estimate, joints)[:3] @ [*tool, 1.0]
    return joints, simulated_arm().forward(joints)


def _planned(job: _Job, kind: ErrorKind, result: CellResult) -> CellResult:
    """Choose views one by one, by entropy and by touch error, and until the touch error is what was asked."""
    options = job.options
    cell = CellOptions(mounting=job.group.mounting, views=(options.pool, options.pool))
    simulated = simulate_cell(kind, job.number, cell, seed=options.seed + 1)
    work = Work(_box(simulated))
    means: dict[str, float] = {}
    choices: list[list[int]] = []
    stopped: tuple[Estimate, int] | None = None
    for criterion in ("entropy", "touch"):
        most = options.most_views if criterion == "touch" else options.views
        for chosen, estimate, where in _steps(job, simulated, work, criterion, most):
            count = len(chosen)
            if count == options.views:
                choices.append(chosen)
                random = np.random.default_rng([options.seed, 8, job.number])
                errors, _ = touched(random, simulated, estimate, work, options.touches)
                means[criterion] = MM_PER_M * float(errors.mean())
            if criterion == "touch" and stopped is None and where is not None:
                if MM_PER_M * where <= (options.asked_mm or 0.0):
                    stopped = estimate, count
                if count >= options.views and stopped is not None:
                    break
    # What no choice of views out of the pool could go far below: all of them.
    everything = Measurements.of_recording(simulated.recording)
    whole = make_estimator(ModelName.AUTO, _arm(job.group))(everything)
    random = np.random.default_rng([options.seed, 8, job.number])
    errors, _ = touched(random, simulated, whole, work, options.touches)
    pool_mm = MM_PER_M * float(errors.mean())
    foretold = by_hindsight(whole, everything, work, choices, START)
    by_entropy, by_touch = foretold.of_choices
    kept, views = float("nan"), 0
    if stopped is not None:
        random = np.random.default_rng([options.seed, 9, job.number])
        errors, _ = touched(random, simulated, stopped[0], work, options.touches)
        kept, views = float(np.mean(MM_PER_M * errors <= (options.asked_mm or 0.0))), stopped[1]
    return replace(
        result,
        entropy_mm=means["entropy"],
        touch_mm=means["touch"],
        pool_mm=pool_mm,
        choices_mm=(MM_PER_M * by_entropy, MM_PER_M * by_touch, MM_PER_M * foretold.best),
        asked_held=kept,
        asked_met=stopped is not None,
        asked_views=views,
    )


def _steps(
    job: _Job, cell: SimulatedCell, work: Work, criterion: str, most: int
) -> Iterator[tuple[list[int], Estimate, float | None]]:
    """Yield the views chosen, estimate and worst touch error (metres; None while open) as views are added."""
    everything = Measurements.of_recording(cell.recording)
    estimator = make_estimator(ModelName.AUTO, _arm(job.group))
    chosen = list(range(START))
    left = list(range(START, len(everything)))
    estimate: Estimate | None = None
    while True:
        taken = everything.select(chosen)
        estimate = estimator(taken, estimate)
        worst = None
        if criterion == "touch" and len(chosen) >= FEWEST_VIEWS and estimate.determined:
            worst = touch_map(estimate, taken, work).worst_m
        yield list(chosen), estimate, worst
        if len(chosen) >= most:
            return
        core = _core.Criterion("entropy")
        if criterion == "touch" and estimate.determined:
            core = touch_criterion(estimate, taken, work)
        pool = everything.select(left)
        worth = gains(
            estimate,
            core,
            pool.motions,
            Sight(known=True),
            joints=pool.joints if job.group.arm_known else None,
        )
        chosen.append(left.pop(int(np.nanargmax(worth))))
