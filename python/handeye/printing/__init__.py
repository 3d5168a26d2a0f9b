"""Calibration targets to print, at true scale."""

from handeye.printing.page import page
from handeye.printing.paper import Paper
from handeye.printing.sheet import Sheet, largest, lay_out
from handeye.printing.target_file import target_file

__all__ = ["Paper", "Sheet", "largest", "lay_out", "page", "target_file"]
