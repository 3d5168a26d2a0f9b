"""Is the covariance true? Simulated calibrations with errors of a known kind, counted."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.estimation import Measurements, make_estimator
from handeye.robots import ArmKinematics
from handeye.simulation.cells import MIXTURES, CellOptions, ErrorKind, simulate, simulated_arm
from handeye.studies.protocol import true_hand_eye
from handeye.types.calibration import ModelName
from handeye.types.units import MM_PER_M
from handeye.validation import metrics

RUNS_PER_PIECE = 10


@dataclass(frozen=True)
class Case:
    """A kind of error, and whether the arm's kinematics are known to the estimate."""

    name: str
    kind: ErrorKind
    arm_known: bool = False


CASES = (
    Case("pixel_only", ErrorKind.PIXEL_ONLY),
    Case("white_flange", ErrorKind.WHITE_FLANGE),
    Case("white_base", ErrorKind.WHITE_BASE),
    Case("encoder", ErrorKind.ENCODER, arm_known=True),
    Case("joint_offsets", ErrorKind.JOINT_OFFSETS, arm_known=True),
    Case("smooth_kinematic", ErrorKind.SMOOTH_KINEMATIC),
    Case("wrong_intrinsics", ErrorKind.WRONG_INTRINSICS),
    Case("encoder_arm_unknown", ErrorKind.ENCODER),
    Case("joint_offsets_arm_unknown", ErrorKind.JOINT_OFFSETS),
    Case("smooth_kinematic_arm_known", ErrorKind.SMOOTH_KINEMATIC, arm_known=True),
    *(Case(kind.value, kind, arm_known=True) for kind in MIXTURES),
    *(Case(f"{kind.value}_arm_unknown", kind) for kind in MIXTURES),
    Case("same_pictures", ErrorKind.SAME_PICTURES),
    Case("same_pictures_mixture", ErrorKind.SAME_PICTURES_MIXTURE, arm_known=True),
    Case("board_scale_0_1_percent", ErrorKind.BOARD_SCALE),
    Case("focal_0_3_percent", ErrorKind.FOCAL),
    Case("pixel_field", ErrorKind.PIXEL_FIELD),
    Case("robot_noise_1_deg", ErrorKind.ROBOT_NOISE_1_DEG),
)


@dataclass(frozen=True)
class Run:
    """One simulated calibration: its NEES, whether the 95 % region holds the truth, its error."""

    nees: float
    holds: bool
    translation_mm: float
    rotation_deg: float
    sigma_translation_mm: float


@dataclass(frozen=True)
class Coverage:
    """All simulated calibrations per kind of error."""

    model: ModelName
    seed: int
    cell: CellOptions
    kinds: dict[Case, tuple[Run, ...]] = field(default_factory=dict[Case, tuple[Run, ...]])

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "study": "coverage",
            "model": self.model.value,
            "mounting": self.cell.mounting.value,
            "seed": self.seed,
            "views": list(self.cell.views),
            "kinds": {case.name: _kind(case, runs) for case, runs in self.kinds.items()},
        }


def _kind(case: Case, runs: Sequence[Run]) -> dict[str, Any]:
    nees = np.array([run.nees for run in runs]) / 6
    share = float(np.mean([run.holds for run in runs]))
    return {
        "coverage_95": share,
        "coverage_95_standard_error": float(np.sqrt(share * (1 - share) / len(runs))),
        "nees_per_dof": float(np.mean(nees)),
        "nees_per_dof_standard_error": float(np.std(nees) / np.sqrt(len(runs))),
        "nees_per_dof_median": float(np.median(nees)),
        "translation_mm": float(np.mean([run.translation_mm for run in runs])),
        "rotation_deg": float(np.mean([run.rotation_deg for run in runs])),
        "sigma_translation_mm": float(np.mean([run.sigma_translation_mm for run in runs])),
        "arm_known": case.arm_known,
        "trials": len(runs),
    }


def study_coverage(
    *,
    cases: Sequence[Case] = CASES,
    model: ModelName = ModelName.AUTO,
    cell: CellOptions | None = None,
    trials: int = 500,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Coverage:
    """Calibrate `trials` made-up cells for each kind of error.

    Counts how often the region ``d' C^-1 d <= 6 F_0.95(6, nu)`` holds the truth, ``d = log(X_true inv(X))``,
    and takes the mean of the NEES over its six degrees of freedom. True covariances give 0.95 and 1.

    Raises
    ------
    SolveError
        An estimate failed.
    """
    cell = cell or CellOptions()
    jobs = [
        _Job(case, ModelName(model), cell, seed, tuple(range(i, min(i + RUNS_PER_PIECE, trials))))
        for case in cases
        for i in range(0, trials, RUNS_PER_PIECE)
    ]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    results = {
        case: tuple(run for job, runs in zip(jobs, done, strict=True) if job.case is case for run in runs)
        for case in cases
    }
    return Coverage(ModelName(model), seed, cell, results)


@dataclass(frozen=True)
class _Job:
    case: Case
    model: ModelName
    cell: CellOptions
    seed: int
    numbers: tuple[int, ...]


def _run(job: _Job) -> list[Run]:
    return [_one(job, number) for number in job.numbers]


def _one(job: _Job, number: int) -> Run:
    recording = simulate(job.case.kind, number, job.cell, seed=job.seed)
    kinematics = ArmKinematics(simulated_arm()) if job.case.arm_known else None
    estimate = make_estimator(job.model, kinematics)(Measurements.of_recording(recording))
    X_true = true_hand_eye(recording)
    covariance = estimate.hand_eye_covariance
    squared = metrics.nees(estimate.X, covariance, X_true)
    error = metrics.absolute_error(estimate.X, X_true)
    return Run(
        squared,
        metrics.region_holds(squared, estimate.degrees_of_freedom),
        error.translation_mm,
        error.rotation_deg,
        MM_PER_M * float(np.sqrt(np.trace(covariance[:3, :3]))),
    )
