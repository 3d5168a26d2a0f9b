"""The samples of MoveIt Calibration: what a recording measured, for a comparison with its solvers.

A list with two row-major 4 x 4 matrices a view, in metres: `effector_wrt_world` is `T_base_flange`,
`object_wrt_sensor` is `T_camera_target` from that view's image alone.
"""

from handeye.errors import InputError
from handeye.estimation import Measurements
from handeye.export.base import number
from handeye.types import Pose, Recording

NAME = "moveit_samples"
TITLE = "MoveIt Calibration samples (needs the views)"
SUFFIX = ".yaml"


def moveit_samples(recording: Recording) -> str:
    """Return the samples of all views in which the pose of the target can be found.

    Raises
    ------
    InputError
        There is no such view.

    Examples
    --------
    >>> moveit_samples(recording).count("effector_wrt_world")
    9
    """
    measurements = Measurements.of_recording(recording)
    if len(measurements) == 0:
        raise InputError(f"{recording.name}: no view in which the pose of the target can be found")
    lines: list[str] = []
    for view, pose in zip(measurements.views, measurements.poses, strict=True):
        lines += [
            f"# {view.name}",
            f"- effector_wrt_world: {_matrix(view.T_base_flange)}",
            f"  object_wrt_sensor: {_matrix(pose.T_camera_target)}",
        ]
    return "\n".join(lines) + "\n"


def _matrix(pose: Pose) -> str:
    return "[" + ", ".join(number(float(value)) for value in pose.matrix.ravel()) + "]"
