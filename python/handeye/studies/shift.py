"""Is a shift found, and named? Made-up cells: calibrated, then shifted, then checked with a few views."""

from collections.abc import Sequence
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
    kinds = shifts_of(options)
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


def shifts_of(options: ShiftStudy) -> list[Moved]:
    """Return the kinds of shift that can be looked for; zeros of joints only where the arm is described."""
    return [moved for moved in Moved if options.arm_known or moved is not Moved.JOINT]


@dataclass(frozen=True, eq=False)
class Cell:
    """A cell as it stands, and the zeros of its joints (n,)."""

    cell: SimulatedCell
    zeros: FloatArray
    postures: Measurements

    def views(self, random: np.random.Generator, indices: Sequence[int]) -> Measurements:
        """Take pictures at postures."""
        recording = self.cell.recording
        views = [picture(random, self.cell, self.zeros, self.postures.views[i]) for i in indices]
        return Measurements.of(recording.mounting, recording.camera, recording.target, views)


@dataclass(frozen=True, eq=False)
class CheckedCell:
    """A cell that was calibrated, the postures a check may go to, and those that were planned."""

    still: Cell
    estimate: Estimate
    chosen: list[int]
    size_m: float

    @classmethod
    def draw(cls, options: ShiftStudy, number: int) -> "CheckedCell":
        """Draw and calibrate one, and plan its check."""
        mounting = list(Mounting)[number % 2]
        kind = MIXTURES[number // 2 % len(MIXTURES)]
        count = CALIBRATION + POSTURES
        cell = simulate_cell(
            kind, number, CellOptions(mounting=mounting, views=(count, count)), seed=options.seed
        )
        everything = Measurements.of_recording(cell.recording)
        kinematics = ArmKinematics(simulated_arm()) if options.arm_known else None
        estimate = make_estimator(ModelName.AUTO, kinematics)(everything.select(range(CALIBRATION)))
        postures = everything.select(range(CALIBRATION, len(everything)))
        chosen, _ = plan_check(estimate, postures.motions, postures.joints, options.views)
        size = options.sigmas * _sigma(estimate, postures.select(chosen))
        return cls(Cell(cell, np.zeros(len(simulated_arm())), postures), estimate, chosen, size)

    def shifted(self, random: np.random.Generator, moved: Moved) -> "Shifted":
        """Shift something in it."""
        views = self.still.postures.select(self.chosen)
        cell, zeros, joint = _shifted(random, self.still.cell, moved, self.estimate, views, self.size_m)
        return Shifted(cell, zeros, self.still.postures, joint)


@dataclass(frozen=True, eq=False)
class Shifted(Cell):
    """A cell after a shift, and the joint that moved, if it was one."""

    joint: str


def _one(job: _Job) -> Trial:
    checked = CheckedCell.draw(job.options, job.number)
    random = np.random.default_rng([job.options.seed, 3, job.number, list(Moved).index(job.moved)])
    shifted = checked.shifted(random, job.moved)
    check = check_views(checked.estimate, shifted.views(random, checked.chosen))
    named = check.moved is job.moved and (not shifted.joint or check.causes[0].joint == shifted.joint)
    alarms = [
        check_views(
            checked.estimate, shifted.views(random, random.permutation(POSTURES)[:count].tolist())
        ).alarm
        for count in RANDOM_VIEWS
    ]
    return Trial(check.alarm, named, tuple(alarms), 1e3 * checked.size_m)


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
