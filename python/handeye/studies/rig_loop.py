"""A simulated rig driven until all cameras are as accurate as asked; and the same one camera at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.estimation import RigEstimate
from handeye.planning.collisions import Body as ArmBody
from handeye.planning.collisions import Workspace
from handeye.planning.rig import RigRequest, rigid_pairs
from handeye.robots.protocol import Robot
from handeye.robots.simulated import SimulatedArm
from handeye.session.faults import FaultRates, FaultyRobot
from handeye.session.rig import RigEnd, RigWish, RigWorld, Seen, open_or_create, run_rig
from handeye.session.simulated import usual_errors
from handeye.simulation.cells import simulated_arm
from handeye.simulation.rigs import (
    BOARDS,
    RigOptions,
    SimulatedRig,
    chance_of,
    draw_rig,
    draw_stations,
    seen_targets,
)
from handeye.types import RigRecording, Station
from handeye.types.rig import MountedTarget
from handeye.validation import metrics


@dataclass(frozen=True, eq=False)
class RigCell:
    """A simulated rig to drive: its world, an empty recording, and the truth."""

    world: RigWorld
    empty: RigRecording
    rig: SimulatedRig
    hidden: SimulatedArm


def rig_cell(
    seed: int,
    cameras: Sequence[str] | None = None,
    *,
    described: bool = True,
    faults: FaultRates | None = None,
) -> RigCell:
    """Return a simulated rig with the errors of the simulated cell; the same for the same seed.

    Parameters
    ----------
    seed
        Of everything.
    cameras
        Those that take part; None for all.
    described
        Whether the estimate knows the arm.
    faults
        How often the drivers fail.
    """
    random = np.random.default_rng([seed, 11])
    arm = simulated_arm()
    options = RigOptions(stations=1, fewest_seen=4)
    rig = draw_rig(random, options)
    start = draw_stations(random, arm, rig, options)[0]
    hidden = SimulatedArm(arm, usual_errors(), seed, start.tolist())
    robot: Robot = hidden if faults is None else FaultyRobot(hidden, faults, seed)
    used = tuple(rig.given) if cameras is None else tuple(cameras)
    targets = seen_targets(rig, used)

    def look(label: str) -> list[Seen]:
        pictures = rig.pictures(hidden.hidden_pose, chance_of(seed, label))
        return [
            (camera, target, np.arange(len(pixels), dtype=np.int64), pixels)
            for camera, target, pixels in pictures
            if camera in used and target in targets
        ]

    reach = arm.reach_m + 0.2
    space = Workspace(np.array([-reach, -reach, -0.15]), np.array([reach, reach, reach]), floor_m=-0.25)
    boards: dict[str, MountedTarget] = {name: BOARDS[name] for name in targets}
    empty = RigRecording(
        f"simulated rig {seed}",
        {name: rig.given[name] for name in used},
        boards,
        (),
        None,
        "simulated",
    )
    world = RigWorld(robot, arm, look, start, ArmBody(arm, space), described)
    return RigCell(world, empty, rig, hidden)


@dataclass(frozen=True)
class RigLoopRun:
    """One run: stations, why it ended, what was stated and what is true."""

    cameras: tuple[str, ...]
    stations: int
    reason: str
    stated_mm: dict[str, float]
    error_mm: dict[str, float]
    error_deg: dict[str, float]
    inside: dict[str, bool]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "cameras": list(self.cameras),
            "stations": self.stations,
            "reason": self.reason,
            "stated_mm": self.stated_mm,
            "error_mm": self.error_mm,
            "error_deg": self.error_deg,
            "inside": self.inside,
        }


def drive(
    cell: RigCell,
    wish: RigWish,
    folder: Path | None = None,
    *,
    taken: Callable[[Station, RigEstimate | None], None] | None = None,
) -> RigEnd:
    """Run the loop on a cell, going on in the folder where it holds stations.

    Raises
    ------
    InputError, OutputError
        As for `open_or_create` and `run_rig`.
    """
    recording = cell.empty if folder is None else open_or_create(folder, cell.empty)
    if recording.stations:  # a real arm stands where it was left
        cell.hidden.place(recording.stations[-1].joints_rad or ())
    return run_rig(cell.world, wish, recording, folder, taken=taken)


def judged(cell: RigCell, end: RigEnd, wish: RigWish) -> RigLoopRun:
    """Compare an end with the truth."""
    request = wish.request or RigRequest()
    stated: dict[str, float] = {}
    error_mm: dict[str, float] = {}
    error_deg: dict[str, float] = {}
    inside: dict[str, bool] = {}
    if end.estimate is not None:
        true = {name: pose.inverse() for name, pose in cell.rig.camera_poses.items()}
        found = {name: (end.estimate.fit.X[name], true[name]) for name in cell.empty.cameras}
        for name, (X, X_true) in found.items():
            error = metrics.absolute_error(X, X_true)
            stated[name] = end.estimate.of_camera(name).within_95.translation_mm
            error_mm[name], error_deg[name] = error.translation_mm, error.rotation_deg
            inside[name] = (
                error.translation_mm <= request.translation_mm and error.rotation_deg <= request.rotation_deg
            )
        for a, b in rigid_pairs(end.estimate):
            between = end.estimate.camera_to_camera(a, b)
            error = metrics.absolute_error(between.pose, true[a] @ true[b].inverse())
            stated[f"{a}_{b}"] = between.within_95.translation_mm
            error_mm[f"{a}_{b}"], error_deg[f"{a}_{b}"] = error.translation_mm, error.rotation_deg
    return RigLoopRun(
        tuple(cell.empty.cameras), len(end.recording), end.reason.value, stated, error_mm, error_deg, inside
    )


@dataclass(frozen=True)
class RigLoopStudy:
    """Cells driven with all cameras at once, and with one after another."""

    wish: RigWish
    together: tuple[RigLoopRun, ...] = ()
    one_at_a_time: tuple[tuple[RigLoopRun, ...], ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        request = self.wish.request or RigRequest()
        joint = [run.stations for run in self.together]
        separate = [sum(run.stations for run in runs) for runs in self.one_at_a_time]
        met = [run for run in self.together if run.reason == "accuracy_reached"]
        cameras = [inside for run in met for inside in run.inside.values()]
        return {
            "study": "rig_loop",
            "translation_mm": request.translation_mm,
            "rotation_deg": request.rotation_deg,
            "cells": len(self.together),
            "met": len(met),
            "stations_together": float(np.mean(joint)),
            "stations_one_at_a_time": float(np.mean(separate)) if separate else None,
            "fewer": 1 - float(np.sum(joint) / np.sum(separate)) if separate else None,
            "cameras_within_request": float(np.mean(cameras)) if cameras else None,
            "cameras_counted": len(cameras),
        }


@dataclass(frozen=True)
class _Job:
    seed: int
    wish: RigWish
    separately: bool
    described: bool


def study_rig_loop(
    *,
    cells: int = 30,
    wish: RigWish | None = None,
    described: bool = True,
    separately: bool = True,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> RigLoopStudy:
    """Drive simulated rigs until a request for all cameras is met; and, separately, each camera alone.

    Raises
    ------
    HandeyeError
        As for `run_rig`.
    """
    wish = wish or RigWish()
    jobs = [_Job(seed + k, replace(wish, seed=seed + k), separately, described) for k in range(cells)]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    return RigLoopStudy(
        wish,
        tuple(runs[0] for runs in done),
        tuple(tuple(runs[1:]) for runs in done) if separately else (),
    )


def _run(job: _Job) -> list[RigLoopRun]:
    whole = rig_cell(job.seed, described=job.described)
    runs = [judged(whole, drive(whole, job.wish), job.wish)]
    if job.separately:
        for camera in whole.empty.cameras:
            alone = rig_cell(job.seed, [camera], described=job.described)
            runs.append(judged(alone, drive(alone, job.wish), job.wish))
    return runs
