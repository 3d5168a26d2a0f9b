"""The pictures, or the points, of recorded views as a camera."""

from collections.abc import Callable

from handeye.cameras.protocol import Frame, Grey, Points
from handeye.errors import DeviceError
from handeye.types import View


class ReplayCamera:
    """Shows what was recorded at the view where the replayed robot stands.

    Parameters
    ----------
    standing_at
        Gives the recorded view that the robot has moved to, None before its first motion.
    read
        Reads the image of a view; None to give the recorded points instead.
    """

    def __init__(
        self, standing_at: Callable[[], View | None], read: Callable[[View], Grey] | None = None
    ) -> None:
        self._standing_at = standing_at
        self._read = read

    def grab(self, label: str) -> Frame:
        """Return what was recorded there.

        Raises
        ------
        DeviceError
            The robot has not moved to a recorded view yet.
        """
        view = self._standing_at()
        if view is None:
            raise DeviceError(f"{label}: the robot stands at no recorded view", code="nothing_recorded")
        points = Points(view.point_ids, view.pixels)
        if self._read is None:
            return Frame(None, points, view.timestamp_s)
        return Frame(self._read(view), None, view.timestamp_s)
