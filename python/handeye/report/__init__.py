"""One self-contained page about a calibration, and its numbers as JSON."""

from handeye.report.document import Report, from_dict, schema, to_dict
from handeye.report.gathering import Gathered, gather_recording, gather_result
from handeye.report.page import html_page
from handeye.report.rig_page import RigReport

__all__ = [
    "Gathered",
    "Report",
    "RigReport",
    "from_dict",
    "gather_recording",
    "gather_result",
    "html_page",
    "schema",
    "to_dict",
]
