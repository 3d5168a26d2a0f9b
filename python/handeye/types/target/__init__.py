"""Calibration targets: a small base and one file per family."""

from handeye.types.target.aprilgrid import AprilGrid
from handeye.types.target.base import Target
from handeye.types.target.charuco import Charuco
from handeye.types.target.chessboard import Chessboard
from handeye.types.target.circle_grid import CircleGrid
from handeye.types.target.symmetry import Turn

__all__ = ["AprilGrid", "Charuco", "Chessboard", "CircleGrid", "Target", "Turn"]
