"""A twin of the cell of Yang, Rebello and Waslander (2023), section V-B: seven sets whose truth is known.

A 6-axis arm with the layout of the Epson C4L, a monochrome camera of 1280 x 1024 pixels on its flange, and a
symmetric grid of 4 x 4 circles. The arm is not what it says: every joint sits wrongly on the link before it,
so that its error is about a millimetre and changes smoothly with the posture, as that of real arms does.
Each set has a part to choose views from and a part to validate on, drawn alike.
"""

import zlib
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.cameras.render import Appearance, BoardRenderer
from handeye.codes import Code
from handeye.detection import Detection, detect
from handeye.errors import InputError, SolveError
from handeye.planning.collisions import Body, Workspace
from handeye.robots import Arm, open_arm
from handeye.robots.displaced import displaced, random_displacements
from handeye.simulation.cells import camera_information, symmetric
from handeye.types import Camera, CircleGrid, Mounting, Pose, Recording, Truth, View
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.pose import inverses

ARM = "epson_c4l"
TARGET = CircleGrid(4, 4, 0.04, 0.02)
LENS, SIZE_PX = "brown_conrady_5", (1280, 1024)
PARAMETERS = np.array([1400.0, 1400.0, 640.0, 512.0, -0.1, 0.05, 0.0005, -0.0005, 0.0])
MARGIN_PX = 20.0
# Where the arm is bent forward and down over the table.
_FORWARD_M, _MOST_DRAWS = 0.45, 200
# What is left of tilt and roll in a view that looks straight at the grid.
_STRAIGHT = 0.05


@dataclass(frozen=True)
class TwinOptions:
    """What a set is drawn from.

    Parameters
    ----------
    training_views, validation_views
        Views to choose from, and to validate on.
    arm_error_m
        What the arm's poses are off by, root mean square over the training part, after the best choice of
        base and flange.
    twist_per_length_rad_m
        Error of the joints' axes per error of their places.
    pixel_sigma_px
        Noise of the circles' centres per axis, unless pictures are rendered.
    distance_m, tilt_deg, roll_deg
        Of the views; hardly any roll, which the paper forbids: its grid looks the same after a quarter turn.
    straight_share
        Share of the views that look straight at the grid. In public sets of real arms two thirds of the views
        have one orientation.
    calibration_views
        Views that the camera was calibrated with beforehand.
    rendered
        Render every picture and look for the circles in it.

    Raises
    ------
    InputError
        Too few views.
    """

    training_views: int = 30
    validation_views: int = 15
    arm_error_m: float = 1.0e-3
    twist_per_length_rad_m: float = float(np.deg2rad(0.15)) / 1e-3
    pixel_sigma_px: float = 0.05
    distance_m: tuple[float, float] = (0.3, 0.8)
    tilt_deg: float = 45.0
    roll_deg: float = 10.0
    straight_share: float = 2 / 3
    calibration_views: int = 20
    rendered: bool = False

    def __post_init__(self) -> None:
        if self.training_views < 8 or self.validation_views < 2:
            raise InputError(
                "a twin needs 8 views to choose from and 2 to validate on", code=Code.TOO_FEW_VIEWS
            )


@dataclass(frozen=True, eq=False)
class TwinSet:
    """One set: its views, the first of them to choose from, the others to validate on.

    Parameters
    ----------
    arm_error_mm, arm_error_deg
        Root mean square of what the poses are off by, after the best choice of base and flange.
    """

    recording: Recording
    training: tuple[int, ...]
    validation: tuple[int, ...]
    arm_error_mm: float
    arm_error_deg: float


def twin_set(number: int, options: TwinOptions | None = None, *, seed: int = 0) -> TwinSet:
    """Return a set, the same for the same number and seed.

    Raises
    ------
    SolveError
        So many views could not be drawn.
    """
    options = options or TwinOptions()
    random = np.random.default_rng([seed, zlib.crc32(b"twin"), number])
    arm = open_arm(ARM)
    known, true_camera = _cameras(random, options)
    X, Y = _mounted(random)
    count = options.training_views + options.validation_views
    joints = _postures(random, arm, true_camera, X, Y, count, options)
    true_arm, off = _wrong_arm(random, arm, joints[: options.training_views], options)
    flange = true_arm.forward(joints)
    seen = X.matrix @ inverses(flange) @ Y.matrix
    reported = arm.forward(joints)
    renderer = (
        BoardRenderer(true_camera, TARGET, Appearance(blur_px=0.6, noise=2.0)) if options.rendered else None
    )
    views: list[View] = []
    for k, pose in enumerate(seen):
        found = _observed(random, true_camera, Pose(pose), options, renderer)
        if found is not None:
            name = f"{'train' if k < options.training_views else 'validate'}_{k + 1:02d}"
            ids, pixels = found
            views.append(View(name, Pose(reported[k]), ids, pixels, joints_rad=joints[k].tolist()))
    recording = Recording(
        f"set_{number + 1}", Mounting.EYE_IN_HAND, known, TARGET, tuple(views), Truth(X, Y), "simulated twin"
    )
    training = tuple(i for i, view in enumerate(views) if view.name.startswith("train"))
    validation = tuple(i for i, view in enumerate(views) if view.name.startswith("validate"))
    return TwinSet(recording, training, validation, 1e3 * off[0], float(np.rad2deg(off[1])))


def _cameras(random: np.random.Generator, options: TwinOptions) -> tuple[Camera, Camera]:
    """Return the camera as it was calibrated, with its covariance, and as it is."""
    nominal = Camera(LENS, PARAMETERS, *SIZE_PX)
    information = np.zeros((len(PARAMETERS), len(PARAMETERS)))
    count = 0
    while count < options.calibration_views:
        pose = _look(random, nominal, options)
        if pose is not None:
            information += camera_information(nominal, TARGET, pose)
            count += 1
    covariance = symmetric(np.asarray(np.linalg.inv(information), np.float64) * options.pixel_sigma_px**2)
    off = random.multivariate_normal(np.zeros(len(PARAMETERS)), covariance, method="cholesky")
    return Camera(LENS, PARAMETERS, *SIZE_PX, covariance=covariance), Camera(LENS, PARAMETERS + off, *SIZE_PX)


def _mounted(random: np.random.Generator) -> tuple[Pose, Pose]:
    """Draw X with the camera beside the flange, and Y with the grid on the table in front of the arm."""
    turn = np.deg2rad(8.0) * random.uniform(-1, 1, 3)
    T_flange_camera = Pose.exp([0.05, 0.0, 0.06, 0, 0, 0]) @ Pose.exp(
        [*random.uniform(-0.02, 0.02, 3), *turn]
    )
    T_flange_camera = T_flange_camera @ Pose.exp([0, 0, 0, 0, 0, float(random.uniform(-np.pi, np.pi))])
    at = [_FORWARD_M + random.uniform(-0.05, 0.05), random.uniform(-0.1, 0.1), random.uniform(0.0, 0.05)]
    down = Pose.exp([*at, 0, 0, 0]) @ Pose.exp([0, 0, 0, np.pi, 0, 0])
    spin = Pose.exp([0, 0, 0, 0, 0, float(random.uniform(-np.pi, np.pi))])
    tip = Pose.exp([0, 0, 0, *(np.deg2rad(3.0) * random.uniform(-1, 1, 2)), 0])
    centred = Pose.exp([*(-TARGET.points.mean(axis=0)), 0, 0, 0])
    return T_flange_camera.inverse(), down @ spin @ tip @ centred


def _look(random: np.random.Generator, camera: Camera, options: TwinOptions) -> FloatArray | None:
    """Draw `T_camera_target` (4, 4) with the whole grid in the image; None if this draw is not."""
    tilt = float(np.deg2rad(random.uniform(0, options.tilt_deg)))
    azimuth = float(random.uniform(-np.pi, np.pi))
    roll = float(np.deg2rad(random.uniform(-options.roll_deg, options.roll_deg)))
    if random.uniform() < options.straight_share:
        tilt, roll = _STRAIGHT * tilt, _STRAIGHT * roll
    turn = Pose.exp([0, 0, 0, 0, 0, roll]) @ Pose.exp(
        [0, 0, 0, tilt * np.cos(azimuth), tilt * np.sin(azimuth), 0]
    )
    distance = float(random.uniform(*options.distance_m))
    u, v = random.uniform(0.15, 0.85, 2) * SIZE_PX
    fx, fy, cx, cy = camera.parameters[:4]
    matrix = turn.matrix.copy()
    aim = distance * np.array([(u - cx) / fx, (v - cy) / fy, 1.0])
    matrix[:3, 3] = aim - turn.rotation @ TARGET.points.mean(axis=0)
    pixels, valid = _core.project_features(
        camera.lens, camera.parameters, matrix, TARGET.points, TARGET.radii_m
    )
    # A circle reaches beyond its centre.
    edge = MARGIN_PX + 1.2 * fx * TARGET.radius_m / distance
    inside = (pixels >= edge) & (pixels <= np.array(SIZE_PX) - 1 - edge)
    return matrix if valid.all() and inside.all() else None


def _postures(
    random: np.random.Generator,
    arm: Arm,
    camera: Camera,
    X: Pose,
    Y: Pose,
    count: int,
    options: TwinOptions,
) -> FloatArray:
    """Draw joints (K, 6) from which the whole grid is seen and nothing is touched."""
    reach = np.array([1.2, 1.2, 1.4])
    body = Body(arm, Workspace(np.array([-1.2, -1.2, 0.02]), reach), X.inverse().matrix[np.newaxis, :3, 3])
    found: list[FloatArray] = []
    start: FloatArray | None = None
    for _ in range(_MOST_DRAWS):
        looks = [pose for _ in range(40) if (pose := _look(random, camera, options)) is not None]
        seen = np.array(looks, np.float64).reshape(-1, 4, 4)
        flange = inverses(X.inverse().matrix @ seen @ Y.inverse().matrix)
        if start is None:
            free = [
                q
                for pose in flange
                for q in arm.postures(Pose(pose))
                if body.obstacles(q[np.newaxis])[0] is None
            ]
            start = free[0] if free else None
            continue
        joints, reached = arm.inverse_all(flange, start, attempts=2)
        joints = joints[np.flatnonzero(reached)]
        found += [q for q, why in zip(joints, body.obstacles(joints), strict=True) if why is None]
        if len(found) >= count:
            return np.array(found[:count])
    raise SolveError(f"twin: {len(found)} of {count} views drawn", code=Code.NO_VIEWS)


def _wrong_arm(
    random: np.random.Generator, arm: Arm, joints: FloatArray, options: TwinOptions
) -> tuple[Arm, tuple[float, float]]:
    """Return the arm as it was built, and by how much it is off (metres, radians)."""
    metres = random_displacements(random, arm, 1.0, options.twist_per_length_rad_m)
    scale = 1e-4
    wrong = displaced(arm, scale * metres)
    for _ in range(3):  # the error is very nearly proportional
        scale *= options.arm_error_m / arm_error(arm.forward(joints), wrong.forward(joints))[0]
        wrong = displaced(arm, scale * metres)
    return wrong, arm_error(arm.forward(joints), wrong.forward(joints))


def arm_error(reported: FloatArray, true: FloatArray) -> tuple[float, float]:
    """Return by how much poses (K, 4, 4) are off, RMS in metres and radians.

    What a constant change of base and flange explains is no error: it is taken out by least squares.
    """
    left, right = np.zeros(6), np.zeros(6)
    residual = np.zeros((len(true), 6))
    for _ in range(5):
        moved = _core.se3_exp(left[np.newaxis])[0] @ reported @ _core.se3_exp(right[np.newaxis])[0]
        residual = _core.se3_log(inverses(true) @ moved)
        # d residual = Ad(true^-1) left + right, to first order.
        design = np.concatenate(
            [np.concatenate([a, np.eye(6)], axis=1) for a in _core.se3_adjoint(inverses(true))]
        )
        step, *_ = np.linalg.lstsq(design, -residual.ravel(), rcond=None)
        left, right = left + step[:6], right + step[6:]
    squared = (residual**2).reshape(-1, 2, 3).sum(axis=2).mean(axis=0)
    return float(np.sqrt(squared[0])), float(np.sqrt(squared[1]))


def _observed(
    random: np.random.Generator,
    camera: Camera,
    pose: Pose,
    options: TwinOptions,
    renderer: BoardRenderer | None,
) -> tuple[IndexArray, FloatArray] | None:
    """Return ids and pixels of the circles; None where they are not found."""
    pixels, _ = _core.project_features(
        camera.lens, camera.parameters, pose.matrix, TARGET.points, TARGET.radii_m
    )
    ids = np.arange(TARGET.point_count, dtype=np.int64)
    if renderer is None:
        return ids, pixels + options.pixel_sigma_px * random.standard_normal(pixels.shape)
    found = detect(renderer.image(pose, random), TARGET)
    if not isinstance(found, Detection) or len(found) < TARGET.point_count:
        return None
    # Which circle is which cannot be seen; that is another question, and here it is taken as known.
    order = np.argsort(found.point_ids)
    seen = found.pixels[order]
    labels = min(TARGET.symmetries, key=lambda turn: float(np.abs(seen - pixels[turn]).max()))
    return np.asarray(labels), seen
