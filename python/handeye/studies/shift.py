"""Is a shift found, and named? Made-up cells: calibrated, then shifted, then checked with a few views."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye import _core
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.estimation.shift import Moved, check_views, plan_check, rows_of
from handeye.robots import ArmKinematics
from handeye.simulation.cells import MIXTURES, CellOptions, SimulatedCell, simulate_cell, simulated_arm
from handeye.types import Mounting, Pose, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName

# Views that calibrate, and those whose postures a check may go to.
CALIBRATION, POSTURES = 10, 30
RANDOM_VIEWS = (2, 3, 4, 6)
HALF = 0.5


@dataclass(frozen=True)
class ShiftStudy:
    """What is tried.

    Parameters
    ----------
    trials
        Checks of each kind of shift.
    sigmas
        Size of the shift: its displacement of the camera over the standard deviation of the position (root of
        the summed variances) that the planned views predict for a shift.
    views
        Planned views of a check.
    """

    trials: int = 100
    sigmas: float = 3.0
    views: int = 2
    arm_known: bool = True
    seed: int = 0


@dataclass(frozen=True)
class _Job:
    options: ShiftStudy
    moved: Moved
    number: int


@dataclass(frozen=True)
class Trial:
    """One check: whether it alarmed, whether it named what moved, and whether random views alarm."""

    alarm: bool
    named: bool
    random: tuple[bool, ...]
    size_mm: float


def study_shift(
    options: ShiftStudy, *, workers: Workers = 1, progress: Progress | None = None
) -> dict[str, Any]:
    """Count alarms and names.

    Raises
    ------
    SolveError
        An estimate failed.
    """
    kinds = [m for m in Moved if options.arm_known or m is not Moved.JOINT]
    jobs = [_Job(options, moved, number) for moved in kinds for number in range(options.trials)]
    done = run_all(_one, jobs, workers=workers, progress=progress)
    result: dict[str, Any] = {}
    for moved in kinds:
        trials = [trial for job, trial in zip(jobs, done, strict=True) if job.moved is moved]
        alarmed = [trial for trial in trials if trial.alarm]
        result[moved.value] = {
            "trials": len(trials),
            "alarms": float(np.mean([trial.alarm for trial in trials])),
            "named": float(np.mean([trial.named for trial in alarmed])) if alarmed else None,
            "size_mm": float(np.mean([trial.size_mm for trial in trials])),
            "random": {
                str(count): float(np.mean([trial.random[i] for trial in trials]))
                for i, count in enumerate(RANDOM_VIEWS)
            },
        }
    return {
        "study": "shift",
        "seed": options.seed,
        "sigmas": options.sigmas,
        "views": options.views,
        "arm_known": options.arm_known,
        "moved": result,
    }


def _one(job: _Job) -> Trial:
    options = job.options
    mounting = list(Mounting)[job.number % 2]
    kind = MIXTURES[job.number // 2 % len(MIXTURES)]
    count = CALIBRATION + POSTURES
    cell = simulate_cell(
        kind, job.number, CellOptions(mounting=mounting, views=(count, count)), seed=options.seed
    )
    everything = Measurements.of_recording(cell.recording)
    kinematics = ArmKinematics(simulated_arm()) if options.arm_known else None
    estimate = make_estimator(ModelName.AUTO, kinematics)(everything.select(range(CALIBRATION)))
    postures = everything.select(range(CALIBRATION, len(everything)))
    chosen, _ = plan_check(estimate, postures.motions, postures.joints, options.views)
    random = np.random.default_rng([options.seed, 3, job.number, list(Moved).index(job.moved)])
    size = options.sigmas * _sigma(estimate, postures.select(chosen))
    shifted, zeros, joint = _shifted(random, cell, job.moved, estimate, postures.select(chosen), size)

    def look(indices: list[int]) -> Measurements:
        views = [postures.views[i] for i in indices]
        return Measurements.of(
            mounting,
            cell.recording.camera,
            cell.recording.target,
            [picture(random, shifted, zeros, view) for view in views],
        )

    check = check_views(estimate, look(chosen))
    named = check.moved is job.moved and (not joint or check.causes[0].joint == joint)
    alarms = [
        check_views(estimate, look([int(i) for i in random.permutation(len(postures))[:count]])).alarm
        for count in RANDOM_VIEWS
    ]
    return Trial(check.alarm, named, tuple(alarms), 1e3 * size)


def _sigma(estimate: Estimate, views: Measurements) -> float:
    """Predicted standard deviation of a shift of the camera, root of the summed variances, metres."""
    rows = rows_of(estimate, views)
    columns = rows.shifts[Moved.CAMERA, ""]
    covariance = np.linalg.inv(columns.T @ np.linalg.solve(rows.covariance, columns))
    return float(np.sqrt(np.trace(covariance[:3, :3])))


def _shifted(
    random: np.random.Generator,
    cell: SimulatedCell,
    moved: Moved,
    estimate: Estimate,
    views: Measurements,
    size_m: float,
) -> tuple[SimulatedCell, FloatArray, str]:
    """Return the cell after a shift, the zeros of its joints (n,), and the joint that moved."""
    zeros: FloatArray = np.zeros(len(simulated_arm()))
    away = random.standard_normal(3)
    twist: FloatArray = np.zeros(6)
    twist[:3] = size_m * away / float(np.linalg.norm(away))
    shift = Pose.exp(twist)
    if moved is Moved.CAMERA:
        return replace(cell, X=shift @ cell.X), zeros, ""
    if moved is Moved.BOARD:
        return replace(cell, Y=cell.Y @ shift), zeros, ""
    if moved is Moved.NOTHING or estimate.arm is None:
        return cell, zeros, ""
    joint = int(random.choice(estimate.arm.free))
    name = estimate.arm.kinematics.joint_names[joint]
    columns = rows_of(estimate, views).shifts[Moved.JOINT, name].reshape(-1, 6)
    lever = float(np.linalg.norm(columns[:, :3])) / len(columns) ** 0.5
    zeros[joint] = size_m / lever * (1.0 if random.uniform() < HALF else -1.0)
    return cell, zeros, name


def picture(random: np.random.Generator, cell: SimulatedCell, zeros: FloatArray, view: View) -> View:
    """Take the picture of a view again in a cell that may have shifted."""
    if cell.arm is None or view.joints_rad is None:
        raise AssertionError  # of a mixture
    joints = np.array([view.joints_rad])
    flange = Pose(cell.arm.stand(random, joints + zeros)[0])
    target = cell.recording.target
    seen = cell.X @ cell.recording.mounting.chain(flange) @ cell.Y
    pixels, _ = _core.project_features(
        cell.camera.lens, cell.camera.parameters, seen.matrix, target.points, target.radii_m
    )
    noise = cell.pixel_sigma_px * random.standard_normal(pixels.shape)
    return View(
        f"check_{view.name}", view.T_base_flange, view.point_ids, pixels + noise, joints_rad=view.joints_rad
    )
