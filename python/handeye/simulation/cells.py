"""Made-up cells: an arm, a camera, a board, and errors of a known kind, for Monte Carlo.

A cell is drawn at random within what is usual: a UR5e, a board of 8 x 11 corners, views from 0.4 to 0.8 m
under up to 40 degrees. The reported robot poses are wrong by one kind of error, the camera's parameters by
what an ordinary calibration leaves.
"""

import zlib
from dataclasses import dataclass
from enum import StrEnum
from functools import cache

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.detection import Detection, calibrate_camera
from handeye.errors import SolveError
from handeye.robots import Arm, open_arm
from handeye.robots.displaced import displaced, random_displacements
from handeye.simulation.mixed_arm import MixedArm, log_uniform, random_twist
from handeye.types import Camera, Chessboard, Mounting, Pose, Recording, Target, Truth, View
from handeye.types.arrays import FloatArray
from handeye.types.pose import inverses, through_twist


class ErrorKind(StrEnum):
    """What is wrong besides the pixels; the camera's parameters are always known only from a calibration."""

    PIXEL_ONLY = "pixel_only"
    """Nothing: the robot is exact."""
    WHITE_FLANGE = "white_flange"
    """Each pose off by its own twist in the flange frame."""
    WHITE_BASE = "white_base"
    """Each pose off by its own twist in the base frame."""
    ENCODER = "encoder"
    """Each joint angle off by its own error at each view."""
    JOINT_OFFSETS = "joint_offsets"
    """Joint angles off by constants; of joints 2 to 5, as the others only say where base and flange are."""
    SMOOTH_KINEMATIC = "smooth_kinematic"
    """Each joint placed wrongly on the link before it: an error that changes smoothly with the posture."""
    WRONG_INTRINSICS = "wrong_intrinsics"
    """The robot is exact; the camera's parameters are off by more than their covariance says."""
    MIXTURE_CELL = "mixture_cell"
    """Encoders, offsets, links and play at once, as in the simulated cell of `handeye run`."""
    MIXTURE_CELL_2 = "mixture_cell_2"
    """The same, twice as large."""
    MIXTURE_RANDOM = "mixture_random"
    """The same and white errors of the poses, every level drawn for each cell."""
    SAME_PICTURES = "same_pictures"
    """The robot is exact; the camera is calibrated from the very pictures that are solved."""
    SAME_PICTURES_MIXTURE = "same_pictures_mixture"
    """The arm is that of `MIXTURE_CELL`; the camera is calibrated from the very pictures that are solved."""
    BOARD_SCALE = "board_scale_0_1_percent"
    """The robot is exact; the board is a thousandth larger than stated."""
    FOCAL = "focal_0_3_percent"
    """The robot is exact; focal lengths are 0.3 % off, and the covariance knows nothing of it."""
    PIXEL_FIELD = "pixel_field"
    """The robot is exact; the pixels of a view are off by a smooth field of 0.1 px beside their noise."""
    ROBOT_NOISE_1_DEG = "robot_noise_1_deg"
    """Each pose off by its own twist of a degree in the flange frame."""


MIXTURES = (ErrorKind.MIXTURE_CELL, ErrorKind.MIXTURE_CELL_2, ErrorKind.MIXTURE_RANDOM)
# Errors of the arm alone, whatever cameras see it by.
OF_THE_ARM = (
    ErrorKind.PIXEL_ONLY,
    ErrorKind.WHITE_FLANGE,
    ErrorKind.WHITE_BASE,
    ErrorKind.ENCODER,
    ErrorKind.JOINT_OFFSETS,
    ErrorKind.SMOOTH_KINEMATIC,
    *MIXTURES,
    ErrorKind.ROBOT_NOISE_1_DEG,
)
OF_THE_SAME_PICTURES = (ErrorKind.SAME_PICTURES, ErrorKind.SAME_PICTURES_MIXTURE)
FACTORS = {ErrorKind.MIXTURE_CELL_2: 2.0}
BOARD_SCALE = 1e-3
FOCAL_SHARE = 3e-3
# Deviation of a smooth field of pixel errors, and its length as a share of the board.
FIELD_PX, FIELD_LENGTH = 0.1, 0.3
TARGET = Chessboard(8, 11, 0.025)


@dataclass(frozen=True)
class CellOptions:
    """What a cell is drawn from; ranges are drawn from uniformly, levels of errors log-uniformly.

    Parameters
    ----------
    mounting, target
        Where the camera sits, and the board.
    views
        Fewest and most views.
    pixel_sigma_px
        Noise of the pixels per axis.
    rotation_sigma_deg, lever_m, translation_sigma_m
        Levels of the robot's white error per axis. An arm's error is mostly error of its joints times its
        reach, so the translation's is the rotation's times a lever, unless it is given.
    encoder_sigma_deg, offset_sigma_deg
        Levels of the error of the joint angles.
    length_sigma_m, twist_sigma_deg
        Levels of the error of the links.
    calibration_views
        Views that the camera was calibrated with.
    intrinsics_factor
        By how much the camera's deviation exceeds what its covariance says under `wrong_intrinsics`.
    """

    mounting: Mounting = Mounting.EYE_IN_HAND
    target: Target = TARGET
    views: tuple[int, int] = (8, 12)
    pixel_sigma_px: tuple[float, float] = (0.05, 0.2)
    rotation_sigma_deg: tuple[float, float] = (0.005, 0.05)
    lever_m: tuple[float, float] = (0.5, 2.0)
    translation_sigma_m: tuple[float, float] | None = None
    encoder_sigma_deg: tuple[float, float] = (0.003, 0.03)
    offset_sigma_deg: tuple[float, float] = (0.005, 0.05)
    length_sigma_m: tuple[float, float] = (0.05e-3, 0.5e-3)
    twist_sigma_deg: tuple[float, float] = (0.005, 0.05)
    calibration_views: int = 20
    intrinsics_factor: float = 2.0
    distance_m: tuple[float, float] = (0.4, 0.8)
    tilt_deg: tuple[float, float] = (0.0, 40.0)
    roll_deg: tuple[float, float] = (-90.0, 90.0)


LENS = "brown_conrady_5"
PARAMETERS = np.array([1400.0, 1400.0, 640.0, 512.0, -0.1, 0.05, 0.0005, -0.0005, 0.0])
SIZE_PX = (1280, 1024)
MARGIN_PX = 20.0
ARM = "ur5e"
# Elbow up, tool down, in front of the robot.
POSTURE_RAD = np.deg2rad([0.0, -110.0, 110.0, -90.0, -90.0, 0.0])
MOST_ATTEMPTS = 50


@dataclass(frozen=True, eq=False)
class SimulatedCell:
    """A recording, and what it came from: X, Y, the camera, and the arm of a mixture."""

    recording: Recording
    X: Pose
    Y: Pose
    camera: Camera
    arm: MixedArm | None
    pixel_sigma_px: float


def simulate(kind: ErrorKind, number: int, options: CellOptions | None = None, *, seed: int = 0) -> Recording:
    """Return the recording of a cell with its truth; see `simulate_cell`."""
    return simulate_cell(kind, number, options, seed=seed).recording


def simulate_cell(
    kind: ErrorKind, number: int, options: CellOptions | None = None, *, seed: int = 0
) -> SimulatedCell:
    """Return a cell, the same for the same number and seed.

    Raises
    ------
    SolveError
        No views could be drawn within these options.
    """
    options = options or CellOptions()
    kind = ErrorKind(kind)
    random = np.random.default_rng([seed, zlib.crc32(kind.encode()), number])
    arm = simulated_arm()
    pixel_sigma = log_uniform(random, options.pixel_sigma_px)
    calibrated = Camera(LENS, PARAMETERS, *SIZE_PX)
    covariance = calibration_covariance(random, calibrated, pixel_sigma, options)
    deviation = random.multivariate_normal(np.zeros(len(PARAMETERS)), covariance, method="cholesky")
    if kind is ErrorKind.WRONG_INTRINSICS:
        deviation *= options.intrinsics_factor
    if kind is ErrorKind.FOCAL:
        deviation[:2] += FOCAL_SHARE * PARAMETERS[:2] * random.choice([-1.0, 1.0])
    true_camera = Camera(LENS, PARAMETERS + deviation, *SIZE_PX)
    X, Y = _mount(random, options.mounting)
    count = int(random.integers(options.views[0], options.views[1] + 1))
    joints, camera_poses = draw_views(random, arm, true_camera, X, Y, count, options)
    mixed = None
    if kind in MIXTURES or kind is ErrorKind.SAME_PICTURES_MIXTURE:
        reported, read = arm.forward(joints), joints
        mixed = draw_mixed(random, kind, arm)
        true = mixed.stand(random, joints)
        camera_poses = np.array([(X @ options.mounting.chain(Pose(pose)) @ Y).matrix for pose in true])
    else:
        reported, read = reported_poses(random, kind, arm, joints, options)
    views: list[View] = []
    target = options.target
    ids = np.arange(target.point_count)
    field = _field_root(target.points) if kind is ErrorKind.PIXEL_FIELD else None
    scale = 1 + BOARD_SCALE if kind is ErrorKind.BOARD_SCALE else 1.0
    for k, (pose, T_camera_target) in enumerate(zip(reported, camera_poses, strict=True)):
        pixels, _ = _core.project_features(
            LENS, true_camera.parameters, T_camera_target, scale * target.points, scale * target.radii_m
        )
        pixels = pixels + pixel_sigma * random.standard_normal(pixels.shape)
        if field is not None:
            pixels = pixels + field @ random.standard_normal(pixels.shape)
        views.append(View(f"view_{k + 1:02d}", Pose(pose), ids, pixels, joints_rad=read[k].tolist()))
    recording = Recording(
        f"simulated {kind.value} {number}",
        options.mounting,
        _calibrated(target, views)
        if kind in OF_THE_SAME_PICTURES
        else Camera(LENS, PARAMETERS, *SIZE_PX, covariance=covariance),
        target,
        tuple(views),
        Truth(X, Y),
        "simulated",
    )
    return SimulatedCell(recording, X, Y, true_camera, mixed, pixel_sigma)


@cache
def simulated_arm() -> Arm:
    """Return the arm of the cells."""
    return open_arm(ARM)


def points_in_camera(T_camera_target: FloatArray, target: Target) -> FloatArray:
    """(P, 3) points of a target in the camera frame, metres."""
    return target.points @ T_camera_target[:3, :3].T + T_camera_target[:3, 3]


def _look(down: FloatArray) -> FloatArray:
    """Return a pose (4, 4) at a place (3,), with its z axis down."""
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[:3, 3] = down
    return pose


def _mount(random: np.random.Generator, mounting: Mounting) -> tuple[Pose, Pose]:
    """Draw X and Y of the chain."""
    jitter = Pose.exp(random_twist(random, 0.05, 15.0)) @ Pose.exp(
        [0, 0, 0, 0, 0, random.uniform(-np.pi, np.pi)]
    )
    if mounting is Mounting.EYE_IN_HAND:
        # The camera beside the tool, looking along it; the board flat on the table, its z axis down.
        T_flange_camera = Pose.exp([0.05, 0, 0.06, 0, 0, 0]) @ jitter
        at = np.array([random.uniform(0.35, 0.5), random.uniform(-0.15, 0.15), random.uniform(-0.35, -0.1)])
        T_base_target = Pose(_look(at)) @ Pose.exp(random_twist(random, 0.0, 5.0))
        return T_flange_camera.inverse(), T_base_target
    # The camera above the table, looking down; the board on the flange, facing away from it.
    at = np.array([random.uniform(0.35, 0.5), random.uniform(-0.15, 0.15), random.uniform(0.9, 1.1)])
    T_base_camera = Pose(_look(at)) @ Pose.exp(random_twist(random, 0.0, 10.0))
    T_flange_target = Pose.exp([0, 0, 0.05, 0, 0, 0]) @ jitter @ Pose(_look(np.zeros(3)))
    return T_base_camera.inverse(), T_flange_target


def camera_pose(random: np.random.Generator, camera: Camera, options: CellOptions) -> FloatArray | None:
    """Draw `T_camera_target` (4, 4) such that the whole board is in the image; None if this draw is not."""
    tilt = np.deg2rad(random.uniform(*options.tilt_deg))
    azimuth = random.uniform(-np.pi, np.pi)
    roll = np.deg2rad(random.uniform(*options.roll_deg))
    axes = [[0, 0, 0, 0, 0, roll], [0, 0, 0, tilt * np.cos(azimuth), tilt * np.sin(azimuth), 0]]
    turns = _core.se3_exp(np.array(axes))
    pose = turns[0] @ turns[1]
    distance = random.uniform(*options.distance_m)
    fx, fy, cx, cy = camera.parameters[:4]
    # The board's centre in the inner part of the image: elsewhere it would rarely be seen whole.
    u, v = random.uniform([0.2, 0.2], [0.8, 0.8]) * SIZE_PX
    centre = options.target.points.mean(axis=0)
    aim = np.array([(u - cx) / fx, (v - cy) / fy, 1.0]) * distance
    pose[:3, 3] = aim - pose[:3, :3] @ centre
    pixels, seen = _core.project(camera.lens, camera.parameters, points_in_camera(pose, options.target))
    inside = (pixels >= MARGIN_PX) & (pixels <= np.array(SIZE_PX) - 1 - MARGIN_PX)
    return pose if seen.all() and inside.all() else None


def draw_views(
    random: np.random.Generator,
    arm: Arm,
    camera: Camera,
    X: Pose,
    Y: Pose,
    count: int,
    options: CellOptions,
) -> tuple[FloatArray, FloatArray]:
    """Draw joint angles (K, 6) within reach, and `T_camera_target` (K, 4, 4) there."""
    joints: list[FloatArray] = []
    poses: list[FloatArray] = []
    for _ in range(MOST_ATTEMPTS):
        drawn = [camera_pose(random, camera, options) for _ in range(4 * count)]
        seen = np.array([pose for pose in drawn if pose is not None]).reshape(-1, 4, 4)
        chain = X.inverse().matrix @ seen @ Y.inverse().matrix
        flange = inverses(chain) if options.mounting is Mounting.EYE_IN_HAND else chain
        found, reached = arm.inverse_all(flange, postures_near(arm, flange), attempts=1)
        indices = [int(i) for i in np.flatnonzero(reached)]
        joints += [found[i] for i in indices]
        poses += [seen[i] for i in indices]
        if len(joints) >= count:
            return np.array(joints[:count]), np.array(poses[:count])
    raise SolveError(
        f"{len(joints)} of {count} views found in {MOST_ATTEMPTS} attempts",
        code=Code.NO_VIEWS,
        hint="allow other distances or smaller tilts",
    )


def postures_near(arm: Arm, flange: FloatArray) -> FloatArray:
    """Return postures (N, 6) near poses (N, 4, 4): the arm turned towards each, the last joint with it."""
    postures = np.tile(POSTURE_RAD, (len(flange), 1))
    x, y = arm.forward(POSTURE_RAD)[:2, 3]
    postures[:, 0] += np.arctan2(flange[:, 1, 3], flange[:, 0, 3]) - np.arctan2(y, x)
    turn = np.swapaxes(arm.forward(postures)[:, :3, :3], 1, 2) @ flange[:, :3, :3]
    postures[:, 5] += np.arctan2(turn[:, 1, 0] - turn[:, 0, 1], turn[:, 0, 0] + turn[:, 1, 1])
    return np.arctan2(np.sin(postures), np.cos(postures))


def calibration_covariance(
    random: np.random.Generator, camera: Camera, pixel_sigma: float, options: CellOptions
) -> FloatArray:
    """Covariance (n, n) that a calibration of the camera from views of the same board reaches."""
    information = np.zeros((len(camera.parameters),) * 2)
    count = 0
    while count < options.calibration_views:
        pose = camera_pose(random, camera, options)
        if pose is None:
            continue
        information += camera_information(camera, options.target, pose)
        count += 1
    return symmetric(np.asarray(np.linalg.inv(information), np.float64) * pixel_sigma**2)


def camera_information(camera: Camera, target: Target, T_camera_target: FloatArray) -> FloatArray:
    """(n, n) information about the camera's parameters in a view of unknown pose, at a noise of 1 px."""
    points = points_in_camera(T_camera_target, target)
    _, in_point, in_parameters, _ = _core.project_jacobians(camera.lens, camera.parameters, points)
    in_pose = through_twist(points, in_point).reshape(-1, 6)
    in_camera = in_parameters.reshape(len(in_pose), -1)
    mixed = in_pose.T @ in_camera
    return in_camera.T @ in_camera - mixed.T @ np.linalg.solve(in_pose.T @ in_pose, mixed)


def symmetric(matrix: FloatArray) -> FloatArray:
    """Return the symmetric part of a matrix that is symmetric but for rounding."""
    return 0.5 * (matrix + matrix.T)


def _calibrated(target: Target, views: list[View]) -> Camera:
    """Return the camera as these very views have it."""
    found = {view.name: Detection(view.point_ids, view.pixels) for view in views}
    camera = calibrate_camera(target, found, SIZE_PX, lens=LENS).camera
    return Camera(camera.lens, camera.parameters, *SIZE_PX, camera.covariance, from_views=True)


def _field_root(points: FloatArray) -> FloatArray:
    """Return the root (P, P) of the covariance of a smooth field over points (P, 3) of a board, px."""
    size = float(np.ptp(points, axis=0).max()) * FIELD_LENGTH
    away = np.linalg.norm(points[:, np.newaxis] - points, axis=2) / size
    values, vectors = np.linalg.eigh(np.exp(-0.5 * away**2))
    return FIELD_PX * vectors * np.sqrt(np.maximum(values, 0))


def draw_mixed(random: np.random.Generator, kind: ErrorKind, arm: Arm) -> MixedArm:
    """Draw the arm of a mixture."""
    return MixedArm.draw(random, arm, kind is ErrorKind.MIXTURE_RANDOM, FACTORS.get(kind, 1.0))


def reported_poses(
    random: np.random.Generator, kind: ErrorKind, arm: Arm, joints: FloatArray, options: CellOptions
) -> tuple[FloatArray, FloatArray]:
    """`T_base_flange` (K, 4, 4) and joints (K, 6) as the robot reports them; it truly stands at `joints`."""
    true = arm.forward(joints)
    if kind in {ErrorKind.WHITE_FLANGE, ErrorKind.WHITE_BASE, ErrorKind.ROBOT_NOISE_1_DEG}:
        degrees = (
            1.0 if kind is ErrorKind.ROBOT_NOISE_1_DEG else log_uniform(random, options.rotation_sigma_deg)
        )
        if options.translation_sigma_m is None:
            metres = np.deg2rad(degrees) * log_uniform(random, options.lever_m)
        else:
            metres = log_uniform(random, options.translation_sigma_m)
        errors = _core.se3_exp(np.array([random_twist(random, metres, degrees) for _ in joints]))
        return errors @ true if kind is ErrorKind.WHITE_BASE else true @ errors, joints
    if kind is ErrorKind.ENCODER:
        sigma = np.deg2rad(log_uniform(random, options.encoder_sigma_deg))
        read = joints + sigma * random.standard_normal(joints.shape)
        return arm.forward(read), read
    if kind is ErrorKind.JOINT_OFFSETS:
        offsets = np.deg2rad(log_uniform(random, options.offset_sigma_deg)) * random.standard_normal(6)
        offsets[[0, 5]] = 0.0
        return arm.forward(joints + offsets), joints + offsets
    if kind is ErrorKind.SMOOTH_KINEMATIC:
        metres = log_uniform(random, options.length_sigma_m)
        degrees = log_uniform(random, options.twist_sigma_deg)
        built = random_displacements(random, arm, metres, float(np.deg2rad(degrees)))
        return displaced(arm, built).forward(joints), joints
    return true, joints
