"""Arms of hobby servos: whether the stated region holds, and a request out of reach is refused early.

An arm of five joints as the SO-101 of LeRobot has them, its measures rounded, printed and put together by
hand: joint zeros off by a degree, play of one to two degrees, links off by a millimetre, servos of 4096 steps
a turn. A webcam sits in its hand, or stands beside it and sees the board in the gripper.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import SolveError
from handeye.estimation import Estimate, Measurements
from handeye.estimation.auto import AutoEstimator, AutoOptions
from handeye.planning.prospect import MANY_VIEWS, OutOfReach
from handeye.planning.stopping import State, Stop
from handeye.robots import Arm, ArmKinematics, Joint
from handeye.robots.displaced import displaced, random_displacements
from handeye.simulation.mixed_arm import log_uniform, random_twist
from handeye.types import Camera, Chessboard, Mounting, Pose, View
from handeye.types.units import MM_PER_M
from handeye.validation import metrics

BOARD = Chessboard(5, 7, 0.02)
SIZE_PX = (1280, 720)
LENS, PARAMETERS = "brown_conrady_5", np.array([950.0, 950.0, 640.0, 360.0, 0.05, -0.1, 0.0, 0.0, 0.0])
STEP_RAD = 2 * np.pi / 4096
# What nobody reaches with such an arm, and asks for all the same.
ASKED_MM, ASKED_DEG = 0.5, 0.1
LATEST_REFUSAL = 6
# Most postures are drawn around those that show the board: elsewhere it would rarely be seen whole.
NEAR_ANOTHER = 0.8
_TRIES = 20_000
_CELLS = 5


@dataclass(frozen=True)
class CheapArmStudy:
    """What is tried; `play` has the play of the joints estimated."""

    cells: int = 200
    views: int = 20
    play: bool = False
    seed: int = 0


@dataclass(frozen=True)
class _Job:
    options: CheapArmStudy
    number: int


@dataclass(frozen=True)
class CheapCell:
    """One cell: whether the region and the radius hold, errors, and after how many views it was refused."""

    held: bool
    within: bool
    error_mm: float
    stated_mm: float
    refused_at: int
    forecast_mm: float
    reached_mm: float


def study_cheap_arms(
    options: CheapArmStudy, *, workers: Workers = 1, progress: Progress | None = None
) -> dict[str, Any]:
    """Count how often the region holds, and how early a request out of reach is refused.

    Raises
    ------
    SolveError
        No views could be drawn, or an estimate failed.
    """
    jobs = [_Job(options, number) for number in range(options.cells)]
    done = run_all(_one, jobs, workers=workers, progress=progress)
    refused = [cell for cell in done if cell.refused_at]
    return {
        "study": "cheap_arms",
        "seed": options.seed,
        "cells": options.cells,
        "views": options.views,
        "play": options.play,
        "held": float(np.mean([cell.held for cell in done])),
        "within": float(np.mean([cell.within for cell in done])),
        "error_mm": float(np.mean([cell.error_mm for cell in done])),
        "stated_mm": float(np.mean([cell.stated_mm for cell in done])),
        "refused": len(refused) / len(done),
        "refused_in_time": float(np.mean([0 < cell.refused_at <= LATEST_REFUSAL for cell in done])),
        "forecast_mm": float(np.mean([cell.forecast_mm for cell in refused])) if refused else None,
        "reached_mm": float(np.mean([cell.reached_mm for cell in refused])) if refused else None,
    }


@cache
def five_joint_arm() -> Arm:
    """Return the arm: a turning base, three joints that bend, and a roll of the wrist."""
    bend, limit = (0.0, 1.0, 0.0), float(np.deg2rad(100.0))

    def joint(name: str, x: float, z: float, axis: tuple[float, float, float]) -> Joint:
        return Joint(name, Pose.exp([x, 0, z, 0, 0, 0]), axis, lower=-limit, upper=limit)

    return Arm(
        "so101_like",
        (
            joint("shoulder_pan", 0.04, 0.06, (0.0, 0.0, 1.0)),
            joint("shoulder_lift", 0.03, 0.055, bend),
            joint("elbow_flex", 0.0, 0.115, bend),
            joint("wrist_flex", 0.135, 0.0, bend),
            joint("wrist_roll", 0.06, 0.0, (1.0, 0.0, 0.0)),
        ),
        Pose.exp([0.04, 0, 0, 0, 0, 0]) @ Pose.exp([0, 0, 0, 0, np.pi / 2, 0]),
    )


def _one(job: _Job) -> CheapCell:
    options = job.options
    random = np.random.default_rng([options.seed, 31, job.number])
    mounting = list(Mounting)[job.number % 2]
    described = job.number // 2 % 2 == 0
    measurements, X = made_cell(random, mounting, MANY_VIEWS)
    kinematics = ArmKinematics(five_joint_arm()) if described else None
    estimator = AutoEstimator(AutoOptions(kinematics, play=options.play and described))
    estimate = estimator(measurements.select(range(options.views)))
    xi = (estimate.X @ X.inverse()).log()
    squared = float(xi @ np.linalg.solve(estimate.hand_eye_covariance, xi))
    off = MM_PER_M * float(np.linalg.norm((estimate.X.inverse().matrix - X.inverse().matrix)[:3, 3]))
    refused_at, forecast = _refusal(estimator, measurements)
    reached = estimator(measurements).within_95.translation_mm if refused_at else 0.0
    return CheapCell(
        metrics.region_holds(squared, estimate.degrees_of_freedom),
        off <= estimate.within_95.translation_mm,
        off,
        estimate.within_95.translation_mm,
        refused_at,
        forecast,
        reached,
    )


def _refusal(estimator: AutoEstimator, measurements: Measurements) -> tuple[int, float]:
    """Return after how many views a request out of reach is refused, 0 for never, and what is forecast."""
    rule = OutOfReach(ASKED_MM, ASKED_DEG)
    estimate: Estimate | None = None
    for count in range(4, LATEST_REFUSAL + 3):
        taken = measurements.select(range(count))
        estimate = estimator(taken, estimate)
        stop: Stop | None = rule.verdict(State(taken, estimate, np.ones(1)))
        if stop is not None:
            return count, float(stop.evidence["translation_mm"])
    return 0, float("nan")


def _mounted(random: np.random.Generator, mounting: Mounting) -> tuple[Pose, Pose]:
    """Draw X and Y: the camera beside the gripper over a board on the table, or in front of the arm."""
    jitter = Pose.exp(random_twist(random, 0.01, 10.0))
    centre = np.eye(4)
    centre[:3, 3] = -BOARD.points.mean(axis=0)
    turned = np.diag([1.0, -1.0, -1.0, 1.0])
    if mounting is Mounting.EYE_IN_HAND:
        on_table = turned.copy()
        on_table[:3, 3] = [0.32, 0.0, -0.02]
        T_base_board = Pose(on_table) @ Pose.exp(random_twist(random, 0.02, 10.0)) @ Pose(centre)
        return (Pose.exp([0.0, 0.05, -0.02, 0, 0, 0]) @ jitter).inverse(), T_base_board
    look = np.array([[0.0, 0.0, -1.0, 0.75], [1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.25], [0, 0, 0, 1.0]])
    T_base_camera = Pose(look) @ Pose.exp(random_twist(random, 0.03, 8.0))
    return T_base_camera.inverse(), Pose.exp([0, 0, 0.04, 0, 0, 0]) @ jitter @ Pose(turned) @ Pose(centre)


def made_cell(random: np.random.Generator, mounting: Mounting, count: int) -> tuple[Measurements, Pose]:
    """Draw a cell: its views, postures one after the other with the board whole in the picture, and X.

    One whose arm cannot show its board is drawn again.

    Raises
    ------
    SolveError
        Too few postures show the board.
    """
    for _ in range(_CELLS):
        found = _cell(random, mounting, count)
        if found is not None:
            return found
    raise SolveError(f"no {count} views in {_CELLS} cells of {_TRIES} tries", code=Code.NO_VIEWS)


def _cell(random: np.random.Generator, mounting: Mounting, count: int) -> tuple[Measurements, Pose] | None:
    arm = five_joint_arm()
    zeros = np.deg2rad(random.normal(0, 1.0, len(arm)))
    zeros[[0, -1]] = 0.0
    play = np.deg2rad(random.uniform(1.0, 2.0, len(arm)))
    noise = np.deg2rad(log_uniform(random, (0.1, 0.4)))
    built = displaced(arm, random_displacements(random, arm, 1e-3, float(np.deg2rad(0.5))))
    covariance = np.diag(np.square([3.0, 3.0, 3.0, 3.0, 0.01, 0.02, 1e-3, 1e-3, 0.02]))
    true_camera = Camera(LENS, PARAMETERS + random.multivariate_normal(np.zeros(9), covariance), *SIZE_PX)
    pixel_sigma = log_uniform(random, (0.1, 0.3))
    X, Y = _mounted(random, mounting)
    low, high = arm.limits.T
    views: list[View] = []
    before = np.zeros(len(arm))
    ids = np.arange(BOARD.point_count)
    for _ in range(_TRIES):
        if len(views) == count:
            break
        joints = np.asarray(random.uniform(0.8 * low, 0.8 * high), np.float64)
        if views and random.uniform() < NEAR_ANOTHER:
            near = np.array(views[int(random.integers(len(views)))].joints_rad)
            joints = np.asarray(np.clip(near + random.normal(0, 0.35, len(arm)), low, high), np.float64)
        read = np.round(joints / STEP_RAD) * STEP_RAD
        stands = read + zeros + noise * random.standard_normal(len(arm)) - 0.5 * play * np.sign(read - before)
        flange = Pose(built.forward(stands))
        seen = (X @ mounting.chain(flange) @ Y).matrix
        pixels, _ = _core.project_features(LENS, true_camera.parameters, seen, BOARD.points, BOARD.radii_m)
        inside = (pixels >= 5).all() and (pixels <= np.array(SIZE_PX) - 6).all()
        facing = seen[2, 2] > 0.3 and 0.12 < seen[2, 3] < 1.0
        if not (inside and facing):
            continue
        before = read
        pixels = pixels + pixel_sigma * random.standard_normal(pixels.shape)
        reported = Pose(arm.forward(read))
        views.append(View(f"view_{len(views) + 1:02d}", reported, ids, pixels, joints_rad=read.tolist()))
    else:
        return None
    camera = Camera(LENS, PARAMETERS, *SIZE_PX, covariance=covariance)
    return Measurements.of(mounting, camera, BOARD, views), X
