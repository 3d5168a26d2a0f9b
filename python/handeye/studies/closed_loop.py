"""The closed loop on simulated cells whose truth is hidden: the same cells and starts under every policy."""

import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.compute.parallel import Progress, run_all
from handeye.errors import InputError, SolveError
from handeye.estimation import Estimate
from handeye.estimation.confidence import Within
from handeye.session.configuration import begin, prepare
from handeye.session.deciding import START_VIEWS
from handeye.session.entry import Entry
from handeye.session.observer import Observer
from handeye.session.settings import Configuration, Simulation
from handeye.studies.comparison import POLICIES
from handeye.types import Pose
from handeye.types.arrays import FloatArray
from handeye.types.units import MM_PER_M
from handeye.validation.metrics import summary

_WORDS = {
    "next_best_view": "views chosen for their gain",
    "random": "random views",
    "max_distance": "the most distant views",
}


@dataclass(frozen=True)
class LoopOptions:
    """What is driven.

    Parameters
    ----------
    cells
        Number of cells, each with a truth of its own.
    added_views
        Views that a policy adds to three small turns at the start.
    seed
        Of the first cell; the others follow.
    robot
        The arm.
    points_only
        Sigma in px of points that are projected; None to render pictures and look for the target in them.

    Raises
    ------
    InputError
        No cell or no view.
    """

    cells: int = 4
    added_views: int = 5
    seed: int = 0
    robot: str = "epson_c4l"
    points_only: float | None = None

    def __post_init__(self) -> None:
        if self.cells < 1 or self.added_views < 1 or self.seed < 0:
            raise InputError(
                f"{self.cells} cells, {self.added_views} views, seed {self.seed}: expected at least 1, 1, 0",
                code=Code.OUT_OF_RANGE,
            )

    @property
    def views(self) -> tuple[int, ...]:
        """Numbers of views after which there is an answer."""
        return tuple(range(START_VIEWS, START_VIEWS + self.added_views + 1))

    def configuration(self, policy: str, seed: int) -> Configuration:
        """Return one run: so many views, whatever the accuracy."""
        return Configuration(
            self.robot,
            accuracy_mm=None,
            accuracy_deg=None,
            most_views=self.views[-1],
            seed=seed,
            policy=policy,
            simulation=Simulation(points_only=self.points_only),
        )


@dataclass(frozen=True, eq=False)
class Drive:
    """One run of the loop.

    Parameters
    ----------
    translation_mm, rotation_deg
        (V,) error of the camera's pose against the truth after each number of views.
    within_mm, within_deg
        (V,) radii within which it lies with 95 % probability by its own account.
    entries
        Everything that was tried.
    X, Y
        The answer.
    """

    policy: str
    seed: int
    translation_mm: FloatArray
    rotation_deg: FloatArray
    within_mm: FloatArray
    within_deg: FloatArray
    entries: tuple[Entry, ...]
    X: Pose
    Y: Pose

    @property
    def inside(self) -> bool:
        """Whether the truth lies within both radii at the end."""
        return bool(
            self.translation_mm[-1] <= self.within_mm[-1] and self.rotation_deg[-1] <= self.within_deg[-1]
        )


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """All cells under all policies; `folder` keeps the session of the first cell under the first policy."""

    options: LoopOptions
    drives: Mapping[str, tuple[Drive, ...]]
    folder: Path

    @property
    def shown(self) -> Drive:
        """The run whose session is kept."""
        return self.drives[POLICIES[0]][0]

    def values(self, policy: str, name: str) -> FloatArray:
        """(cells, views) values of a quantity of `Drive`."""
        return np.array([getattr(drive, name) for drive in self.drives[policy]])

    @property
    def sentence(self) -> str:
        """What it shows, in one sentence that the numbers decide."""
        final = {policy: float(self.values(policy, "translation_mm")[:, -1].mean()) for policy in POLICIES}
        best, *rest = sorted(POLICIES, key=lambda policy: final[policy])
        others = " and ".join(f"{_WORDS[policy]} {final[policy]:.2g} mm" for policy in rest)
        taken = f"After {START_VIEWS} + {self.options.added_views} views"
        return f"{taken}, {_WORDS[best]} leave the camera {final[best]:.2g} mm off on average, {others}."

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys; lists run over the number of views."""
        shown = self.shown
        return {
            "robot": self.options.robot,
            "cells": self.options.cells,
            "seed": self.options.seed,
            "views": list(self.options.views),
            "policies": {policy: self._policy(policy) for policy in POLICIES},
            "shown": {
                "seed": shown.seed,
                "translation_mm": float(shown.translation_mm[-1]),
                "rotation_deg": float(shown.rotation_deg[-1]),
                "within_95": {
                    "translation_mm": float(shown.within_mm[-1]),
                    "rotation_deg": float(shown.within_deg[-1]),
                },
            },
            "sentence": self.sentence,
        }

    def _policy(self, policy: str) -> dict[str, Any]:
        curves = ("translation_mm", "rotation_deg", "within_mm", "within_deg")
        return {
            **{name: self.values(policy, name).mean(axis=0).tolist() for name in curves},
            "final_translation_mm": summary(self.values(policy, "translation_mm")[:, -1]),
            "inside": sum(drive.inside for drive in self.drives[policy]),
        }


def drive_cells(
    options: LoopOptions, folder: Path, *, workers: int = 1, progress: Progress | None = None
) -> ClosedLoop:
    """Drive every cell under every policy; the result does not depend on the number of workers.

    Parameters
    ----------
    folder
        A new folder, for the session of the first cell under the next-best-view policy.

    Raises
    ------
    OutputError
        The folder is not empty or cannot be written.
    SolveError
        A run ended without an answer.
    """
    jobs = [
        _Job(options, options.seed + cell, policy, folder if (cell, policy) == (0, POLICIES[0]) else None)
        for cell in range(options.cells)
        for policy in POLICIES
    ]
    done = run_all(_drive, jobs, workers=workers, progress=progress)
    drives = {policy: tuple(drive for drive in done if drive.policy == policy) for policy in POLICIES}
    return ClosedLoop(options, drives, folder)


@dataclass(frozen=True)
class _Job:
    options: LoopOptions
    seed: int
    policy: str
    folder: Path | None


def _drive(job: _Job) -> Drive:
    if job.folder is not None:
        return _driven(job, job.folder)
    scratch = Path(tempfile.mkdtemp(prefix="handeye-"))
    try:
        return _driven(job, scratch / "session")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


class _Memory(Observer):
    """Remembers what was believed after each number of views."""

    def __init__(self) -> None:
        self.known: dict[int, Estimate] = {}
        self._views = 0

    def taken(self, entry: Entry, estimate: Estimate | None) -> None:
        """Remember the estimate, which is the one before this attempt."""
        if estimate is not None:
            self.known[self._views] = estimate
        self._views += entry.view is not None


def _driven(job: _Job, folder: Path) -> Drive:
    memory = _Memory()
    prepared = prepare(job.options.configuration(job.policy, job.seed), observer=memory)
    if prepared.truth is None or prepared.truth.X is None:
        raise SolveError("a simulated cell without truth")
    session, store = begin(prepared, folder)
    try:
        end = session.run()
        store.reveal(prepared.truth)
        entries = store.entries
    finally:
        store.close()
    answer = end.calibration
    if answer is None or end.reach is None:
        raise SolveError(f"cell {job.seed}, {job.policy}: {end.sentence}", code=end.reason)
    numbers = job.options.views
    # A run that ends early keeps what it has.
    earlier = [memory.known[views] for views in numbers[:-1] if views in memory.known]
    rows = [_row(estimate.X, estimate.within_95, prepared.truth.X) for estimate in earlier]
    rows += [_row(answer.X, end.reach, prepared.truth.X)] * (len(numbers) - len(rows))
    mm, deg, within_mm, within_deg = np.array(rows).T
    return Drive(job.policy, job.seed, mm, deg, within_mm, within_deg, entries, answer.X, answer.Y)


def _row(X: Pose, promised: Within, X_true: Pose) -> tuple[float, float, float, float]:
    """Return the error as the promise means it: of the camera's centre, and of its rotation."""
    off = (X @ X_true.inverse()).log()
    mm, deg = MM_PER_M * float(np.linalg.norm(off[:3])), float(np.rad2deg(np.linalg.norm(off[3:])))
    return mm, deg, promised.translation_mm, promised.rotation_deg


def camera_poses(drive: Drive) -> Sequence[Pose]:
    """Return where the camera stood in the base at every view, by the answer; for a camera in the hand."""
    T_flange_camera = drive.X.inverse()
    return [entry.view.T_base_flange @ T_flange_camera for entry in drive.entries if entry.view is not None]
