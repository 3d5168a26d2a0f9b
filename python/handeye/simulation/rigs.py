"""Made-up cells with several cameras and boards, for Monte Carlo: two on the flange, two beside the arm.

A board lies on the table and another hangs on the flange, upright. The cameras on the flange look along the
tool, those beside look at the arm from in front, from two sides; they may see the board on the table too,
which the arm does not move. The errors are those of `handeye.simulation.cells`.
"""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError, SolveError
from handeye.robots import Arm
from handeye.simulation.cells import (
    LENS,
    MARGIN_PX,
    MIXTURES,
    OF_THE_ARM,
    PARAMETERS,
    SIZE_PX,
    CellOptions,
    ErrorKind,
    calibration_covariance,
    camera_pose,
    draw_mixed,
    points_in_camera,
    postures_near,
    reported_poses,
    simulated_arm,
)
from handeye.simulation.mixed_arm import log_uniform, random_twist
from handeye.types import (
    Body,
    Camera,
    CameraView,
    Chessboard,
    MountedCamera,
    MountedTarget,
    Pose,
    RigRecording,
    RigTruth,
    Target,
    View,
)
from handeye.types.arrays import FloatArray

# A board seen under more than this is not found.
STEEPEST_RAD = np.deg2rad(65.0)
MOST_DRAWS = 4000


@dataclass(frozen=True)
class RigOptions:
    """What a rig is drawn from.

    Parameters
    ----------
    on_flange, beside
        Number of cameras on the flange, and beside the arm (at most two each).
    stations
        Number of stations.
    fewest_seen
        Fewest cameras that must see a board at a station, of those that there are.
    cell
        Levels of the errors.
    """

    on_flange: int = 2
    beside: int = 2
    stations: int = 12
    fewest_seen: int = 3
    cell: CellOptions = field(
        default_factory=lambda: CellOptions(roll_deg=(-45.0, 45.0), tilt_deg=(0.0, 35.0))
    )


TABLE, TOOL = "table", "tool"
BOARDS = {
    TABLE: MountedTarget(Chessboard(8, 11, 0.025), Body.BASE),
    TOOL: MountedTarget(Chessboard(7, 10, 0.02), Body.FLANGE),
}
HAND_NAMES, BESIDE_NAMES = ("left", "right"), ("front", "side")


def simulate_rig(
    kind: ErrorKind, number: int, options: RigOptions | None = None, *, seed: int = 0
) -> RigRecording:
    """Return the recording of a rig with its truth, the same for the same number and seed.

    Raises
    ------
    InputError
        A kind of error that is not of the arm.
    SolveError
        No stations could be drawn within these options.
    """
    options = options or RigOptions()
    kind = ErrorKind(kind)
    if kind not in OF_THE_ARM:
        raise InputError(
            f"errors {kind.value}: cameras and boards of a rig have none of their own",
            code=Code.OUT_OF_RANGE,
            hint=f"choose one of the arm: {', '.join(one.value for one in OF_THE_ARM)}",
        )
    random = np.random.default_rng([seed, zlib.crc32(f"rig {kind.value}".encode()), number])
    arm = simulated_arm()
    rig = draw_rig(random, options)
    joints = draw_stations(random, arm, rig, options)
    if kind in MIXTURES:
        reported, read = arm.forward(joints), joints
        flanges = draw_mixed(random, kind, arm).stand(random, joints)
    else:
        reported, read = reported_poses(random, kind, arm, joints, options.cell)
        flanges = arm.forward(joints)
    views: list[CameraView] = []
    for k, (pose, flange) in enumerate(zip(reported, flanges, strict=True)):
        for camera, target, pixels in rig.pictures(Pose(flange), random):
            view = View(
                f"station_{k + 1:02d}",
                Pose(pose),
                np.arange(len(pixels)),
                pixels,
                joints_rad=read[k].tolist(),
            )
            views.append(CameraView(camera, target, view))
    seen = {view.target for view in views}
    truth = RigTruth(
        {name: pose.inverse() for name, pose in rig.camera_poses.items()},
        {name: pose for name, pose in rig.target_poses.items() if name in seen},
    )
    boards = {name: board for name, board in BOARDS.items() if name in seen}
    return RigRecording.of_views(
        f"simulated rig {kind.value} {number}", rig.given, boards, views, truth, "simulated"
    )


@dataclass(frozen=True, eq=False)
class SimulatedRig:
    """Cameras and boards as they truly are.

    Parameters
    ----------
    given
        The cameras as their calibration has them.
    true
        The cameras as they are.
    camera_poses, target_poses
        On what they are fixed to: `T_flange_camera`, `T_base_camera`, and the like of the boards.
    pixel_sigma_px
        Of each camera.
    """

    given: Mapping[str, MountedCamera]
    true: Mapping[str, Camera]
    camera_poses: Mapping[str, Pose]
    target_poses: Mapping[str, Pose]
    pixel_sigma_px: Mapping[str, float]

    def T_camera_target(self, camera: str, target: str, T_base_flange: Pose) -> Pose:
        """Return where a board is in a camera, the flange being where it is."""
        in_base = [
            T_base_flange @ pose if body is Body.FLANGE else pose
            for pose, body in (
                (self.camera_poses[camera], self.given[camera].body),
                (self.target_poses[target], BOARDS[target].body),
            )
        ]
        return in_base[0].inverse() @ in_base[1]

    def sees(self, camera: str, target: str, T_base_flange: Pose) -> bool:
        """Tell whether a camera sees the whole of a board from in front."""
        pose = self.T_camera_target(camera, target, T_base_flange).matrix
        points = points_in_camera(pose, BOARDS[target].target)
        centre = points.mean(axis=0)
        # The printed side is where the z axis of a target does not point.
        if pose[:3, 2] @ centre < np.cos(STEEPEST_RAD) * np.linalg.norm(centre):
            return False
        pixels, seen = _core.project(LENS, self.true[camera].parameters, points)
        inside = (pixels >= MARGIN_PX) & (pixels <= np.array(SIZE_PX) - 1 - MARGIN_PX)
        return bool(seen.all() and inside.all())

    def pictures(self, T_base_flange: Pose, random: np.random.Generator) -> list[tuple[str, str, FloatArray]]:
        """Return camera, board and pixels (P, 2) of every board that is seen whole."""
        found: list[tuple[str, str, FloatArray]] = []
        for camera in self.given:
            for target in BOARDS:
                pixels = self.seen(camera, target, T_base_flange, random)
                if pixels is not None:
                    found.append((camera, target, pixels))
        return found

    def seen(
        self, camera: str, target: str, T_base_flange: Pose, random: np.random.Generator
    ) -> FloatArray | None:
        """Return the pixels (P, 2) of a board that a camera sees whole, None if it does not."""
        board = BOARDS[target]
        if self.given[camera].body is board.body is Body.FLANGE:
            return None  # the board on the flange hangs where its cameras do not look
        if not self.sees(camera, target, T_base_flange):
            return None
        pixels = self.pixels(camera, board.target, self.T_camera_target(camera, target, T_base_flange))
        return pixels + self.pixel_sigma_px[camera] * random.standard_normal(pixels.shape)

    def pixels(self, camera: str, target: Target, T_camera_target: Pose) -> FloatArray:
        """(P, 2) where the points of a board truly are in the image of a camera."""
        pixels, _ = _core.project_features(
            LENS, self.true[camera].parameters, T_camera_target.matrix, target.points, target.radii_m
        )
        return pixels


def seen_targets(rig: SimulatedRig, cameras: Sequence[str]) -> tuple[str, ...]:
    """Return the boards that move against these cameras."""
    bodies = {rig.given[name].body for name in cameras}
    return tuple(name for name, board in BOARDS.items() if bodies - {board.body})


def draw_rig(random: np.random.Generator, options: RigOptions) -> SimulatedRig:
    """Draw cameras and boards."""
    names = [*HAND_NAMES[: options.on_flange], *BESIDE_NAMES[: options.beside]]
    given: dict[str, MountedCamera] = {}
    true: dict[str, Camera] = {}
    sigma: dict[str, float] = {}
    for name in names:
        sigma[name] = log_uniform(random, options.cell.pixel_sigma_px)
        covariance = calibration_covariance(
            random, Camera(LENS, PARAMETERS, *SIZE_PX), sigma[name], options.cell
        )
        off = random.multivariate_normal(np.zeros(len(PARAMETERS)), covariance, method="cholesky")
        true[name] = Camera(LENS, PARAMETERS + off, *SIZE_PX)
        body = Body.FLANGE if name in HAND_NAMES else Body.BASE
        given[name] = MountedCamera(Camera(LENS, PARAMETERS, *SIZE_PX, covariance=covariance), body)
    # Above the table, between the cameras; where the arm works.
    middle = np.array([random.uniform(0.4, 0.5), random.uniform(-0.1, 0.1), -0.2])
    T_base_table = Pose(_placed(middle, [0, 0, -1.0])) @ Pose.exp(random_twist(random, 0.0, 4.0))
    # Turned towards each other, to meet some 0.6 m away.
    poses = {
        name: Pose.exp([0.05, side, 0.05, 0, 0, 0])
        @ Pose.exp([0, 0, 0, side / 0.6, 0, 0])
        @ Pose.exp(random_twist(random, 0.01, 2.0))
        for name, side in zip(HAND_NAMES, (-0.05, 0.05), strict=True)
    }
    for name, azimuth in zip(BESIDE_NAMES, (-0.5, 0.5), strict=True):
        away = np.array([np.cos(azimuth), np.sin(azimuth), 0.75])
        place = middle + [0, 0, 0.45] + 1.15 * away / np.linalg.norm(away) + random.normal(0, 0.03, 3)
        poses[name] = Pose(_placed(place, -away)) @ Pose.exp(random_twist(random, 0.0, 3.0))
    # With the tool down the x axis of the flange points away from the base, and so does the printed side.
    T_flange_tool = Pose(_placed(np.array([0.06, 0, -0.02]), [-1.0, 0, 0.5]))
    T_flange_tool = T_flange_tool @ Pose.exp(random_twist(random, 0.01, 4.0))
    centred = {
        TABLE: T_base_table @ _uncentred(BOARDS[TABLE].target),
        TOOL: T_flange_tool @ _uncentred(BOARDS[TOOL].target),
    }
    return SimulatedRig(given, true, {name: poses[name] for name in names}, centred, sigma)


def _placed(place: FloatArray, towards: list[float] | FloatArray) -> FloatArray:
    """Return a pose (4, 4) at a place (3,), its z axis in a direction (3,), its y axis down."""
    z = np.asarray(towards, dtype=float) / np.linalg.norm(towards)
    down = np.array([0, 0, -1.0]) if abs(z[2]) < 0.99 else np.array([0, -1.0, 0])
    x = np.cross(down, z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    pose[:3, 3] = place
    return pose


def _uncentred(target: Target) -> Pose:
    """Return the pose of a board's frame in that of its middle."""
    return Pose.exp([*(-target.points.mean(axis=0)), 0, 0, 0])


def draw_stations(
    random: np.random.Generator, arm: Arm, rig: SimulatedRig, options: RigOptions
) -> FloatArray:
    """Draw joint angles (K, n) at which enough cameras see a board that moves against them."""
    leading = next(iter(rig.given))
    target = TABLE if rig.given[leading].body is Body.FLANGE else TOOL
    fewest = min(options.fewest_seen, len(rig.given))
    joints: list[FloatArray] = []
    for _ in range(MOST_DRAWS):
        seen = camera_pose(random, rig.true[leading], options.cell)
        if seen is None:
            continue
        T_camera_target = Pose(seen)
        if target == TABLE:
            T_base_camera = rig.target_poses[TABLE] @ T_camera_target.inverse()
            flange = T_base_camera @ rig.camera_poses[leading].inverse()
        else:
            flange = rig.camera_poses[leading] @ T_camera_target @ rig.target_poses[TOOL].inverse()
        watching = [
            camera
            for camera, one in rig.given.items()
            if rig.sees(camera, TABLE if one.body is Body.FLANGE else TOOL, flange)
        ]
        if len(watching) < fewest:
            continue
        goal = flange.matrix[None]
        found, reached = arm.inverse_all(goal, postures_near(arm, goal), attempts=1)
        if reached[0]:
            joints.append(found[0])
        if len(joints) == options.stations:
            return np.array(joints)
    raise SolveError(
        f"{len(joints)} of {options.stations} stations found in {MOST_DRAWS} attempts",
        code=Code.NO_VIEWS,
        hint="allow other distances or smaller tilts",
    )
