"""The cell that follows from what was asked for: its drivers, where its arm stands, and its session."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

from handeye.cameras.protocol import ImageSource, checked_frame
from handeye.cameras.render import Appearance
from handeye.cameras.simulated import Optics
from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.importing import SourceOptions, open_folder
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm, open_arm
from handeye.robots.protocol import Goal
from handeye.robots.replay import ReplayRobot
from handeye.session.attempt import Cell, Eye
from handeye.session.calls import Calls
from handeye.session.closing import close, close_all
from handeye.session.drivers import REPLAY, Person, open_camera, replayed_camera
from handeye.session.entry import Entry, views_of
from handeye.session.loop import Session
from handeye.session.observer import Observer
from handeye.session.opening import NOBODY, described, opened_robot, real_cell, safe, standing
from handeye.session.prepared import Prepared
from handeye.session.self_calibration import SelfCalibration, nominal_camera
from handeye.session.settings import (
    Configuration,
    check_fingerprints,
    fingerprints,
    read_start,
    settings_of,
)
from handeye.session.simulated import SimulationOptions, simulated_cell
from handeye.session.starting import Start
from handeye.session.store import SessionStore, create_session, open_session
from handeye.types import Camera, Mounting, Recording, Target
from handeye.types.rig import CAMERA, TARGET


def prepare(
    configuration: Configuration,
    *,
    camera: Camera | None = None,
    target: Target | None = None,
    person: Person | None = None,
    confirm: Callable[[Goal], bool] | None = None,
    start: Start | None = None,
    observer: Observer | None = None,
) -> Prepared:
    """Open the drivers and see where the arm stands; nothing moves.

    Parameters
    ----------
    camera, target
        The target is needed unless the cell is simulated; a replay has both from its recording. Without a
        camera one picture is taken to see its size, and the views of the session teach it.
    person
        Asked by the drivers that need a person.
    start
        Where the arm stood when the session began, on going on; None to ask the robot.
    observer
        Told of what happens.

    Raises
    ------
    InputError
        Something is missing or unknown.
    DeviceError
        A driver fails.
    """
    configuration.wish()  # refused now rather than once the arm has moved
    observer = observer or Observer()
    if configuration.is_replay:
        return _replayed(configuration, camera, confirm, observer)
    arm, solids, configuration = described(configuration)
    if configuration.is_simulated:
        return _simulated(configuration, arm, target, confirm, solids, observer)
    if target is None:
        raise InputError(
            "a real cell needs a target", code=Code.MISSING_VALUE, hint="name its file with --target"
        )
    configuration.workspace()  # must be stated
    person = person or NOBODY
    robot_calls, camera_calls = Calls("robot"), Calls("camera")
    with ExitStack() as failed:
        arm, robot = opened_robot(configuration, arm, person, robot_calls, start, failed)
        source = open_camera(configuration.images, robot, person, configuration.timeouts.grab_s)
        failed.callback(close, camera_calls, source)
        if camera is None:
            size_px = _pictured_size(source, camera_calls, configuration.timeouts.grab_s)
            camera = nominal_camera(size_px, configuration.lens)
            configuration = replace(configuration, camera_known=False)
        cell = real_cell(
            configuration, arm, solids, robot, Eye((CAMERA, TARGET), source, camera, target), confirm
        )
        cell = replace(cell, observer=observer, robot_calls=robot_calls, camera_calls=camera_calls)
        if start is None:
            start = standing(cell, arm)
        failed.pop_all()
    recording = Recording(f"session with {arm.name}", configuration.mounting, camera, target, ())
    return Prepared(configuration, cell, start, recording)


def begin(prepared: Prepared, folder: Any) -> tuple[Session, SessionStore]:  # noqa: ANN401
    """Make the folder of a session and the session.

    Raises
    ------
    InputError
        Recorded poses that are not those of the arm.
    OutputError
        The folder is not empty or cannot be written.
    """
    settings = settings_of(prepared.configuration, prepared.start)
    settings |= fingerprints(prepared.cell.arm, prepared.recorded)
    if not prepared.configuration.camera_known:
        cell, lens = prepared.cell, prepared.configuration.lens
        settings |= SelfCalibration(cell.target, cell.camera.size_px, lens).setting()
    prepared.chooser()  # refused before anything is written
    store = create_session(folder, prepared.recording, settings)
    return prepared.session(store), store


def go_on(
    folder: Any,  # noqa: ANN401 - a path
    *,
    person: Person | None = None,
    confirm: Callable[[Goal], bool] | None = None,
    observer: Observer | None = None,
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
    with ExitStack() as failed:
        failed.callback(store.close)
        configuration = Configuration.from_dict(store.settings.get("configuration"))
        begun = bool(views_of(store.entries)) or configuration.is_simulated
        # Before the first view the arm may be driven elsewhere, and begins from there.
        start = read_start(store.settings) if begun and not configuration.is_replay else None
        recording = store.begun_with
        prepared = prepare(
            configuration,
            camera=recording.camera,
            target=recording.target,
            person=person,
            confirm=confirm,
            start=start,
            observer=observer,
        )
        failed.callback(close_all, prepared.cell)
        check_fingerprints(store.settings, fingerprints(prepared.cell.arm, prepared.recorded))
        if prepared.hidden_arm is not None and start is not None:
            prepared.hidden_arm.place(left_at(store.entries) or start.joints_rad)
        session = prepared.session(store)
        failed.pop_all()
    return session, store, prepared


def left_at(entries: Sequence[Entry]) -> tuple[float, ...] | None:
    """Return the joints at which a simulated arm was left; None if it had not moved."""
    for entry in reversed(entries):
        if entry.standing_rad is not None:
            return entry.standing_rad
        if entry.moved:
            return entry.goal_joints
    return None


def _replayed(
    configuration: Configuration,
    camera: Camera | None,
    confirm: Callable[[Goal], bool] | None,
    observer: Observer,
) -> Prepared:
    if configuration.images.partition(":")[0] != REPLAY:
        raise InputError("a replayed robot needs the replayed camera", code=Code.UNKNOWN_DRIVER)
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
        configuration.timeouts,
        confirm,
        observer=observer,
    )
    recording = Recording(
        f"replay of {source.name}", source.mounting, source.camera, source.target, (), None, source.source
    )
    configuration = replace(configuration, mounting=source.mounting, camera_known=True)
    return Prepared(configuration, cell, None, recording, source.truth, recorded=source.views)


def _simulated(
    configuration: Configuration,
    arm: Arm,
    target: Target | None,
    confirm: Callable[[Goal], bool] | None,
    solids: SolidLinks | None,
    observer: Observer,
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
        lens=wrong.lens,
        focal_px=wrong.focal_px,
    )
    made = simulated_cell(arm, options)
    cell = made.cell
    around = None if cell.workspace is None else replace(cell.workspace, floor_m=configuration.floor_m)
    workspace = around if configuration.workspace_m is None else configuration.workspace()
    cell = replace(
        cell,
        workspace=workspace,
        timeouts=configuration.timeouts.without_clock(),
        confirm=confirm,
        solids=solids,
        speed_rad_s=configuration.speed_rad_s,
        observer=observer,
    )
    recording = made.recording
    if not configuration.camera_known:
        nominal = nominal_camera(cell.camera.size_px, configuration.lens)
        cell, recording = replace(cell, camera=nominal), replace(recording, camera=nominal)
    start = safe(made.start, cell)
    return Prepared(
        configuration, cell, start, recording, made.truth, made.hidden_arm, true_camera=made.true_camera
    )


def _pictured_size(source: ImageSource, calls: Calls, patience_s: float) -> tuple[int, int]:
    """Return width and height of the pictures, from one that is looked at for nothing else.

    Raises
    ------
    DeviceError
        The camera does not answer, or with something else than a picture.
    """
    frame = checked_frame(calls.run(patience_s, source.grab, "size_of_image"))
    if frame.image is None:
        raise DeviceError(
            "the camera tells points without a picture, and its size is not known",
            code=Code.BAD_FRAME,
            hint="give its calibration with --camera",
        )
    height, width = frame.image.shape
    return width, height
