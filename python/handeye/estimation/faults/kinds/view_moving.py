"""Pictures taken, or poses read, while the arm moved."""

from handeye.estimation.faults.kinds.base import Handling, Kind

KIND = Kind(
    "view_moving",
    "a picture taken, or a pose read, while the arm moved",
    "The arm had not come to rest, or picture and pose were taken at different moments.",
    "Image and robot pose are apart by a little more than noise explains, or by part of the way to the view "
    "before or after.",
    Handling.LEFT_OUT,
    "Wait until the arm stands still before taking the picture and reading the pose.",
    "leaves the view out",
)
MOVED = "the picture was probably taken while the arm moved"
READ_MOVING = "the robot's pose was probably read while the arm moved"
