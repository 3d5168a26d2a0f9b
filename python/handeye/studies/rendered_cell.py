"""MoveIt Pro's cell rebuilt from its published facts, rendered by MuJoCo: three cameras, poses known exactly.

A UR5e whose base stands 0.2 m up, a wrist camera that sees a board in the world, and two fixed cameras that
see a board on the flange (`moveit_pro_example_ws`, package `hand_eye_calibration_sim`, PickNik). Where on its
rail the arm stands, and how the flange board is fixed, is not published: chosen here so that the cameras see
it. Each camera is calibrated from 8 views, three to start and five by the default policy.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.compute.parallel import Progress
from handeye.detection import Detection, detect
from handeye.errors import SolveError
from handeye.estimation import Measurements, make_estimator
from handeye.planning import Candidate, Planner, PlannerOptions, Pool, Proposal
from handeye.planning.prediction import Sight
from handeye.robots import ArmKinematics
from handeye.robots.protocol import Goal
from handeye.robots.simulated import SimulatedArm
from handeye.simulation.cells import simulated_arm
from handeye.simulation.mujoco_pictures import MujocoPictures
from handeye.studies.policies import ARMS, START_VIEWS, draw_start
from handeye.types import Camera, Charuco, Mounting, Pose, Target, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.validation import metrics

SIZE_PX = (1280, 720)
VIEWS = 8
POOL = 40
# Border that no point of a candidate's target may touch, and its steepest view.
MARGIN_PX, STEEPEST_RAD = 15.0, np.deg2rad(50.0)
# Smaller squares have markers that nobody reads.
SMALLEST_SQUARE_PX = 16.0
# Where the base stands in their world; the place on the rail is ours.
T_WORLD_BASE = np.array([0.3, 0.0, 0.2])
MOST_ATTEMPTS = 60
LENS = "brown_conrady_5"


@dataclass(frozen=True)
class CellCamera:
    """A camera of the cell: its name, what it sees, and the truth of the chain."""

    name: str
    mounting: Mounting
    target: Target
    camera: Camera
    X: Pose
    Y: Pose
    distance_m: tuple[float, float]


def _pinhole(fovy_deg: float) -> Camera:
    width, height = SIZE_PX
    focal = height / 2 / np.tan(np.deg2rad(fovy_deg) / 2)
    parameters = np.zeros(9)
    parameters[:4] = focal, focal, (width - 1) / 2, (height - 1) / 2
    return Camera(LENS, parameters, width, height)


def _world(position: Sequence[float], rotation: FloatArray) -> Pose:
    """Return a pose in the base of something placed in their world."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, np.array(position) - T_WORLD_BASE
    return Pose(matrix)


def _mujoco_camera(wxyz: Sequence[float]) -> FloatArray:
    """Return the rotation of a camera with z ahead from that of MuJoCo's, which looks along -z."""
    w, x, y, z = np.array(wxyz) / np.linalg.norm(wxyz)
    angle = 2 * np.arctan2(np.linalg.norm([x, y, z]), w)
    axis = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    twist = np.concatenate([np.zeros(3), angle * axis])
    return _core.se3_exp(twist[np.newaxis])[0, :3, :3] @ np.diag([1.0, -1.0, -1.0])


def _turn(axis: int, degrees: float) -> FloatArray:
    twist = np.zeros((1, 6))
    twist[0, 3 + axis] = np.deg2rad(degrees)
    return _core.se3_exp(twist)[0, :3, :3]


def cameras() -> tuple[CellCamera, ...]:
    """Return the three cameras with their true poses."""
    world_board = Charuco(5, 7, 0.035, 0.026, "DICT_4X4_50")
    flange_board = Charuco(4, 5, 0.030, 0.022, "DICT_5X5_50")
    # 0.1514 m along the tool from the last link's frame, of which 0.1 m are up to the flange; 0.0784 m aside.
    on_flange = np.eye(4)
    on_flange[:3, :3], on_flange[:3, 3] = _turn(0, 6.0), [0.0, -0.078437, 0.051402]
    # Tilted by 27 degrees towards the arm, its z axis into the board.
    board = _world([0.266, 0.650, 0.666], _turn(0, 27.0 - 90.0))
    wrist = CellCamera(
        "wrist",
        Mounting.EYE_IN_HAND,
        world_board,
        _pinhole(58.0),
        Pose(on_flange).inverse(),
        board,
        (0.25, 0.6),
    )
    held = np.diag([1.0, -1.0, -1.0, 1.0])
    held[:3, 3] = [-0.05, 0.04, 0.02]
    fixed = [
        ("narrow", 40.0, (0.917266, 1.074437, 1.861509), (0.318150, 0.217713, 0.521087, 0.761479)),
        ("wide", 54.0, (-0.111275, 0.793605, 1.684685), (0.318467, 0.228371, -0.536136, -0.747653)),
    ]
    return (
        wrist,
        *(
            CellCamera(
                name,
                Mounting.EYE_TO_HAND,
                flange_board,
                _pinhole(fovy),
                _world(place, _mujoco_camera(wxyz)).inverse(),
                Pose(held),
                (0.5, 1.4),
            )
            for name, fovy, place, wxyz in fixed
        ),
    )


@dataclass(frozen=True)
class Start:
    """What became of one camera from one start."""

    translation_mm: float
    rotation_deg: float
    stated_mm: float
    holds: bool
    views: int


@dataclass(frozen=True)
class RenderedCell:
    """All starts of all cameras."""

    arm: str
    seed: int
    starts: dict[str, tuple[Start, ...]]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "arm": self.arm,
            "seed": self.seed,
            "cameras": {name: _summary(starts) for name, starts in self.starts.items()},
        }


def _summary(starts: Sequence[Start]) -> dict[str, Any]:
    return {
        "starts": len(starts),
        "views": max(start.views for start in starts),
        "translation_mm": float(np.median([start.translation_mm for start in starts])),
        "rotation_deg": float(np.median([start.rotation_deg for start in starts])),
        "largest_translation_mm": float(max(start.translation_mm for start in starts)),
        "stated_mm": float(np.median([start.stated_mm for start in starts])),
        "region_holds": float(np.mean([start.holds for start in starts])),
    }


def study_rendered_cell(
    *,
    arm: str = "exact",
    trials: int = 20,
    seed: int = 0,
    progress: Progress | None = None,
) -> RenderedCell:
    """Calibrate each camera of the cell from random starts, on rendered pictures.

    Parameters
    ----------
    arm
        exact, or realistic: the mixture of errors of the cell of `handeye run`.

    Raises
    ------
    InputError
        The package `mujoco` is not installed.
    SolveError
        The arm reaches too few views.
    """
    found: dict[str, tuple[Start, ...]] = {}
    all_of_them = cameras()
    for k, one in enumerate(all_of_them):
        pictures = MujocoPictures(one.target, one.camera)
        try:
            for number in range(trials):
                found[one.name] = (
                    *found.get(one.name, ()),
                    _start(one, pictures, arm, number, seed),
                )
                if progress is not None:
                    progress(k * trials + number + 1, len(all_of_them) * trials)
        finally:
            pictures.close()
    return RenderedCell(arm, seed, found)


def _start(one: CellCamera, pictures: MujocoPictures, arm: str, number: int, seed: int) -> Start:
    random = np.random.default_rng([seed, 6, number, len(one.name)])
    robot = simulated_arm()
    pool = draw_pool(one, random)
    moving = SimulatedArm(robot, ARMS[arm], int(random.integers(2**31)), pool.candidates[0].joints_rad or ())

    empty = Measurements.of(one.mounting, one.camera, one.target)

    def measured(candidate: Candidate) -> View | None:
        moving.move_to(Goal(candidate.name, candidate.T_base_flange, candidate.joints_rad))
        seen = (one.X @ one.mounting.chain(moving.hidden_pose) @ one.Y).matrix
        detection = detect(pictures.picture(seen), one.target)
        if not isinstance(detection, Detection):
            return None
        reading = moving.read_pose()
        view = View(
            candidate.name,
            reading.T_base_flange,
            detection.point_ids,
            detection.pixels,
            joints_rad=candidate.joints_rad,
        )
        # Too few points, or points that are no view of a plane: as if the board had not been found.
        return view if len(empty.with_views([view])) == 1 else None

    views: list[View] = []
    left = pool
    while len(views) < START_VIEWS:
        # A start in which the board is not found is no start: another is drawn.
        start, left = draw_start(pool, random)
        views = [view for view in map(measured, start) if view is not None]
    estimator = make_estimator(ModelName.AUTO, ArmKinematics(robot), camera_fixed=True)
    planner = Planner(
        empty.with_views(views), left, estimator, PlannerOptions(sight=Sight(margin_px=MARGIN_PX))
    )
    while len(planner.measurements) < VIEWS:
        answer = planner.ask()
        if not isinstance(answer, Proposal):
            break
        view = measured(answer.candidate)
        if view is None:
            planner.give_up(answer.candidate.name)
        else:
            planner.tell(view)
    estimate = planner.estimate
    error = metrics.absolute_error(estimate.X, one.X)
    squared = metrics.nees(estimate.X, estimate.hand_eye_covariance, one.X)
    return Start(
        error.translation_mm,
        error.rotation_deg,
        estimate.within_95.translation_mm,
        metrics.region_holds(squared, estimate.degrees_of_freedom),
        len(planner.measurements),
    )


def draw_pool(one: CellCamera, random: np.random.Generator) -> Pool:
    """Draw postures that show the whole target to the camera."""
    arm = simulated_arm()
    found: list[Candidate] = []
    for _ in range(MOST_ATTEMPTS):
        drawn = [_drawn(one, random) for _ in range(100)]
        seen: FloatArray = np.array([pose for pose in drawn if _is_whole(one, pose)]).reshape(-1, 4, 4)
        if len(seen) == 0:
            continue
        chain = one.X.inverse().matrix @ seen @ one.Y.inverse().matrix
        flange = np.linalg.inv(chain) if one.mounting is Mounting.EYE_IN_HAND else chain
        joints, reached = arm.inverse_all(flange, arm.middle, attempts=4)
        for k in np.flatnonzero(reached):
            name = f"candidate_{len(found):03d}"
            found.append(Candidate(name, Pose(arm.forward(joints[k])), tuple(joints[k].tolist())))
        if len(found) >= POOL:
            return Pool(tuple(found[:POOL]))
    raise SolveError(f"camera {one.name}: {len(found)} of {POOL} views in reach", code=Code.NO_VIEWS)


def _drawn(one: CellCamera, random: np.random.Generator) -> FloatArray:
    """Draw `T_camera_target` (4, 4): the target somewhere in the picture, tilted and rolled."""
    tilt = float(np.arccos(random.uniform(float(np.cos(STEEPEST_RAD)), 1.0)))
    azimuth, roll = random.uniform(-np.pi, np.pi, 2)
    twists = np.zeros((2, 6))
    twists[0, 5] = roll
    twists[1, 3:5] = tilt * np.cos(azimuth), tilt * np.sin(azimuth)
    turns = _core.se3_exp(twists)
    pose = turns[0] @ turns[1]
    size = np.array(SIZE_PX)
    aim = (random.uniform(0.05, 0.95, 2) - 0.5) * size / one.camera.parameters[:2]
    place = np.append(aim, 1.0) * random.uniform(*one.distance_m)
    pose[:3, 3] = place - pose[:3, :3] @ one.target.points.mean(axis=0)
    return pose


def _smallest_step(points: FloatArray, pixels: FloatArray) -> float:
    """Shortest distance in the picture between corners that are neighbours on the board, px."""
    apart = np.linalg.norm(points[:, np.newaxis] - points, axis=2)
    seen = np.linalg.norm(pixels[:, np.newaxis] - pixels, axis=2)
    neighbours = (apart > 0) & (apart < 1.01 * apart[apart > 0].min())
    return min(seen[neighbours].tolist())


def _is_whole(one: CellCamera, T_camera_target: FloatArray) -> bool:
    points = one.target.points @ T_camera_target[:3, :3].T + T_camera_target[:3, 3]
    pixels, seen = _core.project(one.camera.lens, one.camera.parameters, points)
    # The border of squares outside the inner corners must be in sight too, and its markers be legible.
    square = np.ptp(pixels, axis=0).max() / 3
    if _smallest_step(points, pixels) < SMALLEST_SQUARE_PX:
        return False
    inside = (pixels >= MARGIN_PX + square) & (pixels <= np.array(SIZE_PX) - 1 - MARGIN_PX - square)
    return bool(seen.all() and inside.all())
