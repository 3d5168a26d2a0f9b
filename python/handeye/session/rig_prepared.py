"""A run with several cameras that is ready to begin, and one that goes on."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots import ArmKinematics, open_arm
from handeye.robots.simulated import SimulatedArm
from handeye.session.attempt import Cell
from handeye.session.closing import close_all
from handeye.session.configuration import left_at
from handeye.session.entry import stations_of
from handeye.session.journal import read_settings
from handeye.session.rig import RigSession
from handeye.session.rig_choosing import RigChooser
from handeye.session.rig_store import RigStore, create_rig_session, open_rig_session
from handeye.session.settings import (
    Configuration,
    RigSettings,
    check_fingerprints,
    fingerprints,
    read_start,
    settings_of,
)
from handeye.session.starting import Start
from handeye.session.store import is_session
from handeye.types import RigRecording, RigTruth
from handeye.types.kinematics import Kinematics


@dataclass(frozen=True, eq=False)
class RigPrepared:
    """A run, ready to begin.

    Parameters
    ----------
    cell
        The world, its `several` filled.
    start
        Where the arm stands.
    recording
        What its stations will be written into.
    truth
        What is true, where that is known.
    hidden_arm
        The arm as it is, if it is simulated.
    """

    configuration: Configuration
    cell: Cell
    start: Start
    recording: RigRecording
    truth: RigTruth | None = None
    hidden_arm: SimulatedArm | None = None

    def session(self, store: RigStore) -> RigSession:
        """Return the session that writes into a store.

        Raises
        ------
        InputError
            The arm or its workspace is not known.
        """
        cell, configuration = self.cell, self.configuration
        if cell.arm is None or cell.workspace is None:
            raise InputError("an arm and a workspace are needed", code=Code.MISSING_VALUE)
        chooser = RigChooser(
            cell.arm,
            cell.workspace,
            self.recording,
            self.start,
            configuration.wish(),
            cell.solids,
            candidates=(configuration.rig or RigSettings()).candidates,
            limits=configuration.limits,
        )
        return RigSession(cell, store, chooser)


def begin_rig(prepared: RigPrepared, folder: Path) -> tuple[RigSession, RigStore]:
    """Make the folder of a session and the session.

    Raises
    ------
    OutputError
        The folder is not empty or cannot be written.
    """
    settings = settings_of(prepared.configuration, prepared.start) | fingerprints(prepared.cell.arm, None)
    store = create_rig_session(folder, prepared.recording, settings)
    return prepared.session(store), store


def go_on_rig(
    folder: Path, prepare: Callable[[Configuration, RigRecording, Start | None], RigPrepared]
) -> tuple[RigSession, RigStore, RigPrepared]:
    """Open a session that was broken off, or has ended, with the same settings.

    Parameters
    ----------
    folder
        Of the session.
    prepare
        Makes the cell again that the settings ask for, with the recording that the session began with, and
        where the arm stood then; None before the first station.

    Raises
    ------
    InputError
        No session of several cameras, or one that was damaged.
    DeviceError
        A driver fails.
    """
    store = open_rig_session(folder)
    with ExitStack() as failed:
        failed.callback(store.close)
        configuration = Configuration.from_dict(store.settings.get("configuration"))
        begun = bool(stations_of(store.entries)) or configuration.is_simulated
        # Before the first station the arm may be driven elsewhere, and begins from there.
        start = read_start(store.settings) if begun else None
        prepared = prepare(configuration, store.begun_with, start)
        failed.callback(close_all, prepared.cell)
        check_fingerprints(store.settings, fingerprints(prepared.cell.arm, None))
        if prepared.hidden_arm is not None and start is not None:
            prepared.hidden_arm.place(left_at(store.entries) or start.joints_rad)
        session = prepared.session(store)
        failed.pop_all()
    return session, store, prepared


def arm_of_rig(folder: Path) -> Kinematics | None:
    """Return the arm of a session of several cameras, as its estimate knew it; None for other recordings.

    Raises
    ------
    InputError
        The session was changed, or its arm is not what it was.
    """
    if not is_session(folder) or not is_rig_session(folder):
        return None
    settings = read_settings(folder).asked
    configuration = Configuration.from_dict(settings.get("configuration"))
    if configuration.robot is None or not configuration.joints_err or not read_start(settings).posture_known:
        return None
    arm = open_arm(configuration.robot)
    check_fingerprints(settings, fingerprints(arm, None))
    return ArmKinematics(arm)


def is_rig_session(folder: Path) -> bool:
    """Tell whether the session in a folder is one of several cameras.

    Raises
    ------
    InputError
        No session, or one that was changed.
    """
    return Configuration.from_dict(read_settings(folder).asked.get("configuration")).rig is not None
