"""Calibration targets: a small base and one file per family.

A family is one file: its measures, where its points are, what is printed on it, how a person calls it. It is
listed here; everything else (files, printing, pictures, and with markers detection) goes by that.
"""

from handeye.types.target.aprilgrid import AprilGrid
from handeye.types.target.artwork import Artwork
from handeye.types.target.aruco_grid import ArucoGrid
from handeye.types.target.aruco_marker import ArucoMarker
from handeye.types.target.base import Target
from handeye.types.target.charuco import Charuco
from handeye.types.target.chessboard import Chessboard
from handeye.types.target.circle_grid import CircleGrid
from handeye.types.target.coded import Coded, MarkerCorners, Numbered
from handeye.types.target.symmetry import Turn

__all__ = [
    "AprilGrid",
    "Artwork",
    "ArucoGrid",
    "ArucoMarker",
    "Charuco",
    "Chessboard",
    "CircleGrid",
    "Coded",
    "MarkerCorners",
    "Numbered",
    "Target",
    "Turn",
]
