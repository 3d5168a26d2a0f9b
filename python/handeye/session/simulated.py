"""A whole cell in the computer: arm, camera and board, with a truth that the session does not see."""

from dataclasses import dataclass, field

import numpy as np

from handeye.cameras.protocol import ImageSource
from handeye.cameras.simulated import Optics, SimulatedCamera
from handeye.codes import Code
from handeye.errors import InputError, SolveError
from handeye.planning.collisions import Body, Workspace
from handeye.robots import Arm
from handeye.robots.protocol import Robot
from handeye.robots.simulated import ArmErrors, SimulatedArm
from handeye.session.attempt import Cell, Timeouts
from handeye.session.faults import FaultRates, FaultyCamera, FaultyRobot
from handeye.session.starting import Start
from handeye.types import Camera, Chessboard, Mounting, Pose, Recording, Target, Truth

SIZE_PX = (1280, 1024)
ORDINARY = "ordinary"
# Lenses and their parameters: a field of view of 49, 79 and 141 degrees.
LENSES = {
    ORDINARY: ("brown_conrady_5", (1400.0, 1400.0, 640.0, 512.0, -0.1, 0.05, 0.0005, -0.0005, 0.0)),
    "wide": ("brown_conrady_5", (780.0, 780.0, 634.0, 517.0, -0.22, 0.06, -0.0004, 0.0006, -0.008)),
    "fisheye": ("kannala_brandt", (520.0, 520.0, 645.0, 508.0, -0.02, 0.004, -0.002, 0.0003)),
}
# Deviations of a good calibration of the camera: focal lengths and centre in px, coefficients.
_CENTRE_SIGMAS = (0.5, 0.5, 0.5, 0.5)
PARAMETER_SIGMAS = {
    "brown_conrady_5": (*_CENTRE_SIGMAS, 5e-4, 2e-3, 5e-5, 5e-5, 2e-3),
    "kannala_brandt": (*_CENTRE_SIGMAS, 2e-4, 2e-4, 1e-4, 5e-5),
}


def usual_errors() -> ArmErrors:
    """Return errors of an arm in good order: play, encoders, and links that are not quite as drawn."""
    return ArmErrors(
        encoder_sigma_rad=float(np.deg2rad(0.005)),
        offset_sigma_rad=float(np.deg2rad(0.01)),
        length_sigma_m=0.1e-3,
        backlash_rad=float(np.deg2rad(0.005)),
    )


@dataclass(frozen=True)
class SimulationOptions:
    """What a simulated cell is made of; the same options and seed make the same cell.

    Parameters
    ----------
    errors, optics, faults
        Of the arm, the picture, and the drivers.
    camera_error
        Factor on the deviations of the camera's calibration; 0 for a calibration that is exact.
    target
        What is looked at.
    lens
        One of `LENSES`.
    focal_px
        Another focal length of it; None for its own.

    Examples
    --------
    >>> SimulationOptions(seed=3, camera_error=0.0).mounting.value
    'eye_in_hand'
    """

    seed: int = 0
    mounting: Mounting = Mounting.EYE_IN_HAND
    target: Target = field(default_factory=lambda: Chessboard(7, 10, 0.02))
    errors: ArmErrors = field(default_factory=usual_errors)
    optics: Optics = field(default_factory=Optics)
    faults: FaultRates | None = None
    camera_error: float = 1.0
    lens: str = ORDINARY
    focal_px: float | None = None


@dataclass(frozen=True, eq=False)
class SimulatedCell:
    """A cell, where its arm stands first, an empty recording of it, and the truth.

    Examples
    --------
    >>> from handeye.robots import open_arm
    >>> simulated = simulated_cell(open_arm("ur5e"))
    >>> len(simulated.recording), simulated.truth.X is None
    (0, False)
    """

    cell: Cell
    start: Start
    recording: Recording
    truth: Truth
    hidden_arm: SimulatedArm
    true_camera: Camera


def simulated_cell(arm: Arm, options: SimulationOptions | None = None) -> SimulatedCell:
    """Return a simulated cell.

    The board lies on the table in front of the arm, the camera beside the flange and looking along it; or the
    camera stands over the table and the board is on the flange.

    Parameters
    ----------
    arm
        Its description.
    options
        Seed, mounting, errors; those of an arm in good order by default.

    Raises
    ------
    SolveError
        The arm reaches no posture with its flange down in front of it.
    InputError
        As `usual_camera`.

    Examples
    --------
    >>> from handeye.robots import open_arm
    >>> simulated_cell(open_arm("ur5e"), SimulationOptions(seed=3)).start.posture_known
    True
    """
    options = options or SimulationOptions()
    random = np.random.default_rng([options.seed, 0])
    workspace = surrounding(arm)
    T_base_flange, joints = looking_down(arm, workspace)
    known = usual_camera(options.lens, options.focal_px)
    sigmas = np.array(PARAMETER_SIGMAS[known.lens])
    off = options.camera_error * sigmas * random.standard_normal(len(sigmas))
    true_camera = Camera(known.lens, known.parameters + off, *SIZE_PX)
    truth = _mounted(random, options, T_base_flange)
    robot = SimulatedArm(arm, options.errors, options.seed, joints)
    X, Y = truth.X or Pose.identity(), truth.Y or Pose.identity()

    def standing_at() -> Pose:
        return X @ options.mounting.chain(robot.hidden_pose) @ Y

    source: ImageSource = SimulatedCamera(
        true_camera, options.target, standing_at, options.optics, options.seed
    )
    driver: Robot = robot
    if options.faults is not None:
        source = FaultyCamera(source, options.faults, options.seed)
        driver = FaultyRobot(robot, options.faults, options.seed)
    cell = Cell(driver, source, arm, workspace, known, options.target, Timeouts().without_clock())
    recording = Recording(
        f"simulated {arm.name} {options.seed}",
        options.mounting,
        known,
        options.target,
        (),
        None,
        "simulated cell",
    )
    return SimulatedCell(cell, Start(T_base_flange, joints), recording, truth, robot, true_camera)


def usual_camera(lens: str = ORDINARY, focal_px: float | None = None) -> Camera:
    """Return the camera of a simulated cell as a good calibration has it, with its covariance.

    Parameters
    ----------
    lens
        One of `LENSES`.
    focal_px
        Another focal length than its own.

    Raises
    ------
    InputError
        No such lens, or a focal length that is not above zero.

    Examples
    --------
    >>> usual_camera("fisheye").lens
    'kannala_brandt'
    >>> float(usual_camera(focal_px=2000.0).parameters[0])
    2000.0
    """
    if lens not in LENSES:
        raise InputError(f"lens {lens!r}, expected one of {', '.join(LENSES)}", code=Code.UNKNOWN_LENS)
    model, parameters = LENSES[lens]
    if focal_px is not None:
        parameters = (focal_px, focal_px, *parameters[2:])
    return Camera(model, parameters, *SIZE_PX, covariance=np.diag(np.square(PARAMETER_SIGMAS[model])))


# Postures drawn where arms of few joints reach none that is asked for, and of how many ways are tried.
_DRAWN, _TRIED = 4000, 200
# Cosine of what counts as down.
_ABOUT_DOWN = 0.97


def surrounding(arm: Arm) -> Workspace:
    """Return the box in front of, beside and above an arm that stands on a table, or slides over it."""
    reach = arm.reach_m + 0.2
    if any(arm.sliding):
        ways = np.abs(arm.limits[np.array(arm.sliding)]).max(axis=1)
        reach += float(ways[np.isfinite(ways)].sum() + np.linalg.norm(arm.joints[0].placement.translation))
    return Workspace(np.array([-reach, -reach, 0.02]), np.array([reach, reach, reach + 0.3]))


def looking_down(arm: Arm, workspace: Workspace) -> tuple[Pose, tuple[float, ...]]:
    """Return a pose with the flange down in front of the arm, and the posture farthest from all limits.

    Raises
    ------
    SolveError
        There is none.
    """
    reach = arm.reach_m
    body = Body(arm, workspace)
    low, high = np.clip(arm.limits.T, -2 * np.pi, 2 * np.pi)
    for forward, up in ((0.45, 0.6), (0.4, 0.5), (0.5, 0.45), (0.35, 0.4), (0.3, 0.6)):
        pose = Pose(
            [
                [1.0, 0.0, 0.0, forward * reach],
                [0.0, -1.0, 0.0, 0.0],
                [0.0, 0.0, -1.0, up * reach],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
        postures = arm.postures(pose)
        free = [q for q in postures if body.obstacles(q[np.newaxis])[0] is None]
        if free:
            room = [float(np.min(np.minimum(q - low, high - q) / (high - low))) for q in free]
            best = free[int(np.argmax(room))]
            return Pose(arm.forward(best)), tuple(best.tolist())
    drawn = np.random.default_rng(0).uniform(low, high, (_DRAWN, len(arm)))
    flanges = arm.forward(drawn)
    # What arms of few joints reach: the flange about down, in front and not on the table.
    ahead, above = flanges[:, 0, 3], flanges[:, 2, 3]
    usable = -flanges[:, 2, 2] > _ABOUT_DOWN
    if usable.any():
        usable &= (ahead > 0.3 * ahead[usable].max()) & (above > 0.5 * above[usable].max())
    room = np.min(np.minimum(drawn - low, high - drawn) / (high - low), axis=1)
    for number in np.flatnonzero(usable)[np.argsort(-room[usable])][:_TRIED]:
        if body.obstacles(drawn[number][np.newaxis])[0] is None:
            return Pose(flanges[number]), tuple(drawn[number].tolist())
    raise SolveError(
        f"arm {arm.name}: no posture found with the flange down in front of it",
        code=Code.NO_START,
        hint="give the joints to start from",
    )


def _mounted(random: np.random.Generator, options: SimulationOptions, T_base_flange: Pose) -> Truth:
    """Draw X and Y such that the board is in the middle of the first picture, more or less."""

    def jitter(metres: float, degrees: float) -> Pose:
        turn = np.deg2rad(degrees) * random.uniform(-1, 1, 3)
        return Pose.exp([0, 0, 0, *turn]) @ Pose.exp([*(metres * random.uniform(-1, 1, 3)), 0, 0, 0])

    target = options.target
    middle = target.points.mean(axis=0)
    extent = float(np.ptp(target.points, axis=0).max())
    centred = Pose.exp([*(-middle), 0, 0, 0])
    turned = Pose.exp([0, 0, 0, 0, 0, float(random.uniform(-np.pi, np.pi))])
    if options.mounting is Mounting.EYE_IN_HAND:
        T_flange_camera = Pose.exp([0.06, 0.02, 0.05, 0, 0, 0]) @ jitter(0.02, 5.0) @ turned
        distance = T_base_flange.translation[2] - 0.06
        seen = Pose.exp([0, 0, distance, 0, 0, 0]) @ jitter(0.02, 8.0) @ centred
        X = T_flange_camera.inverse()
        T_base_target = T_base_flange @ T_flange_camera @ seen
        return Truth(X, T_base_target)
    T_flange_target = Pose.exp([0, 0, 0.03, 0, 0, 0]) @ jitter(0.01, 5.0) @ turned
    # The board faces away from the flange, its z axis into it.
    T_flange_target = T_flange_target @ Pose.exp([0, 0, 0, np.pi, 0, 0]) @ centred
    seen = Pose.exp([0, 0, max(0.6, 3 * extent), 0, 0, 0]) @ jitter(0.02, 8.0) @ centred
    return Truth(seen @ (T_base_flange @ T_flange_target).inverse(), T_flange_target)
