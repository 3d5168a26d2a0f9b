"""A run that is ready to begin: its cell, where its arm stands, and what its session is made of."""

from dataclasses import dataclass

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots import Arm
from handeye.robots.simulated import SimulatedArm
from handeye.session.attempt import Cell
from handeye.session.choosing import ArmChooser
from handeye.session.deciding import Chooser
from handeye.session.loop import Session
from handeye.session.recorded import RecordedChooser
from handeye.session.settings import Configuration
from handeye.session.starting import Start
from handeye.session.store import SessionStore
from handeye.types import Camera, Recording, Truth, View


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
    true_camera
        The camera as it is, if it is simulated.
    """

    configuration: Configuration
    cell: Cell
    start: Start | None
    recording: Recording
    truth: Truth | None = None
    hidden_arm: SimulatedArm | None = None
    recorded: tuple[View, ...] | None = None
    true_camera: Camera | None = None

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
                "the arm is not known", code=Code.MISSING_VALUE, hint="name it with its description"
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
            raise InputError("a workspace and where the arm stands are needed", code=Code.MISSING_VALUE)
        limits = self.configuration.limits
        return ArmChooser(self.arm, cell.workspace, cell.camera, self.start, wish, limits, cell.solids)

    def session(self, store: SessionStore) -> Session:
        """Return the session that writes into a store."""
        return Session(self.cell, store, self.chooser(), self.configuration.wish())
