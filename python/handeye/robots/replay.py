"""Recorded views as a robot that can stand only where it stood."""

from collections.abc import Sequence

import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.robots.protocol import Goal, Reading
from handeye.types import Pose, View

# A goal this near to a recorded pose means that view.
NEAR_M, NEAR_RAD = 1e-3, 1e-2


class ReplayRobot:
    """Goes to the recorded view that a goal means, and reads back what was recorded.

    That is the view after which the goal is labelled (`im_07.1`), or else the first one whose pose is the
    goal.
    """

    def __init__(self, views: Sequence[View]) -> None:
        self._views = tuple(views)
        self._at: View | None = None

    @property
    def view(self) -> View | None:
        """The view where it stands; None before the first motion."""
        return self._at

    def move_to(self, goal: Goal) -> None:
        """Go to the view that the goal means.

        Raises
        ------
        DeviceError
            No view was recorded there.
        """
        named = goal.label.rpartition(".")[0]
        for view in sorted(self._views, key=lambda view: view.name != named):
            if is_near(view.T_base_flange, goal.T_base_flange):
                self._at = view
                return
        raise DeviceError(f"{goal.label}: nothing was recorded there", code=Code.MOTION_REFUSED)

    def read_pose(self) -> Reading:
        """Return the recorded pose.

        Raises
        ------
        DeviceError
            It has not moved yet and nothing was recorded.
        """
        view = self._at or next(iter(self._views), None)
        if view is None:
            raise DeviceError("nothing was recorded", code=Code.NOTHING_RECORDED)
        return Reading(view.T_base_flange, view.joints_rad)

    def stop(self) -> None:
        """Do nothing: it stands."""


def is_near(pose: Pose, other: Pose, metres: float = NEAR_M, radians: float = NEAR_RAD) -> bool:
    """Tell whether two poses are within a distance and an angle of each other."""
    difference = pose.inverse() @ other
    return bool(np.linalg.norm(difference.translation) <= metres and difference.rotation_angle_rad <= radians)
