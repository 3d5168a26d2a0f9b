"""`handeye doctor`: what is wrong with a folder of views, and a copy that is put right."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_new_folder
from handeye.cli.source import Source
from handeye.datasets import check_written, write_recording
from handeye.errors import DegenerateError, HandeyeError
from handeye.estimation import calibrate_examined
from handeye.estimation.faults import Diagnosis, Kind, diagnose, kind_of
from handeye.importing import Opened
from handeye.types.calibration import Finding

if TYPE_CHECKING:
    from rich.console import Console


def doctor(
    folder: Path,
    /,
    *,
    fix: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Say what is wrong with a folder of views, and write a copy that is put right.

    Looks for the mistakes that `solve` looks for, and goes on where `solve` refuses: the worst first, with
    what was done, how it shows, and what repairs it. Nothing in the folder is changed.

    Parameters
    ----------
    folder
        Folder with the views, as for `solve`.
    fix
        Write the repaired recording to this folder, which does not exist yet or is empty.
    """
    if fix is not None:
        check_new_folder(fix)
    opened = source.open(folder)
    diagnosis = diagnose(opened.recording)
    findings = [*diagnosis.findings]
    refused = diagnosis.refused
    open_directions = _open_directions(diagnosis)
    if open_directions is not None:
        findings.append(Finding(open_directions.code, open_directions.message, {"views": []}))
        refused = refused or open_directions
    if fix is not None and diagnosis.repaired is not None and diagnosis.findings:
        write_recording(diagnosis.repaired, fix)
        check_written(diagnosis.repaired, fix)
    else:
        fix = None
    data = _data(opened, findings, refused, fix)
    return Answer(data, lambda console: _show(console, opened, findings, refused, fix))


def _open_directions(diagnosis: Diagnosis) -> HandeyeError | None:
    """Return why what is left does not determine an answer, None if it does."""
    if diagnosis.examination is None:
        return None
    try:
        calibrate_examined(diagnosis.examination)
    except DegenerateError as error:
        return DegenerateError(error.message, hint=error.hint)
    except HandeyeError as error:
        return error
    return None


def _data(
    opened: Opened, findings: Sequence[Finding], refused: HandeyeError | None, fixed: Path | None
) -> dict[str, Any]:
    return {
        "recording": opened.recording.name,
        "layout": opened.layout,
        "views": len(opened.recording),
        "healthy": not findings,
        "refused": refused is not None,
        "findings": [_finding(finding) for finding in findings],
        "hint": None if refused is None else refused.hint,
        "repaired": None if fixed is None else str(fixed),
        "warnings": [str(warning) for warning in opened.warnings],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    kind = kind_of(finding.code)
    return {
        "code": finding.code,
        "sentence": finding.sentence,
        "title": None if kind is None else kind.title,
        "handling": None if kind is None else kind.handling.value,
        "cure": None if kind is None else kind.cure,
        "repair": None if kind is None else kind.repair,
        "views": list(finding.evidence.get("views", ())),
    }


def _show(
    console: "Console",
    opened: Opened,
    findings: Sequence[Finding],
    refused: HandeyeError | None,
    fixed: Path | None,
) -> None:
    from rich.text import Text  # noqa: PLC0415 - a program reading JSON need not wait for it

    from handeye.cli.wording import MOUNTINGS, heading, notices, pairs  # noqa: PLC0415

    recording = opened.recording
    for finding in findings:
        kind = kind_of(finding.code)
        console.print(Text.assemble((finding.code, "bold"), f": {finding.sentence}"))
        pairs(console, _advice(kind, refused if finding is findings[0] else None), indent=2)
        console.print()
    note = f"{MOUNTINGS[recording.mounting]}, {len(recording)} views"
    heading(console, recording.name, f"{note}: nothing wrong was found" if not findings else note)
    notices(console, "Warnings", map(str, opened.warnings))
    if fixed is not None:
        console.print(f"repaired copy: {fixed}", markup=False)
    elif any(kind is not None and kind.repair for kind in map(kind_of, (f.code for f in findings))):
        console.print("--fix FOLDER writes a repaired copy")


def _advice(kind: Kind | None, refused: HandeyeError | None) -> list[tuple[str, str]]:
    if kind is None:
        return [] if refused is None or refused.hint is None else [("what to do", refused.hint)]
    return [
        ("cause", kind.cause),
        (
            "what solve does",
            f"the {'recording' if kind.handling == 'refused' else 'part'} is {kind.handling}",
        ),
        ("what to do", kind.cure),
        ("--fix", kind.repair or "nothing: new data are needed"),
    ]
