"""Everything that is wrong with a recording, and the recording as it is meant."""

from dataclasses import dataclass, replace

from handeye.errors import HandeyeError
from handeye.estimation.faults.examine import Examination, examine, measured
from handeye.estimation.faults.kinds import SharedFaultError
from handeye.types.calibration import Finding
from handeye.types.recording import Recording

# Faults that all views share, one behind the other.
MOST_SHARED = 3


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found.

    Parameters
    ----------
    findings
        Every fault: first what all views share, then single views.
    refused
        Why `solve` refuses the recording as given; None if it does not.
    repaired
        The recording as it is meant: views that belong, labels, pairs and poses put right. None where nobody
        can tell.
    examination
        Of the repaired recording.
    """

    findings: tuple[Finding, ...]
    refused: HandeyeError | None
    repaired: Recording | None
    examination: Examination | None


def diagnose(recording: Recording) -> Diagnosis:
    """Find what is wrong with a recording; nothing is raised for that."""
    findings: list[Finding] = []
    refused: HandeyeError | None = None
    current = recording
    for _ in range(MOST_SHARED + 1):
        try:
            examination = examine(measured(current))
        except SharedFaultError as error:
            refused = refused or error
            findings.append(_finding(error))
            if error.as_well:  # Which of them to put right is not for us to say.
                return Diagnosis(tuple(findings), refused, None, None)
            current = error.hypothesis.change(current)
        except HandeyeError as error:
            return Diagnosis((*findings, _finding(error)), refused or error, None, None)
        else:
            kept = {view.name: view for view in examination.measurements.views}
            views = [kept[view.name] for view in current.views if view.name in kept]
            repaired = replace(current, views=tuple(views))
            return Diagnosis((*findings, *examination.findings), refused, repaired, examination)
    return Diagnosis(tuple(findings), refused, None, None)


def _finding(error: HandeyeError) -> Finding:
    as_well = list(error.as_well) if isinstance(error, SharedFaultError) else []
    return Finding(error.code, error.message, {"views": [], "as_well": as_well})
