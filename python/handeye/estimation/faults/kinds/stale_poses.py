"""Robot poses that were not read again, and views that are there twice."""

import numpy as np

from handeye.errors import InputError
from handeye.estimation.faults.kinds.base import Handling, Kind
from handeye.estimation.measurements import Measurements

KIND = Kind(
    "stale_poses",
    "robot poses that were not read again",
    "The pose was read once and written down for several pictures, or the reading lags behind.",
    "Poses that are the same to the last digit though their pictures differ.",
    Handling.REFUSED,
    "Read the robot's pose again at every picture, once the arm has come to rest.",
)
# Pictures that differ by more were taken at different places; the share of such views with one robot pose
# that is no chance.
STALE_M, STALE_RAD = 0.005, 0.02
STALE_SHARE = 0.2
MOST_NAMED = 4


def check(measurements: Measurements) -> None:
    """Raise where robot poses were not read again: the same to the last digit though the pictures differ.

    Raises
    ------
    InputError
        At least `STALE_SHARE` of the views have the pose of another one; the message names them.
    """
    stale: list[tuple[str, str]] = []
    views, poses = measurements.views, measurements.poses
    first_with: dict[bytes, list[int]] = {}
    for k, view in enumerate(views):
        others = first_with.setdefault(view.T_base_flange.matrix.tobytes(), [])
        for j in others:
            moved = poses[k].T_camera_target @ poses[j].T_camera_target.inverse()
            if np.linalg.norm(moved.translation) > STALE_M or moved.rotation_angle_rad > STALE_RAD:
                stale.append((views[j].name, view.name))
                break
        others.append(k)
    if len(stale) < max(2, STALE_SHARE * len(views)):
        return
    words = ", ".join(f"{first} and {second}" for first, second in stale[:MOST_NAMED])
    more = f" and {len(stale) - MOST_NAMED} more pairs" if len(stale) > MOST_NAMED else ""
    raise InputError(
        f"the robot poses of {words}{more} are the same to the last digit, though their pictures differ: the "
        "pose was not read again",
        code=KIND.code,
        hint="read the robot's pose again at every picture, once the arm has come to rest",
    )
