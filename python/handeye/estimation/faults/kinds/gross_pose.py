"""A robot pose that is wrong."""

from handeye.estimation.faults.kinds.base import Handling, Kind

KIND = Kind(
    "gross_pose",
    "a robot pose that is wrong",
    "A number mistyped or cut off, another tool or frame active, the pose of another program line.",
    "Image and robot pose are apart by far more than the other views explain, and fit no other view.",
    Handling.LEFT_OUT,
    "Write the pose down again, or take the view again.",
    "leaves the view out",
)
