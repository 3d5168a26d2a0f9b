"""Mistakes in recordings: found before the estimate, named, and left out or put right."""

from handeye.estimation.mistakes.conventions import repaired
from handeye.estimation.mistakes.examine import Examination, examine

# Codes of the findings and errors, stable.
CODES = frozenset(
    {
        "gross_pose",
        "inconsistent",
        "points_outlying",
        "view_flipped",
        "view_misdetected",
        "view_moving",
        "view_shuffled",
        "wrong_direction",
        "wrong_rotation",
        "wrong_unit",
    }
)

__all__ = ["CODES", "Examination", "examine", "repaired"]
