"""Data faults: found before the estimate under its own model, named, and left out or put right."""

from handeye.estimation.faults.diagnose import Diagnosis, diagnose
from handeye.estimation.faults.examine import Examination, examine, measured
from handeye.estimation.faults.kinds import CODES, KINDS, Handling, Kind, kind_of

__all__ = [
    "CODES",
    "KINDS",
    "Diagnosis",
    "Examination",
    "Handling",
    "Kind",
    "diagnose",
    "examine",
    "kind_of",
    "measured",
]
