"""Every method a row: errors against truth on the same simulated cells, by level of noise and mounting."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike

from handeye import _core
from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import HandeyeError
from handeye.estimation import Measurements, make_estimator
from handeye.estimation.initialize import closed_form_start
from handeye.estimation.pose_costs import POSE_COSTS, PoseCost, PoseViews, optimise
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.studies.protocol import true_hand_eye
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.validation import metrics

CELLS_PER_PIECE = 5
# Level 1: an arm of 0.02 deg and 0.02 deg times a metre, pixels of 0.1 px; the others are multiples of all.
LEVELS = (0.0, 0.25, 1.0, 4.0)
PIXEL_SIGMA_PX, ROTATION_SIGMA_DEG, LEVER_M = 0.1, 0.02, 1.0
# Levels of log-uniform draws must be positive: without noise they are far below what an answer shows.
NO_NOISE = 1e-12

OPENCV_HAND_EYE = {
    "tsai": "CALIB_HAND_EYE_TSAI",
    "park": "CALIB_HAND_EYE_PARK",
    "horaud": "CALIB_HAND_EYE_HORAUD",
    "andreff": "CALIB_HAND_EYE_ANDREFF",
    "daniilidis": "CALIB_HAND_EYE_DANIILIDIS",
}
OPENCV_ROBOT_WORLD = {"shah": "CALIB_ROBOT_WORLD_HAND_EYE_SHAH", "li": "CALIB_ROBOT_WORLD_HAND_EYE_LI"}

Method = Callable[[Measurements], Pose]


def closed_form(name: str, measurements: Measurements) -> Pose:
    """Return X of one of our closed forms, from poses alone."""
    return Pose(_core.closed_form(name, measurements.motions, measurements.camera_poses)[0])


def pose_cost(cost: PoseCost, measurements: Measurements) -> Pose:
    """Return X of a method that minimises a cost on poses, from the closed form that fits best."""
    start = closed_form_start(measurements)
    views = PoseViews(measurements.motions, measurements.camera_poses, measurements.target.points)
    return Pose(optimise(cost, views, (start.X.matrix, start.Y.matrix))[0])


def opencv_hand_eye(code: int, measurements: Measurements) -> Pose:
    """Return X of OpenCV's `calibrateHandEye`."""
    hand, seen = np.linalg.inv(measurements.motions), measurements.camera_poses
    R, t = cv2.calibrateHandEye(
        list(hand[:, :3, :3]), list(hand[:, :3, 3]), list(seen[:, :3, :3]), list(seen[:, :3, 3]), method=code
    )
    return Pose(_rigid(R, t)).inverse()


def opencv_robot_world(code: int, measurements: Measurements) -> Pose:
    """Return X of OpenCV's `calibrateRobotWorldHandEye`."""
    A, C = measurements.motions, measurements.camera_poses
    _, _, R, t = cv2.calibrateRobotWorldHandEye(
        list(C[:, :3, :3]), list(C[:, :3, 3]), list(A[:, :3, :3]), list(A[:, :3, 3]), method=code
    )
    return Pose(_rigid(R, t))


def _rigid(R: ArrayLike, t: ArrayLike) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, np.ravel(t)
    return matrix


def estimate(model: ModelName, measurements: Measurements) -> Pose:
    """Return X of one of our estimates."""
    return make_estimator(model, None)(measurements).X


def methods() -> dict[str, Method]:
    """Return every method by name; OpenCV's only where its wheel has them."""
    found: dict[str, Method] = {}
    for name, _, _ in _core.closed_form_methods():
        found[name] = partial(closed_form, name)
    for name, cost in POSE_COSTS.items():
        found[name] = partial(pose_cost, cost)
    for function, codes, wrapper in (
        ("calibrateHandEye", OPENCV_HAND_EYE, opencv_hand_eye),
        ("calibrateRobotWorldHandEye", OPENCV_ROBOT_WORLD, opencv_robot_world),
    ):
        if hasattr(cv2, function):
            for name, code in codes.items():
                found[f"opencv_{name}"] = partial(wrapper, getattr(cv2, code))
    found["reprojection"] = partial(estimate, ModelName.PAPER)
    found["handeye"] = partial(estimate, ModelName.AUTO)
    return found


@dataclass(frozen=True)
class Outcome:
    """Errors of one method in one cell; NaN where it refused or answered nothing finite."""

    translation_mm: float
    rotation_deg: float


@dataclass(frozen=True)
class Methods:
    """Outcomes of every method, by mounting and level of noise."""

    seed: int
    trials: int
    levels: tuple[float, ...]
    outcomes: dict[tuple[Mounting, float], dict[str, tuple[Outcome, ...]]]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "study": "methods",
            "seed": self.seed,
            "trials": self.trials,
            "opencv": cv2.__version__,
            "levels": [
                {
                    "level": level,
                    "pixel_sigma_px": level * PIXEL_SIGMA_PX,
                    "rotation_sigma_deg": level * ROTATION_SIGMA_DEG,
                    "translation_sigma_mm": level * 1e3 * LEVER_M * float(np.deg2rad(ROTATION_SIGMA_DEG)),
                }
                for level in self.levels
            ],
            "mountings": {
                mounting.value: {
                    method: [_summary(self.outcomes[mounting, level][method]) for level in self.levels]
                    for method in self.outcomes[mounting, self.levels[0]]
                }
                for mounting in dict.fromkeys(mounting for mounting, _ in self.outcomes)
            },
        }


def _summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    answered = [outcome for outcome in outcomes if np.isfinite(outcome.translation_mm)]
    mm = np.array([outcome.translation_mm for outcome in answered])
    deg = np.array([outcome.rotation_deg for outcome in answered])
    found: dict[str, Any] = {"answered": len(answered)}
    for name, values, middle in (
        ("translation_mm", mm, np.median),
        ("rotation_deg", deg, np.median),
        ("translation_mean_mm", mm, np.mean),
        ("rotation_mean_deg", deg, np.mean),
    ):
        found[name] = float(middle(values)) if answered else None
    return found


def study_methods(
    *,
    levels: Sequence[float] = LEVELS,
    trials: int = 50,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Methods:
    """Calibrate the same cells by every method, camera in the hand and beside the robot.

    Each cell has 8 to 12 views of a board; poses of the arm have a white error of the flange. All methods on
    poses get the same poses: those found in the pictures, one by one.

    Raises
    ------
    SolveError
        No views could be drawn.
    """
    pieces = [
        _Piece(mounting, level, seed, tuple(range(i, min(i + CELLS_PER_PIECE, trials))))
        for mounting in Mounting
        for level in levels
        for i in range(0, trials, CELLS_PER_PIECE)
    ]
    done = run_all(_run, pieces, workers=workers, progress=progress)
    outcomes: dict[tuple[Mounting, float], dict[str, tuple[Outcome, ...]]] = {}
    for piece, found in zip(pieces, done, strict=True):
        part = outcomes.setdefault((piece.mounting, piece.level), dict.fromkeys(found, ()))
        for method, some in found.items():
            part[method] += some
    return Methods(seed, trials, tuple(levels), outcomes)


@dataclass(frozen=True)
class _Piece:
    mounting: Mounting
    level: float
    seed: int
    numbers: tuple[int, ...]


def _run(piece: _Piece) -> dict[str, tuple[Outcome, ...]]:
    scale = max(piece.level, NO_NOISE)
    sigma_px, sigma_deg = scale * PIXEL_SIGMA_PX, scale * ROTATION_SIGMA_DEG
    options = CellOptions(
        mounting=piece.mounting,
        pixel_sigma_px=(sigma_px, sigma_px),
        rotation_sigma_deg=(sigma_deg, sigma_deg),
        lever_m=(LEVER_M, LEVER_M),
    )
    found: dict[str, tuple[Outcome, ...]] = dict.fromkeys(methods(), ())
    for number in piece.numbers:
        recording = simulate(ErrorKind.WHITE_FLANGE, number, options, seed=piece.seed)
        measurements, truth = Measurements.of_recording(recording), true_hand_eye(recording)
        for name, method in methods().items():
            found[name] += (_outcome(method, measurements, truth),)
    return found


def _outcome(method: Method, measurements: Measurements, truth: Pose) -> Outcome:
    try:
        error = metrics.absolute_error(method(measurements), truth)
    except (HandeyeError, cv2.error):
        return Outcome(float("nan"), float("nan"))
    return Outcome(error.translation_mm, error.rotation_deg)
