"""The transform to export: from the frame that the camera is fixed to, to the camera or its link."""

from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version

import numpy as np

from handeye.export.frames import REP_103_OPTICAL, Frames
from handeye.export.result import Result
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.units import MM_PER_M

_MOUNTINGS = {
    Mounting.EYE_IN_HAND: "camera in the hand",
    Mounting.EYE_TO_HAND: "camera beside the robot",
}
MAX_REMARK_LENGTH = 300


@dataclass(frozen=True, eq=False)
class Mount:
    """An answer in the frames of the robot's software.

    A frame has one parent only. Where the camera's driver publishes the optical frame below a link of its
    own, it is the link that hangs on the robot: ``T_parent_link = T_parent_camera (T_link_camera)^-1``.

    Examples
    --------
    >>> Mount(result, Frames("tool0")).child
    'camera_optical_frame'
    """

    result: Result
    frames: Frames

    @property
    def parent(self) -> str:
        """Name of the frame that the camera is fixed to."""
        return self.frames.parent

    @property
    def child(self) -> str:
        """Name of the frame that hangs on the parent: the link if there is one, else the optical frame."""
        return self.frames.camera if self.frames.link is None else self.frames.link

    @cached_property
    def T_parent_child(self) -> Pose:
        """Pose of the child in the parent."""
        if self.frames.link is None:
            return self.result.T_parent_camera
        return self.result.T_parent_camera @ self._T_link_camera.inverse()

    @cached_property
    def covariance(self) -> FloatArray:
        """(6, 6) covariance of a twist of the child in its own frame, metres and radians."""
        if self.frames.link is None:
            return self.result.covariance
        adjoint = self._T_link_camera.adjoint()
        return adjoint @ self.result.covariance @ adjoint.T

    @property
    def _T_link_camera(self) -> Pose:
        return REP_103_OPTICAL if self.frames.T_link_camera is None else self.frames.T_link_camera

    @property
    def target_parent(self) -> str:
        """Name of the frame that the target is fixed to."""
        return self.frames.robot

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know before the transform is used."""
        frames = self.frames
        if frames.link is None or frames.T_link_camera is not None:
            return self.result.warnings
        assumed = (
            f"{frames.link} is taken to have its origin in {frames.camera} and axes by ROS REP 103; many "
            f"drivers put it elsewhere, so compare: ros2 run tf2_ros tf2_echo {frames.link} {frames.camera}"
        )
        return (*self.result.warnings, assumed)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader of the export should know, each on one line of printable text."""
        result, frames = self.result, self.frames
        origin = (
            f" from {result.view_count} views of recording {result.recording}" if result.recording else ""
        )
        position = f"{result.sigma_translation_m * MM_PER_M:.3g} mm"
        rotation = f"{np.rad2deg(result.sigma_rotation_rad):.2g} deg"
        where = _MOUNTINGS[result.mounting]
        remarks = [
            f"{self.parent} -> {self.child} ({where}), by handeye {version('handeye')}{origin}",
            f"maps coordinates in {self.child} to coordinates in {self.parent}; metres; quaternion x y z w",
            f"one standard deviation of the camera's position {position}, of its rotation {rotation}",
        ]
        if frames.link is None:
            remarks.append(
                f"{frames.camera} is the optical frame (x right, y down, z forward); if the camera's driver "
                "publishes it already, export for the driver's own link instead, as a frame has one parent"
            )
        else:
            remarks.append(f"{frames.link} is the parent of the optical frame {frames.camera}")
        remarks += [f"warning: {warning}" for warning in self.warnings]
        return tuple(one_line(remark) for remark in remarks)


def one_line(text: str) -> str:
    """Return text for a comment: one line, printable, of bounded length."""
    flat = " ".join(text.split())
    printable = "".join(character if character.isprintable() else "?" for character in flat)
    return printable if len(printable) <= MAX_REMARK_LENGTH else printable[: MAX_REMARK_LENGTH - 3] + "..."
