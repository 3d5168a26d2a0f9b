"""The points, and pictures where they were kept, of recorded views as a camera."""

from collections.abc import Callable

from handeye.cameras.protocol import Frame, Grey, Points
from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.types import View


class ReplayCamera:
    """Shows what was recorded at the view where the replayed robot stands.

    The points are those of the recording, with their labels; the picture comes along to be kept.

    Parameters
    ----------
    standing_at
        Gives the recorded view that the robot has moved to, None before its first motion.
    read
        Reads the image of a view, or says that none was kept; None for points alone.
    """

    def __init__(
        self, standing_at: Callable[[], View | None], read: Callable[[View], Grey | None] | None = None
    ) -> None:
        self._standing_at = standing_at
        self._read = read

    def grab(self, label: str) -> Frame:
        """Return what was recorded there.

        Raises
        ------
        DeviceError
            The robot has not moved to a recorded view yet, or its picture cannot be read any more.
        """
        view = self._standing_at()
        if view is None:
            raise DeviceError(f"{label}: the robot stands at no recorded view", code=Code.NOTHING_RECORDED)
        image = None if self._read is None else self._read(view)
        return Frame(image, Points(view.point_ids, view.pixels, labels_known=True), view.timestamp_s)
