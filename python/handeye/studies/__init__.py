"""The studies: one file per table or figure, each a function from recordings to a result with `to_dict`."""

from handeye.studies.coverage import Coverage, study_coverage
from handeye.studies.curves import Curves, study_curves
from handeye.studies.holdout import Holdout, study_holdout
from handeye.studies.injected import Injected, study_injected
from handeye.studies.mistakes import Mistakes, study_mistakes
from handeye.studies.planted import Mistake
from handeye.studies.table1 import Table1, study_table1

__all__ = [
    "Coverage",
    "Curves",
    "Holdout",
    "Injected",
    "Mistake",
    "Mistakes",
    "Table1",
    "study_coverage",
    "study_curves",
    "study_holdout",
    "study_injected",
    "study_mistakes",
    "study_table1",
]
