"""Is an arm that was put right nearer to the truth where nobody looked? Made-up arms with wrong links.

Views are planned for it one by one out of a pool: worth what they take off the error of the tool at postures
of the work. Then the tool's error at other postures, as described and put right, beside what is stated. Where
base and flange are no view can tell, and every use of a calibration finds them again with it: errors are
counted up to a motion of both.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye import _core
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.estimation.confidence import radii
from handeye.planning.prediction import Sight, gains
from handeye.robots import ArmKinematics
from handeye.robots.corrected import corrected_arm
from handeye.simulation.cells import TARGET, CellOptions, ErrorKind, simulate_cell, simulated_arm
from handeye.simulation.mixed_arm import MixedArm, log_uniform
from handeye.studies.shift import picture
from handeye.types import Mounting
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.types.pose import through_twist

TOOL_M = (0.0, 0.0, 0.15)
# Views before any are planned, and how far unseen postures are from those of the views.
START, AWAY_RAD = 8, 0.3
WORK_POSTURES = 100
# Boards are off by this share, what the model believes of boards: a larger arm and a larger board look alike.
BOARD_SCALES = (2.5e-5, 5e-4)


@dataclass(frozen=True)
class ArmStudy:
    """What is tried: arms, views of each, views that can be chosen from, and unseen postures."""

    arms: int = 50
    views: int = 30
    pool: int = 150
    postures: int = 1000
    seed: int = 0


@dataclass(frozen=True)
class _Job:
    options: ArmStudy
    number: int


@dataclass(frozen=True)
class ArmResult:
    """One arm: mean errors of the tool before and after, millimetres, and the share within what is stated."""

    described_mm: float
    corrected_mm: float
    held: float


def study_arm(options: ArmStudy, *, workers: Workers = 1, progress: Progress | None = None) -> dict[str, Any]:
    """Compare arms as described and as put right with the truth.

    Raises
    ------
    SolveError
        An estimate failed.
    """
    jobs = [_Job(options, number) for number in range(options.arms)]
    done = run_all(_one, jobs, workers=workers, progress=progress)
    ratios = np.array([arm.described_mm / arm.corrected_mm for arm in done])
    return {
        "study": "arm",
        "seed": options.seed,
        "arms": options.arms,
        "views": options.views,
        "postures": options.postures,
        "described_mm": float(np.mean([arm.described_mm for arm in done])),
        "corrected_mm": float(np.mean([arm.corrected_mm for arm in done])),
        "ratio": float(np.mean([a.described_mm for a in done]) / np.mean([a.corrected_mm for a in done])),
        "median_ratio": float(np.median(ratios)),
        "held": float(np.mean([arm.held for arm in done])),
    }


def _one(job: _Job) -> ArmResult:
    options = job.options
    mounting = list(Mounting)[job.number % 2]
    random = np.random.default_rng([options.seed, 12, job.number])
    true_arm = _wrong_arm(random)
    larger = log_uniform(random, BOARD_SCALES) * random.standard_normal()
    true_board = replace(TARGET, pitch_m=TARGET.pitch_m * (1 + larger))
    cell = simulate_cell(
        ErrorKind.MIXTURE_CELL,
        job.number,
        CellOptions(mounting=mounting, target=true_board, views=(options.pool, options.pool)),
        seed=options.seed,
    )
    cell = replace(cell, arm=true_arm)
    zeros = np.zeros(len(simulated_arm()))
    views = [picture(random, cell, zeros, view) for view in cell.recording.views]
    everything = Measurements.of(mounting, cell.recording.camera, TARGET, views)
    seen = everything.joints
    work = _near(random, seen, WORK_POSTURES)
    estimator = make_estimator(ModelName.AUTO, ArmKinematics(simulated_arm()))
    chosen = list(range(START))
    estimate = estimator(everything.select(chosen))
    while len(chosen) < options.views:
        left = [i for i in range(len(everything)) if i not in chosen]
        pool = everything.select(left)
        criterion = _core.Criterion("task", tasks=_up_to_frames(estimate, work))
        worth = gains(estimate, criterion, pool.motions, Sight(known=True), joints=pool.joints)
        chosen.append(left[int(np.nanargmax(worth))])
        estimate = estimator(everything.select(chosen), estimate)
    postures = _near(random, seen, options.postures)
    truth = _tools(true_arm.built.forward(postures + true_arm.offsets_rad))
    arm = simulated_arm()
    correction, model = estimate.arm_correction, estimate.arm
    if correction is None or model is None:
        raise AssertionError  # the arm is described
    twists = model.kinematics.link_twists @ correction.displacements
    built = corrected_arm(arm, twists, correction.joint_offsets)
    frames = _frame_columns(arm.forward(postures))
    described = _without_frames(_tools(arm.forward(postures)) - truth, frames)
    corrected = _without_frames(_tools(built.forward(postures)) - truth, frames)
    rows = _up_to_frames(estimate, postures)
    covariances: FloatArray = rows @ estimate.covariance @ np.swapaxes(rows, 1, 2)
    within = radii(covariances, estimate.degrees_of_freedom)
    off = np.asarray(np.linalg.norm(corrected, axis=1), np.float64)
    return ArmResult(
        1e3 * float(np.linalg.norm(described, axis=1).mean()),
        1e3 * float(off.mean()),
        float(np.mean(off <= within)),
    )


def _wrong_arm(random: np.random.Generator) -> MixedArm:
    """Draw an arm whose links nobody has measured: levels log-uniform over half a decade."""
    levels = {
        "encoder_deg": log_uniform(random, (0.003, 0.01)),
        "offset_deg": log_uniform(random, (0.02, 0.1)),
        "length_m": log_uniform(random, (0.2e-3, 1e-3)),
        "twist_deg": log_uniform(random, (0.01, 0.05)),
        "play_deg": log_uniform(random, (0.003, 0.01)),
        "pose_m": 0.0,
        "pose_deg": 0.0,
    }
    return MixedArm.of_levels(random, simulated_arm(), levels)


def _near(random: np.random.Generator, seen: FloatArray, count: int) -> FloatArray:
    """Draw postures (count, n) that nobody looked at, near those (K, n) of the pool."""
    away = random.uniform(-AWAY_RAD, AWAY_RAD, (count, seen.shape[1]))
    return seen[random.integers(0, len(seen), count)] + away


def _tools(flanges: FloatArray) -> FloatArray:
    return flanges[:, :3, :3] @ np.array(TOOL_M) + flanges[:, :3, 3]


def _frame_columns(flanges: FloatArray) -> FloatArray:
    """(Q, 3, 12) how tools move with twists of the base and of the flange."""
    count = len(flanges)
    of_base = through_twist(_tools(flanges), np.broadcast_to(np.eye(3), (count, 3, 3)))
    of_flange = through_twist(np.tile(TOOL_M, (count, 1)), flanges[:, :3, :3])
    return np.concatenate([of_base, of_flange], axis=2)


def _without_frames(errors: FloatArray, frames: FloatArray) -> FloatArray:
    """Errors (Q, 3) or columns of them (Q, 3, n), less what motions of base and flange explain of them."""
    flat = errors.reshape(3 * len(errors), -1)
    columns = frames.reshape(3 * len(frames), -1)
    explained = columns @ np.linalg.lstsq(columns, flat, rcond=1e-10)[0]
    return (flat - explained).reshape(errors.shape)


def _up_to_frames(estimate: Estimate, postures: FloatArray) -> FloatArray:
    """(Q, 3, n) how the tool's error at postures depends on the parameters of the estimate."""
    arm = estimate.arm
    if arm is None:
        raise AssertionError  # the arm is described
    flanges = simulated_arm().forward(postures)
    _, constants = arm.candidates(Mounting.EYE_TO_HAND, postures, 0.0)
    of_base = through_twist(_tools(flanges), np.broadcast_to(np.eye(3), (len(flanges), 3, 3)))
    moved = _without_frames(of_base @ constants, _frame_columns(flanges))
    rows = np.zeros((len(postures), 3, len(estimate.covariance)))
    rows[:, :, -arm.constants :] = moved
    return rows
