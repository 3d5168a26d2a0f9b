"""What `handeye run` says at its end."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from handeye.cli.answer import Answer
from handeye.cli.session_report import report_of_session
from handeye.cli.work import touch_lines
from handeye.errors import DegenerateError, DetectionError, DeviceError, HandeyeError, InputError, SolveError
from handeye.estimation.lens_confidence import lens_difference_px
from handeye.session.deciding import EndReason
from handeye.session.loop import End
from handeye.session.prepared import Prepared
from handeye.session.settings import Configuration
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    from rich.console import Console


Found = TypeVar("Found")


def found(
    calibration: Found | None,
    why: tuple[EndReason, str],
    folder: Path,
    taken: str,
    refused: HandeyeError | None = None,
) -> Found:
    """Return what a run has found, where it ended for a reason that leaves an answer.

    Raises
    ------
    HandeyeError
        There is none: too many attempts failed, no target was seen, or what was taken does not determine it.
    """
    reason, sentence = why
    hint = f"handeye run --resume --session {folder} goes on"
    if reason in {EndReason.TOO_MANY_FAILURES, EndReason.ROBOT_HANGS}:
        raise DeviceError(sentence, code=reason, hint=hint)
    if reason is EndReason.NO_START:
        raise DetectionError(sentence, code=reason, hint=hint)
    if reason is EndReason.REFUSED and refused is not None:
        advice = hint if refused.hint is None else f"{refused.hint}; {hint}"
        kinds = (SolveError, DegenerateError)
        kind = next((kind for kind in kinds if isinstance(refused, kind)), InputError)
        raise kind(sentence, code=refused.code, hint=advice)
    if calibration is None:
        raise HandeyeError(f"{sentence}; the {taken} do not determine the answer", code=reason, hint=hint)
    return calibration


def run_answer(folder: Path, configuration: Configuration, prepared: Prepared, end: End) -> Answer:
    """Return the answer of a run that has one.

    Raises
    ------
    HandeyeError
        As `found`.
    """
    report = None if end.calibration is None else _report(folder, configuration)
    calibration = found(end.calibration, (end.reason, end.sentence), folder, "views", end.error)
    error: dict[str, float] | None = None
    if prepared.truth is not None and prepared.truth.X is not None:
        off = (calibration.X @ prepared.truth.X.inverse()).log()
        error = {
            "translation_mm": MM_PER_M * float(np.linalg.norm(off[:3])),
            "rotation_deg": float(np.rad2deg(np.linalg.norm(off[3:]))),
        }
        if end.lens_px is not None and prepared.true_camera is not None:
            error["lens_px"] = lens_difference_px(prepared.true_camera, calibration.camera)
    data: dict[str, Any] = {
        "session": str(folder),
        "report": None if report is None else str(report),
        "end": end.reason.value,
        "sentence": end.sentence,
        "request_met": end.reason is EndReason.ACCURACY_REACHED,
        "views": end.views,
        "attempts": end.attempts,
        "within_95": None if end.reach is None else end.reach.to_dict(),
        "lens_within_95_px": end.lens_px,
        "true_error": error,
        "collisions_judged": judged_by(prepared),
        "seed": configuration.seed,
        "calibration": calibration.to_dict(),
    }
    return Answer(data, lambda console: _show(console, data, end, error))


def judged_by(prepared: Prepared) -> str:
    """Return by what it is judged whether links touch."""
    if prepared.configuration.is_replay:
        return "none: recorded views, nothing moved"
    if prepared.cell.solids is None:
        return "by capsules along the links"
    return "by the shapes of the links in the description"


def _report(folder: Path, configuration: Configuration) -> Path | None:
    report, trouble = report_of_session(folder, configuration.model, configuration.work)
    if trouble:
        print(f"warning: {trouble}", file=sys.stderr, flush=True)
    return report


def _show(console: "Console", data: Mapping[str, Any], end: End, error: Mapping[str, float] | None) -> None:
    from handeye.cli.wording import heading, notices, pairs, pose_lines  # noqa: PLC0415

    calibration = end.calibration
    if calibration is None:
        return
    met = "accuracy reached" if data["request_met"] else "accuracy NOT reached"
    heading(console, met, end.sentence)
    name = calibration.mounting.result_names[0]
    console.print()
    heading(console, name)
    pairs(console, pose_lines(calibration.results[name]), indent=2)
    console.print()
    rows = [] if calibration.touch is None else [*touch_lines(calibration.touch)]
    rows += [("views", f"{end.views} of {end.attempts} attempts"), ("collisions", data["collisions_judged"])]
    if end.reach is not None:
        rows.append(
            (
                "predicted",
                f"within {end.reach.translation_mm:.3f} mm and {end.reach.rotation_deg:.4f} deg (95 %)",
            )
        )
    if end.lens_px is not None:
        lens, (fx, fy) = calibration.camera.lens, calibration.camera.parameters[:2]
        rows.append(("camera", f"{lens}, f {fx:.1f} and {fy:.1f} px, within {end.lens_px:.2f} px (95 %)"))
    if error is not None:
        off = f"off by {error['translation_mm']:.3f} mm and {error['rotation_deg']:.4f} deg"
        rows.append(("truth", off + (f", lens {error['lens_px']:.2f} px" if "lens_px" in error else "")))
    rows.append(("written", data["session"]))
    if data["report"] is not None:
        rows.append(("report", data["report"]))
    pairs(console, rows)
    notices(console, "Warnings", calibration.warnings)
    notices(console, "Diagnosis", (finding.sentence for finding in calibration.diagnosis), "cyan")
