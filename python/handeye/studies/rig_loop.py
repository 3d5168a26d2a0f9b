"""A simulated rig driven until all cameras are as accurate as asked; and the same one camera at a time."""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.estimation import RigEstimate
from handeye.planning.rig_request import RigRequest, rigid_pairs
from handeye.session.deciding import EndReason
from handeye.session.rig import RigEnd
from handeye.session.rig_choosing import request_of
from handeye.session.rig_prepared import RigPrepared, begin_rig
from handeye.session.settings import Configuration, RigSettings
from handeye.studies.rig_cell import ARM, rig_cell
from handeye.types import Pose
from handeye.validation import metrics

# A run of the study ends with so many stations in any case.
MOST_STATIONS = 60


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


def judged(prepared: RigPrepared, end: RigEnd) -> RigLoopRun:
    """Compare an end with the truth."""
    request = request_of(prepared.configuration.wish())
    names = tuple(prepared.recording.cameras)
    if end.estimate is None or prepared.truth is None:
        return RigLoopRun(names, end.stations, end.reason.value, {}, {}, {}, {})
    stated: dict[str, float] = {}
    error_mm: dict[str, float] = {}
    error_deg: dict[str, float] = {}
    inside: dict[str, bool] = {}
    for name, found, true, stated_mm in _compared(end.estimate, prepared.truth.cameras):
        error = metrics.absolute_error(found, true)
        stated[name] = stated_mm
        error_mm[name], error_deg[name] = error.translation_mm, error.rotation_deg
        if request is not None and name in names:
            inside[name] = (
                error.translation_mm <= request.translation_mm and error.rotation_deg <= request.rotation_deg
            )
    return RigLoopRun(names, end.stations, end.reason.value, stated, error_mm, error_deg, inside)


def _compared(estimate: RigEstimate, true: Mapping[str, Pose]) -> list[tuple[str, Pose, Pose, float]]:
    """Return name, pose found, pose that is true and stated radius: of cameras, and of them in each other."""
    found = [
        (name, X, true[name], estimate.of_camera(name).within_95.translation_mm)
        for name, X in estimate.fit.X.items()
    ]
    for a, b in rigid_pairs(estimate):
        between = estimate.camera_to_camera(a, b)
        found.append(
            (f"{a}_{b}", between.pose, true[a] @ true[b].inverse(), between.within_95.translation_mm)
        )
    return found


@dataclass(frozen=True)
class RigLoopStudy:
    """Cells driven with all cameras at once, and with one after another."""

    configuration: Configuration
    together: tuple[RigLoopRun, ...] = ()
    one_at_a_time: tuple[tuple[RigLoopRun, ...], ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        request = request_of(self.configuration.wish()) or RigRequest()
        joint = [run.stations for run in self.together]
        separate = [sum(run.stations for run in runs) for runs in self.one_at_a_time]
        met = [run for run in self.together if run.reason == EndReason.ACCURACY_REACHED]
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


def asked_of_rig(seed: int) -> Configuration:
    """Return what the study asks for: every camera within 0.5 mm and 0.05 deg, at most so many stations."""
    return Configuration(ARM, most_views=MOST_STATIONS, seed=seed, rig=RigSettings())


@dataclass(frozen=True)
class _Job:
    configuration: Configuration
    separately: bool


def study_rig_loop(
    *,
    cells: int = 30,
    configuration: Configuration | None = None,
    separately: bool = True,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> RigLoopStudy:
    """Drive simulated rigs until a request for all cameras is met; and, separately, each camera alone.

    Raises
    ------
    HandeyeError
        As for `handeye.session.rig.RigSession.run`.
    """
    asked = configuration or asked_of_rig(seed)
    jobs = [_Job(replace(asked, seed=seed + k), separately) for k in range(cells)]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    return RigLoopStudy(
        asked,
        tuple(runs[0] for runs in done),
        tuple(tuple(runs[1:]) for runs in done) if separately else (),
    )


def _run(job: _Job) -> list[RigLoopRun]:
    asked = job.configuration
    whole = rig_cell(asked)
    alone = [(name,) for name in whole.recording.cameras] if job.separately else []
    cells = [whole, *(rig_cell(replace(asked, rig=RigSettings(cameras=one))) for one in alone)]
    return [_driven(cell) for cell in cells]


def _driven(prepared: RigPrepared) -> RigLoopRun:
    with tempfile.TemporaryDirectory() as name:
        session, store = begin_rig(prepared, Path(name) / "session")
        try:
            return judged(prepared, session.run())
        finally:
            store.close()
