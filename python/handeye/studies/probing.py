"""Does touching find a board of another size? Made-up cells whose board is larger than it is stated to be.

Everything else is wrong a little too. Halves of the views are compared and residuals looked at, as people do,
and three corners are touched with a tool whose tip is known to a few tenths of a millimetre, or, with the
camera beside the robot and the board on the flange, with a tip in the cell of which nobody knows where it is.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import SolveError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.estimation.difference import UNLIKELY, difference
from handeye.estimation.probing import verify
from handeye.robots import ArmKinematics
from handeye.simulation.cells import (
    MIXTURES,
    TARGET,
    CellOptions,
    SimulatedCell,
    simulate_cell,
    simulated_arm,
)
from handeye.types import Chessboard, Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.types.pose import inverses
from handeye.types.probing import UNKNOWN_M, Probing, Tip, Touch
from handeye.types.rig import Body
from handeye.validation import metrics

# How well a person meets a corner, and knows the tip of the tool.
TOUCH_SIGMA_M, TOOL_SIGMA_M = 1e-4, 3e-4
TOOL_M = (0.0, 0.0, 0.15)
_TRIES = 60


@dataclass(frozen=True)
class ProbingStudy:
    """What is tried: cells with the arm described and not in turn, and the true size of their boards."""

    cells: int = 100
    board_scale: float = 5e-3
    seed: int = 0


@dataclass(frozen=True)
class _Job:
    options: ProbingStudy
    number: int


@dataclass(frozen=True)
class ProbedCell:
    """One cell: what halves, residuals and touches say, and whether the regions hold the truth."""

    halves_differ: bool
    residual_ratio: float
    alarm: bool
    named: bool
    held: bool
    held_with_touches: bool
    scale_error_sigmas: float


def study_probing(
    options: ProbingStudy, *, workers: Workers = 1, progress: Progress | None = None
) -> dict[str, Any]:
    """Count what finds a board of another size.

    Raises
    ------
    SolveError
        An estimate failed, or a corner cannot be reached.
    """
    jobs = [_Job(options, number) for number in range(options.cells)]
    done = run_all(_one, jobs, workers=workers, progress=progress)

    def share(name: str) -> float:
        return float(np.mean([getattr(cell, name) for cell in done]))

    return {
        "study": "probing",
        "seed": options.seed,
        "cells": options.cells,
        "board_scale": options.board_scale,
        "halves_differ": share("halves_differ"),
        "residual_ratio": share("residual_ratio"),
        "alarms": share("alarm"),
        "named": share("named"),
        "held": share("held"),
        "held_with_touches": share("held_with_touches"),
        "scale_error_sigmas": float(np.sqrt(np.mean([cell.scale_error_sigmas**2 for cell in done]))),
    }


def _one(job: _Job) -> ProbedCell:
    options = job.options
    mounting = list(Mounting)[job.number % 2]
    kind = MIXTURES[job.number // 4 % len(MIXTURES)]
    true_board = Chessboard(TARGET.rows, TARGET.columns, TARGET.pitch_m * (1 + options.board_scale))
    cell = simulate_cell(
        kind, job.number, CellOptions(mounting=mounting, target=true_board), seed=options.seed
    )
    cell = replace(cell, recording=replace(cell.recording, target=TARGET))
    kinematics = ArmKinematics(simulated_arm()) if job.number // 2 % 2 == 0 else None
    estimator = make_estimator(ModelName.AUTO, kinematics)
    measurements = Measurements.of_recording(cell.recording)
    estimate = estimator(measurements)
    halves = [estimator(measurements.select(range(first, len(measurements), 2))) for first in (0, 1)]
    sides = [(half.X, half.hand_eye_covariance, half.degrees_of_freedom) for half in halves]
    random = np.random.default_rng([options.seed, 11, job.number])
    probing = touch_corners(random, cell, true_board.points)
    together = make_estimator(ModelName.AUTO, kinematics, probing=probing)(measurements, estimate)
    found = verify(estimate, together, probing)
    at = 12 + len(together.free_camera)
    off = ((together.board_scale or 0.0) - options.board_scale) / float(together.covariance[at, at]) ** 0.5
    return ProbedCell(
        halves_differ=difference(sides[0], sides[1]).p_value < UNLIKELY,
        residual_ratio=float(np.mean(estimate.noise.pixel_sigma_px)) / cell.pixel_sigma_px,
        alarm=found.alarm,
        named=found.verdict == "board_size",
        held=_holds(estimate, cell.X),
        held_with_touches=_holds(together, cell.X),
        scale_error_sigmas=off,
    )


def _holds(estimate: Estimate, X: Pose) -> bool:
    xi = (estimate.X @ X.inverse()).log()
    squared = float(xi @ np.linalg.solve(estimate.hand_eye_covariance, xi))
    return metrics.region_holds(squared, estimate.degrees_of_freedom)


def touch_corners(random: np.random.Generator, cell: SimulatedCell, points: FloatArray) -> Probing:
    """Touch three corners of the board: the arm is moved until the tip truly is there.

    Raises
    ------
    SolveError
        The corners cannot be reached.
    """
    in_hand = cell.recording.mounting is Mounting.EYE_IN_HAND
    rows, columns = TARGET.rows, TARGET.columns
    corners = (0, columns - 1, (rows - 1) * columns)
    touches: list[Touch] = []
    if in_hand:
        believed = np.array(TOOL_M)
        tip = believed + random.normal(0, TOOL_SIGMA_M, 3)
        x, y, z = believed.tolist()
        tips = {"tool": Tip(Body.FLANGE, (x, y, z), TOOL_SIGMA_M)}
    else:
        # Where the board was in the middle of the views, so that it can be reached.
        middle = cell.recording.views[len(cell.recording.views) // 2].T_base_flange
        tip = middle.act(cell.Y.act(points).mean(axis=0)[np.newaxis])[0]
        tips = {"tip": Tip(Body.BASE, sigma_m=UNKNOWN_M)}
    name = next(iter(tips))
    for corner in corners:
        joints = _stand(random, cell, cell.Y.act(points[corner][np.newaxis])[0], tip)
        reported = simulated_arm().forward(joints)
        touches.append(Touch(name, corner, Pose(reported), tuple(joints.tolist())))
    return Probing(tips, tuple(touches), TOUCH_SIGMA_M)


def _stand(
    random: np.random.Generator, cell: SimulatedCell, board_point: FloatArray, tip: FloatArray
) -> FloatArray:
    """Joints (6,) as they are read where the tip truly meets a point of the board."""
    if cell.arm is None:
        raise AssertionError  # of a mixture
    in_hand = cell.recording.mounting is Mounting.EYE_IN_HAND
    arm = simulated_arm()
    for _ in range(_TRIES):
        if in_hand:
            # The tool down on the table, tilted a little.
            turn = np.diag([1.0, -1.0, -1.0])
            start = np.array(cell.recording.views[0].joints_rad)
        else:
            view = cell.recording.views[int(random.integers(len(cell.recording.views)))]
            turn = view.T_base_flange.rotation
            start = np.array(view.joints_rad)
        tilt = Pose.exp([0, 0, 0, *random.normal(0, 0.2, 2), random.uniform(-1.0, 1.0)]).rotation
        goal = np.eye(4)
        goal[:3, :3] = turn @ tilt
        on_flange, in_base = (tip, board_point) if in_hand else (board_point, tip)
        meets = in_base + random.normal(0, TOUCH_SIGMA_M, 3)
        goal[:3, 3] = meets - goal[:3, :3] @ on_flange
        # What is new at this stop, drawn once: the arm is jogged until the tip is there in spite of it.
        seed = int(random.integers(1_000_000))
        joints, reached = arm.inverse_all(goal[np.newaxis], start, attempts=10)
        if not reached[0]:
            continue
        read: FloatArray = joints[0]
        for _ in range(6):
            stands = cell.arm.stand(np.random.default_rng(seed), read[np.newaxis])[0]
            short = goal @ inverses(stands[np.newaxis])[0]
            if np.abs(short - np.eye(4)).max() < 1e-7:
                return read
            read = arm.inverse_all((short @ arm.forward(read))[np.newaxis], read, attempts=1)[0][0]
    raise SolveError(f"a corner was not reached in {_TRIES} tries", code=Code.NO_VIEWS)
