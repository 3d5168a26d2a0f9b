"""Mistakes in recordings: found before the estimate, named, and left out or put right."""

from handeye.solving.mistakes.conventions import repaired
from handeye.solving.mistakes.examine import Examination, examine

__all__ = ["Examination", "examine", "repaired"]
