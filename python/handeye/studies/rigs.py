"""Several cameras in one estimate: whether its regions are true, and what it gains over one at a time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import HandeyeError
from handeye.estimation import Measurements, RigEstimate, RigMeasurements, estimate_rig, make_estimator
from handeye.robots import ArmKinematics
from handeye.simulation.cells import ErrorKind, simulated_arm
from handeye.simulation.rigs import RigOptions, simulate_rig
from handeye.types import Pose, RigRecording, RigTruth
from handeye.types.calibration import ModelName
from handeye.validation import metrics

CELLS_PER_PIECE = 5
CAMERA, CAMERA_TO_CAMERA, TARGET = "camera", "camera_to_camera", "target"


@dataclass(frozen=True)
class RigRun:
    """One transform of one cell.

    Parameters
    ----------
    kind
        `camera` (hand-eye), `camera_to_camera` or `target`.
    name
        Of the transform.
    nees
        Of the joint estimate.
    holds
        Whether the 95 % region holds the truth.
    translation_mm, rotation_deg
        Error of the joint estimate.
    alone
        The same of cameras that were calibrated one at a time; NaN where that is not possible.
    """

    kind: str
    name: str
    nees: float
    holds: bool
    translation_mm: float
    rotation_deg: float
    alone: tuple[float, float] = (float("nan"), float("nan"))


@dataclass(frozen=True)
class RigStudy:
    """All transforms of all cells, with the arm described and not."""

    kind: ErrorKind
    seed: int
    options: RigOptions
    runs: Mapping[bool, tuple[RigRun, ...]] = field(default_factory=dict[bool, tuple[RigRun, ...]])

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "study": "rigs",
            "errors": self.kind.value,
            "seed": self.seed,
            "stations": self.options.stations,
            **{
                "arm_described" if described else "arm_not_described": {
                    kind: _summary([run for run in runs if run.kind == kind])
                    for kind in dict.fromkeys(run.kind for run in runs)
                }
                for described, runs in self.runs.items()
            },
        }


def _summary(runs: Sequence[RigRun]) -> dict[str, Any]:
    share = float(np.mean([run.holds for run in runs]))
    both = [run for run in runs if np.isfinite(run.alone[0])]
    compared: dict[str, float] = {}
    if both:
        joint = np.mean([(run.translation_mm, run.rotation_deg) for run in both], axis=0).tolist()
        alone = np.mean([run.alone for run in both], axis=0).tolist()
        compared = {
            "translation_mm_one_at_a_time": alone[0],
            "rotation_deg_one_at_a_time": alone[1],
            "share_of_translation": joint[0] / alone[0],
            "share_of_rotation": joint[1] / alone[1],
        }
    return {
        "coverage_95": share,
        "coverage_95_standard_error": float(np.sqrt(share * (1 - share) / len(runs))),
        "nees_per_dof": float(np.mean([run.nees for run in runs])) / 6,
        "translation_mm": float(np.mean([run.translation_mm for run in runs])),
        "rotation_deg": float(np.mean([run.rotation_deg for run in runs])),
        **compared,
        "transforms": len(runs),
    }


def study_rigs(
    *,
    kind: ErrorKind = ErrorKind.MIXTURE_RANDOM,
    options: RigOptions | None = None,
    described: Sequence[bool] = (True, False),
    trials: int = 100,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> RigStudy:
    """Calibrate made-up rigs, all cameras in one estimate and each on its own.

    Counts for every transform, poses of cameras in each other among them, how often the stated 95 % region
    holds the truth.

    Raises
    ------
    SolveError
        An estimate failed.
    """
    options = options or RigOptions()
    jobs = [
        _Job(kind, options, known, seed, tuple(range(i, min(i + CELLS_PER_PIECE, trials))))
        for known in described
        for i in range(0, trials, CELLS_PER_PIECE)
    ]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    return RigStudy(
        kind,
        seed,
        options,
        {
            known: tuple(
                run for job, runs in zip(jobs, done, strict=True) if job.described is known for run in runs
            )
            for known in described
        },
    )


@dataclass(frozen=True)
class _Job:
    kind: ErrorKind
    options: RigOptions
    described: bool
    seed: int
    numbers: tuple[int, ...]


def _run(job: _Job) -> list[RigRun]:
    return [run for number in job.numbers for run in _one(job, number)]


def _one(job: _Job, number: int) -> list[RigRun]:
    recording = simulate_rig(job.kind, number, job.options, seed=job.seed)
    kinematics = ArmKinematics(simulated_arm()) if job.described else None
    estimate = estimate_rig(RigMeasurements.of(recording), kinematics)
    alone = _one_at_a_time(recording, estimate, kinematics)
    truth = recording.truth or RigTruth()
    runs: list[RigRun] = []
    for name, X_true in truth.cameras.items():
        of_camera = estimate.of_camera(name)
        runs.append(
            _compared(
                CAMERA,
                name,
                (of_camera.X, of_camera.hand_eye_covariance, of_camera.degrees_of_freedom),
                X_true,
                alone.get(name),
            )
        )
    for a, b in recording.rigid_pairs():
        between = estimate.camera_to_camera(a, b)
        other = alone[a] @ alone[b].inverse() if a in alone and b in alone else None
        runs.append(
            _compared(
                CAMERA_TO_CAMERA,
                f"{a}_{b}",
                (between.pose, between.covariance, between.degrees_of_freedom),
                truth.cameras[a] @ truth.cameras[b].inverse(),
                other,
            )
        )
    for name, Y_true in truth.targets.items():
        pose = estimate.target_pose(name)
        runs.append(
            _compared(TARGET, name, (pose.pose, pose.covariance, pose.degrees_of_freedom), Y_true, None)
        )
    return runs


def _one_at_a_time(
    recording: RigRecording, estimate: RigEstimate, kinematics: ArmKinematics | None
) -> dict[str, Pose]:
    """Return X of every camera that can be calibrated on its own, from the same views."""
    found: dict[str, Pose] = {}
    for name in recording.cameras:
        target = estimate.target_of(name)
        if target is None:
            continue
        measurements = Measurements.of_recording(recording.pair(name, target))
        try:
            found[name] = make_estimator(ModelName.AUTO, kinematics)(measurements).X
        except HandeyeError:
            continue  # too few views of its own: what a rig is for
    return found


def _compared(
    kind: str, name: str, stated: tuple[Pose, Any, float], true: Pose, alone: Pose | None
) -> RigRun:
    pose, covariance, degrees = stated
    squared = metrics.nees(pose, covariance, true)
    error = metrics.absolute_error(pose, true)
    other = None if alone is None else metrics.absolute_error(alone, true)
    return RigRun(
        kind,
        name,
        squared,
        metrics.region_holds(squared, degrees),
        error.translation_mm,
        error.rotation_deg,
        (float("nan"), float("nan")) if other is None else (other.translation_mm, other.rotation_deg),
    )
