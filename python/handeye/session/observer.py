"""Who looks on while a session runs; it is told, and decides nothing."""

from handeye.cameras.protocol import Grey
from handeye.detection import Detection
from handeye.estimation import Estimate
from handeye.robots.protocol import Goal, Reading
from handeye.session.entry import Entry


class Observer:
    """Told of everything that a session does, on the thread of the session; this one ignores it.

    A subclass overrides what it wants to hear of. It must return soon: the arm waits meanwhile.

    Examples
    --------
    >>> class Counting(Observer):
    ...     attempts = 0
    ...     def taken(self, entry, estimate):
    ...         self.attempts += 1
    >>> Counting().attempts
    0
    """

    def stands(self, reading: Reading) -> None:
        """Tell where the robot says that it is."""

    def goes(self, goal: Goal) -> None:
        """Tell where the arm is sent now."""

    def looked(
        self, label: str, image: Grey | None, detection: Detection | None, names: tuple[str, str]
    ) -> None:
        """Tell what a picture showed, and of which camera and target it is.

        The points are None where the target was not found.
        """

    def taken(self, entry: Entry, estimate: Estimate | None) -> None:
        """Tell what an attempt brought, and what was believed before it."""
