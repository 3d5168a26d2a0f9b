"""A simulated rig to be driven: its robot and cameras, and a truth that the session does not see."""

import zlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from handeye.cameras.protocol import Frame, ImageSource, Points
from handeye.codes import Code
from handeye.errors import InputError
from handeye.planning.collisions import Body as ArmBody
from handeye.planning.collisions import Workspace
from handeye.planning.constraints import ViewLimits
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Robot
from handeye.robots.simulated import SimulatedArm
from handeye.session.attempt import Cell, Eye
from handeye.session.faults import FaultyCamera, FaultyRobot
from handeye.session.observer import Observer
from handeye.session.rig_prepared import RigPrepared
from handeye.session.settings import Configuration, RigSettings
from handeye.session.starting import Start
from handeye.simulation.cells import ARM, simulated_arm
from handeye.simulation.rigs import BOARDS, RigOptions, SimulatedRig, draw_rig, draw_stations, seen_targets
from handeye.types import Body, MountedTarget, Pose, RigRecording, RigTruth
from handeye.types.arrays import FloatArray

__all__ = ["ARM", "rig_cell"]
# Places to begin from, of which the first that is free is taken.
STARTS = 8
# The cameras beside the arm stand farther from the target on it than is usual.
LIMITS = ViewLimits((0.25, 1.8), float(np.deg2rad(60.0)))


class RigCamera:
    """One camera of a simulated rig, as it sees one board; chance depends on seed and label alone."""

    def __init__(
        self, rig: SimulatedRig, name: tuple[str, str], standing: Callable[[], Pose], seed: int
    ) -> None:
        self._rig, self._name, self._standing, self._seed = rig, name, standing, seed

    def grab(self, label: str) -> Frame:
        """Return the points of the board, none where the camera does not see it whole."""
        camera, target = self._name
        chance = zlib.crc32(f"{label} {camera} {target}".encode())
        random = np.random.default_rng([self._seed, 12, chance])
        pixels = self._rig.seen(camera, target, self._standing(), random)
        ids = np.arange(0 if pixels is None else len(pixels), dtype=np.int64)
        return Frame(None, Points(ids, np.zeros((0, 2)) if pixels is None else pixels))


def rig_cell(
    configuration: Configuration,
    *,
    confirm: Callable[[Goal], bool] | None = None,
    observer: Observer | None = None,
) -> RigPrepared:
    """Return a simulated rig with the arm's errors of the settings; the same for the same settings.

    Raises
    ------
    InputError
        A camera that is not there, or another arm than the rig's.
    """
    seed, wrong = configuration.seed, configuration.simulation
    asked = configuration.rig or RigSettings()
    if configuration.robot not in {None, ARM}:
        raise InputError(
            f"the simulated rig has the arm {ARM}, not {configuration.robot}",
            code=Code.UNKNOWN_ROBOT,
            hint="leave --robot out",
        )
    random = np.random.default_rng([seed, 11])
    arm = simulated_arm()
    options = RigOptions(stations=STARTS, fewest_seen=4)
    rig = draw_rig(random, options)
    unknown = set(asked.cameras or ()) - set(rig.given)
    if unknown:
        raise InputError(
            f"no camera {', '.join(sorted(unknown))[:100]}, expected some of {', '.join(rig.given)}",
            code=Code.UNKNOWN_CAMERA,
        )
    names = [name for name in rig.given if asked.cameras is None or name in asked.cameras]
    targets = seen_targets(rig, names)
    space = configuration.workspace() if configuration.workspace_m else _surrounding(arm)
    start = _free(arm, space, draw_stations(random, arm, rig, options))
    hidden = SimulatedArm(arm, wrong.errors, seed, start.joints_rad)
    robot: Robot = hidden if wrong.faults is None else FaultyRobot(hidden, wrong.faults, seed)
    eyes: list[Eye] = []
    for name in names:
        for target in targets:
            moves = rig.given[name].body is not BOARDS[target].body
            if not moves and BOARDS[target].body is Body.FLANGE:
                continue  # the board on the flange hangs where its cameras do not look
            source: ImageSource = RigCamera(rig, (name, target), lambda: hidden.hidden_pose, seed)
            if wrong.faults is not None:
                source = FaultyCamera(source, wrong.faults, 100 * seed + len(eyes))
            eyes.append(Eye((name, target), source, rig.given[name].camera, BOARDS[target].target, moves))
    cell = Cell(
        robot,
        eyes[0].source,
        arm,
        space,
        eyes[0].camera,
        eyes[0].target,
        configuration.timeouts.without_clock(),
        confirm,
        speed_rad_s=configuration.speed_rad_s,
        observer=observer or Observer(),
        several=tuple(eyes),
    )
    boards: dict[str, MountedTarget] = {name: BOARDS[name] for name in targets}
    cameras = {name: rig.given[name] for name in names}
    recording = RigRecording(f"simulated rig {seed}", cameras, boards, (), None, "simulated")
    truth = RigTruth(
        {name: rig.camera_poses[name].inverse() for name in names},
        {name: rig.target_poses[name] for name in targets},
    )
    limits = LIMITS if configuration.limits == ViewLimits() else configuration.limits
    asked_of = replace(configuration, robot=ARM, limits=limits)
    return RigPrepared(asked_of, cell, start, recording, truth, hidden)


def _surrounding(arm: Arm) -> Workspace:
    reach = arm.reach_m + 0.2
    return Workspace(np.array([-reach, -reach, -0.15]), np.array([reach, reach, reach]), floor_m=-0.25)


def _free(arm: Arm, space: Workspace, joints: FloatArray) -> Start:
    """Return the first place of these joints (N, n) that the arm may take."""
    free = [i for i, why in enumerate(ArmBody(arm, space).obstacles(joints)) if why is None]
    first = joints[free[0] if free else 0]
    return Start(Pose(arm.forward(first)), tuple(first.tolist()))
