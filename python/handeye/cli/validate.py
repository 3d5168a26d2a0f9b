"""`handeye validate`: how far a calibration holds, and which measures mislead here."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common, Seed
from handeye.cli.output import check_output, write_json
from handeye.cli.progress import progress
from handeye.cli.source import Source, mindful_of
from handeye.cli.validate_rig import answer_for_rig
from handeye.importing import is_rig
from handeye.session.rig_prepared import arm_of_rig
from handeye.types.calibration import ModelName
from handeye.validation.splits import ModelCheck, Validation
from handeye.validation.splits import validate as validate_recording

if TYPE_CHECKING:
    from rich.console import Console

# Fewer splits are done before another process has begun to work.
SPLITS_PER_WORKER = 50


def validate(
    folder: Path,
    /,
    *,
    model: ModelName = ModelName.AUTO,
    splits: int = 20,
    seed: Seed = 0,
    output: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Test how far a calibration of these views holds, and say which measures mislead.

    The views are split into random halves and into the first and the last half, and the answers compared;
    answers from two thirds are measured on the other third; where the recording knows the truth, the error is
    compared with the covariance. The other model is measured on the same splits, to tell where measures
    contradict each other.

    Parameters
    ----------
    folder
        Folder with the views, at least six.
    model
        The model whose answer is judged.
    splits
        Number of random halvings, and of random thirds held out.
    seed
        Seed of the splits.
    output
        Also write the JSON object to this file.
    """
    if splits < 1 or seed < 0:
        raise UsageError("--splits is at least 1 and --seed not below 0")
    check_output(output)
    if source.only is None and is_rig(folder):
        return answer_for_rig(source.open_rig(folder), model, splits, seed, output, arm_of_rig(folder))
    opened = source.open(folder)
    workers = max(1, min(os.cpu_count() or 1, splits // SPLITS_PER_WORKER))
    with progress("Splitting the views") as advance, mindful_of(opened.warnings):
        found = validate_recording(
            opened.recording, model, splits=splits, seed=seed, workers=workers, progress=advance
        )
    warnings = [str(warning) for warning in opened.warnings]
    data = found.to_dict() | {"warnings": warnings}
    if output is not None:
        write_json(output, data)
    return Answer(data, lambda console: _show(console, found, warnings))


def _show(console: "Console", found: Validation, warnings: list[str]) -> None:
    from rich import box  # noqa: PLC0415 - a program reading JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli.wording import MOUNTINGS, heading, notices  # noqa: PLC0415

    where = MOUNTINGS[found.recording.mounting]
    heading(console, found.recording.name, f"{where}, {len(found.views)} views, {_splits(found)}")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("")
    for model in found.checks:
        table.add_column(f"model {model}", justify="right")
    for name, cell in _ROWS:
        cells = [cell(check) for check in found.checks.values()]
        if any(cells):
            table.add_row(name, *cells)
    console.print(table)
    notices(console, "What this says", (finding.sentence for finding in found.findings), "cyan")
    notices(console, "Warnings", warnings)


def _splits(found: Validation) -> str:
    return f"{len(found.check.random_halves)} halvings and {len(found.check.held_out)} thirds held out"


def _number(value: float) -> str:
    from handeye.cli.wording import figures  # noqa: PLC0415

    return figures(value, 2) if np.isfinite(value) else "none"


def _pair(translation_mm: float, rotation_deg: float) -> str:
    return f"{_number(translation_mm)} mm  {_number(rotation_deg)} deg"


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _claimed(check: ModelCheck) -> str:
    return _pair(check.sigma_translation_mm, check.sigma_rotation_deg)


def _truth(check: ModelCheck) -> str:
    return "" if check.truth is None else _pair(check.truth.translation_mm, check.truth.rotation_deg)


def _truth_nees(check: ModelCheck) -> str:
    return "" if check.truth is None else _number(check.truth.nees_per_dof)


def _random(check: ModelCheck) -> str:
    return _pair(_mean(check.halves("translation_mm")), _mean(check.halves("rotation_deg")))


def _random_nees(check: ModelCheck) -> str:
    return _number(_mean(check.halves("nees_per_dof")))


def _contiguous(check: ModelCheck) -> str:
    halves = check.contiguous_halves
    return "not determined" if halves is None else _pair(halves.translation_mm, halves.rotation_deg)


def _relative(check: ModelCheck) -> str:
    return _pair(_mean(check.unseen("relative_translation_mm")), _mean(check.unseen("relative_rotation_deg")))


def _unseen_rmse(check: ModelCheck) -> str:
    return f"{_number(_mean(check.unseen('rmse_px')))} px"


def _rmse(check: ModelCheck) -> str:
    return f"{_number(check.rmse_px)} px"


_ROWS: tuple[tuple[str, Callable[[ModelCheck], str]], ...] = (
    ("stated (one sigma)", _claimed),
    ("error against truth", _truth),
    ("  its NEES/6 (ideal 1)", _truth_nees),
    ("random halves differ", _random),
    ("  their NEES/6 (ideal 1)", _random_nees),
    ("first and last half", _contiguous),
    ("relative, held out", _relative),
    ("RMSE, held out", _unseen_rmse),
    ("RMSE of all views", _rmse),
)
