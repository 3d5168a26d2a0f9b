"""Single points found in the wrong place, and views whose points fit no pose of the board."""

from handeye.estimation.faults.kinds.base import Handling, Kind

OUTLYING = Kind(
    "points_outlying",
    "single points found in the wrong place",
    "A reflection, dirt, an edge of the paper or something in front of the board was taken for a corner.",
    "The other points of the view fit one pose of the board, and these lie beyond eight standard deviations.",
    Handling.LEFT_OUT,
    "Nothing; if it happens often, look at light and reflections.",
    "leaves the points out",
)
MISDETECTED = Kind(
    "view_misdetected",
    "points that fit no pose of the board",
    "Something else was taken for the board, or the picture is blurred, or labels are mixed up.",
    "No pose brings the board's points near to where they were found, though that works in the other views.",
    Handling.LEFT_OUT,
    "Look at the picture; take the view again.",
    "leaves the view out",
)
