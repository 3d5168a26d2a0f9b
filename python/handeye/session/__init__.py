"""The closed loop: the arm moves, the camera looks, every attempt is written down."""

from handeye.session.attempt import Cell, Timeouts
from handeye.session.choosing import ArmChooser
from handeye.session.deciding import Chooser, EndReason, Halt, Situation, Step
from handeye.session.entry import Entry, Failure
from handeye.session.loop import End, Session
from handeye.session.observer import Observer
from handeye.session.request import Requested
from handeye.session.simulated import SimulatedCell, SimulationOptions, simulated_cell
from handeye.session.starting import Start
from handeye.session.store import SessionStore, create_session, is_session, open_session
from handeye.session.wish import Wish

__all__ = [
    "ArmChooser",
    "Cell",
    "Chooser",
    "End",
    "EndReason",
    "Entry",
    "Failure",
    "Halt",
    "Observer",
    "Requested",
    "Session",
    "SessionStore",
    "SimulatedCell",
    "SimulationOptions",
    "Situation",
    "Start",
    "Step",
    "Timeouts",
    "Wish",
    "create_session",
    "is_session",
    "open_session",
    "simulated_cell",
]
