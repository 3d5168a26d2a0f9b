"""A page in the browser that shows a calibration, and from which a session is driven.

The page belongs to the process that runs the session: it shows what the session says and passes on what a
person presses. It is served by the standard library alone, asks nothing of other hosts, and listens on the
loopback unless it is told otherwise.
"""

from handeye.ui.dashboard import Dashboard
from handeye.ui.driving import More, Pace, drive
from handeye.ui.hub import Command, Hub
from handeye.ui.rig_dashboard import RigDashboard
from handeye.ui.server import Server
from handeye.ui.still import Still

__all__ = ["Command", "Dashboard", "Hub", "More", "Pace", "RigDashboard", "Server", "Still", "drive"]
