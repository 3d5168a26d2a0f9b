"""Everything that was asked for, as it is written into a session, and the cell that follows from it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import msgspec
import numpy as np

from handeye.cameras.render import Appearance
from handeye.cameras.simulated import Optics
from handeye.errors import InputError
from handeye.importing import SourceOptions, open_folder
from handeye.planning.collisions import Workspace
from handeye.planning.constraints import ViewLimits
from handeye.planning.policies import make_policy
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm, open_arm, shipped_arms
from handeye.robots.protocol import Goal
from handeye.robots.replay import ReplayRobot
from handeye.robots.shapes import read_shapes
from handeye.robots.simulated import ArmErrors, SimulatedArm
from handeye.session.attempt import Cell, Patience
from handeye.session.choosing import ArmChooser
from handeye.session.deciding import Chooser
from handeye.session.drivers import REPLAY, Person, open_camera, open_robot, replayed_camera
from handeye.session.faults import FaultRates
from handeye.session.loop import Progress, Session
from handeye.session.recorded import RecordedChooser
from handeye.session.simulated import SimulationOptions, simulated_cell, usual_errors
from handeye.session.starting import Start
from handeye.session.store import SessionStore, create_session, open_session
from handeye.session.wish import Wish
from handeye.types import Camera, Mounting, Pose, Recording, Target, Truth, View
from handeye.types.calibration import ModelName
from handeye.types.plain import read_document

SIMULATED = "simulated"


class Collisions(StrEnum):
    """By what it is judged whether the links of an arm touch one another."""

    AUTO = "auto"
    """Their shapes where the description and the extra `meshes` have them, capsules otherwise."""
    MESHES = "meshes"
    CAPSULES = "capsules"


@dataclass(frozen=True)
class Simulation:
    """What is wrong in a simulated cell, in the units of `ArmErrors` and `Appearance`."""

    errors: ArmErrors = field(default_factory=usual_errors)
    faults: FaultRates | None = None
    blur_px: float = 0.6
    pixel_noise: float = 2.0
    occluded_share: float = 0.0
    points_only: float | None = None
    camera_error: float = 1.0
    hang_s: float = 60.0


@dataclass(frozen=True)
class Configuration:
    """A run, in plain values.

    Parameters
    ----------
    robot
        Name of a shipped arm, or a URDF file; None for a replay of an arm that is not known.
    driver, images
        Specifications of the drivers, see `handeye.session.drivers`.
    workspace_m
        Corners of the box that no motion may leave; None only for a simulated cell.
    collisions
        What links are judged by; once a session has begun it is no longer `auto`.
    start_rad
        Joints to start from, for an arm that is simulated; others start where they stand.
    """

    robot: str | None
    driver: str = SIMULATED
    images: str = SIMULATED
    mounting: Mounting = Mounting.EYE_IN_HAND
    accuracy_mm: float | None = 0.5
    accuracy_deg: float | None = 0.05
    most_views: int = 20
    seed: int = 0
    model: ModelName = ModelName.AUTO
    policy: str = "next_best_view"
    speed_rad_s: float = 0.5
    failures_in_a_row: int = 10
    joints_err: bool = True
    refine: bool = True
    workspace_m: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    floor_m: float = 0.0
    collisions: Collisions = Collisions.AUTO
    limits: ViewLimits = field(default_factory=ViewLimits)
    patience: Patience = field(default_factory=Patience)
    simulation: Simulation = field(default_factory=Simulation)

    @property
    def is_simulated(self) -> bool:
        """Whether nothing moves."""
        return self.driver == SIMULATED

    @property
    def is_replay(self) -> bool:
        """Whether a recording is gone through again."""
        return self.driver.partition(":")[0] == REPLAY

    def wish(self) -> Wish:
        """Return what is asked for."""
        return Wish(
            self.accuracy_mm,
            self.accuracy_deg,
            self.most_views,
            self.seed,
            ModelName(self.model),
            self.failures_in_a_row,
            speed_rad_s=self.speed_rad_s,
            joints_err=self.joints_err,
            refine=self.refine,
            policy=make_policy(self.policy),
        )

    def workspace(self) -> Workspace:
        """Return the stated workspace.

        Raises
        ------
        InputError
            None is stated.
        """
        if self.workspace_m is None:
            raise InputError(
                "no workspace is stated, and without one nothing moves",
                code="no_workspace",
                hint="state the box that the flange may move in, in the frame of the robot's base",
            )
        lower, upper = self.workspace_m
        return Workspace(np.array(lower), np.array(upper), self.floor_m)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON; `from_dict` reads them back."""
        return msgspec.to_builtins(self)

    @classmethod
    def from_dict(cls, data: object) -> "Configuration":
        """Read what `to_dict` wrote.

        Raises
        ------
        InputError
            A missing or unusable field.
        """
        return read_document(data, cls, "settings")


@dataclass(frozen=True, eq=False)
class Prepared:
    """A run, ready to begin.

    Parameters
    ----------
    cell
        The world.
    start
        Where the arm stands; None in a replay, which begins with any view.
    recording
        What its views will be written into.
    truth
        What is true, where that is known.
    hidden_arm
        The arm as it is, if it is simulated.
    recorded
        The views that a replay goes through.
    """

    configuration: Configuration
    cell: Cell
    start: Start | None
    recording: Recording
    truth: Truth | None = None
    hidden_arm: SimulatedArm | None = None
    recorded: tuple[View, ...] | None = None

    @property
    def arm(self) -> Arm:
        """The arm.

        Raises
        ------
        InputError
            A replay of an arm that is not known.
        """
        if self.cell.arm is None:
            raise InputError(
                "the arm is not known", code="missing_value", hint="name it with its description"
            )
        return self.cell.arm

    def chooser(self) -> Chooser:
        """Return what decides where to go.

        Raises
        ------
        InputError
            Recorded poses that are not those of the arm.
        """
        cell, wish = self.cell, self.configuration.wish()
        if self.recorded is not None:
            return RecordedChooser(self.recorded, wish, cell.arm)
        if cell.workspace is None or self.start is None:
            raise InputError("a workspace and where the arm stands are needed", code="missing_value")
        limits = self.configuration.limits
        return ArmChooser(self.arm, cell.workspace, cell.camera, self.start, wish, limits, cell.solids)


def prepare(
    configuration: Configuration,
    *,
    camera: Camera | None = None,
    target: Target | None = None,
    person: Person | None = None,
    confirm: Callable[[Goal], bool] | None = None,
    start: Start | None = None,
) -> Prepared:
    """Open the drivers and see where the arm stands; nothing moves.

    Parameters
    ----------
    camera, target
        Needed unless the cell is simulated; a replay has them from its recording.
    person
        Asked by the drivers that need a person.
    start
        Where the arm stood when the session began, on going on; None to ask the robot.

    Raises
    ------
    InputError
        Something is missing or unknown.
    DeviceError
        A driver fails.
    """
    configuration.wish()  # refused now rather than once the arm has moved
    if configuration.is_replay:
        return _replayed(configuration, camera, confirm)
    if configuration.robot is None:
        raise InputError("no arm is named", code="missing_value", hint="only a replay does without")
    arm = open_arm(configuration.robot)
    solids = _solids(configuration, arm)
    configuration = replace(
        configuration, collisions=Collisions.CAPSULES if solids is None else Collisions.MESHES
    )
    if configuration.is_simulated:
        return _simulated(configuration, arm, target, confirm, solids)
    if camera is None or target is None:
        raise InputError("a real cell needs camera and target", code="missing_value")
    workspace = configuration.workspace()
    person = person or Person(_nobody, lambda _: None)
    robot = open_robot(configuration.driver, person)
    source = open_camera(configuration.images, robot, person)
    cell = Cell(robot, source, arm, workspace, camera, target, configuration.patience, confirm, solids)
    if start is None:
        reading = cell.read()
        joints = reading.joints_rad or tuple(arm.inverse(reading.T_base_flange).tolist())
        start = Start(reading.T_base_flange, joints)
    recording = Recording(f"session with {arm.name}", configuration.mounting, camera, target, ())
    return Prepared(configuration, cell, start, recording)


def begin(prepared: Prepared, folder: Any, progress: Progress | None = None) -> tuple[Session, SessionStore]:  # noqa: ANN401
    """Make the folder of a session and the session.

    Raises
    ------
    InputError
        Recorded poses that are not those of the arm.
    OutputError
        The folder is not empty or cannot be written.
    """
    settings: dict[str, Any] = {"configuration": prepared.configuration.to_dict()}
    if prepared.start is not None:
        settings["start"] = {
            "T_base_flange": prepared.start.T_base_flange.to_list(),
            "joints_rad": list(prepared.start.joints_rad),
        }
    chooser = prepared.chooser()
    store = create_session(folder, prepared.recording, settings)
    return Session(prepared.cell, store, chooser, prepared.configuration.wish(), progress), store


def go_on(
    folder: Any,  # noqa: ANN401 - a path
    progress: Progress | None = None,
    *,
    person: Person | None = None,
    confirm: Callable[[Goal], bool] | None = None,
) -> tuple[Session, SessionStore, Prepared]:
    """Open a session that was broken off, or has ended, with the same settings.

    Raises
    ------
    InputError
        No session, or one that was damaged.
    DeviceError
        A driver fails.
    """
    store = open_session(folder)
    try:
        configuration = Configuration.from_dict(store.settings.get("configuration"))
        start = None if configuration.is_replay else read_start(store.settings)
        recording = store.recording
        prepared = prepare(
            configuration,
            camera=recording.camera,
            target=recording.target,
            person=person,
            confirm=confirm,
            start=start,
        )
        if prepared.hidden_arm is not None and start is not None:
            standing = next((e.goal_joints for e in reversed(store.entries) if e.moved), start.joints_rad)
            prepared.hidden_arm.place(standing)
        session = Session(prepared.cell, store, prepared.chooser(), configuration.wish(), progress)
    except BaseException:
        store.close()
        raise
    return session, store, prepared


def read_start(settings: Mapping[str, Any]) -> Start:
    """Return where the arm stood when a session began.

    Raises
    ------
    InputError
        The settings do not say.
    """
    document = read_document(settings.get("start"), _StartDocument, "settings: start")
    return Start(Pose(document.T_base_flange), tuple(document.joints_rad))


@dataclass(frozen=True)
class _StartDocument:
    T_base_flange: list[list[float]]
    joints_rad: list[float]


def _replayed(
    configuration: Configuration,
    camera: Camera | None,
    confirm: Callable[[Goal], bool] | None,
) -> Prepared:
    if configuration.images.partition(":")[0] != REPLAY:
        raise InputError("a replayed robot needs the replayed camera", code="unknown_driver")
    address = configuration.driver.partition(":")[2]
    opened = open_folder(address, SourceOptions(camera=camera))
    source = opened.recording
    robot = ReplayRobot(source.views)
    arm = None if configuration.robot is None else open_arm(configuration.robot)
    cell = Cell(
        robot,
        replayed_camera(opened, robot),
        arm,
        None,
        source.camera,
        source.target,
        configuration.patience,
        confirm,
    )
    recording = Recording(
        f"replay of {source.name}", source.mounting, source.camera, source.target, (), None, source.source
    )
    configuration = replace(configuration, mounting=source.mounting)
    return Prepared(configuration, cell, None, recording, source.truth, recorded=source.views)


def _solids(configuration: Configuration, arm: Arm) -> SolidLinks | None:
    """Return the shapes of the links as far as they are wanted and known.

    Raises
    ------
    InputError
        They are asked for and cannot be had.
    """
    wanted = Collisions(configuration.collisions)
    if configuration.robot is None or wanted is Collisions.CAPSULES:
        return None
    try:
        if configuration.robot in shipped_arms():
            raise InputError(
                f"{configuration.robot}: the shipped description has no shapes", code="no_shapes"
            )
        return SolidLinks(arm, read_shapes(configuration.robot, arm))
    except InputError:
        if wanted is Collisions.MESHES:
            raise
        return None


def _simulated(
    configuration: Configuration,
    arm: Arm,
    target: Target | None,
    confirm: Callable[[Goal], bool] | None,
    solids: SolidLinks | None,
) -> Prepared:
    wrong = configuration.simulation
    look = Appearance(blur_px=wrong.blur_px, noise=wrong.pixel_noise)
    optics = Optics(look, occluded_share=wrong.occluded_share, points_only=wrong.points_only)
    usual = SimulationOptions()
    options = SimulationOptions(
        seed=configuration.seed,
        mounting=Mounting(configuration.mounting),
        target=target or usual.target,
        errors=wrong.errors,
        optics=optics,
        faults=wrong.faults,
        camera_error=wrong.camera_error,
        hang_s=wrong.hang_s,
        patience=configuration.patience,
    )
    made = simulated_cell(arm, options)
    cell = made.cell
    workspace = cell.workspace if configuration.workspace_m is None else configuration.workspace()
    cell = Cell(
        cell.robot,
        cell.source,
        arm,
        workspace,
        cell.camera,
        cell.target,
        configuration.patience,
        confirm,
        solids,
    )
    return Prepared(configuration, cell, made.start, made.recording, made.truth, made.hidden_arm)


def _nobody(question: str) -> str:
    raise EOFError(question)
