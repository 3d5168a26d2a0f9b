"""`handeye validate` for several cameras."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.output import write_json
from handeye.cli.source import mindful_of
from handeye.codes import Code
from handeye.errors import InputError
from handeye.importing import OpenedRig
from handeye.types.calibration import ModelName
from handeye.types.kinematics import Kinematics
from handeye.validation.rig_splits import validate_rig

if TYPE_CHECKING:
    from rich.console import Console


def _pair(one: dict[str, float], figures: Callable[[float, int], str]) -> str:
    return f"{figures(one['translation_mm'], 2)} mm and {figures(one['rotation_deg'], 2)} deg"


def answer_for_rig(
    opened: OpenedRig,
    model: ModelName,
    splits: int,
    seed: int,
    output: Path | None,
    kinematics: Kinematics | None,
) -> Answer:
    """Compare halves of the stations.

    Raises
    ------
    InputError, DegenerateError, SolveError
        As for `handeye.validation.rig_splits.validate_rig`.
    """
    if model is ModelName.PAPER:
        raise InputError(
            "the paper's model has one camera", code=Code.SEVERAL_CAMERAS, hint="leave --model out"
        )
    with mindful_of(opened.warnings):
        found = validate_rig(opened.recording, splits=splits, seed=seed, kinematics=kinematics)
    warnings = [*map(str, opened.warnings), *found.calibration.warnings]
    data: dict[str, Any] = {
        "recording": opened.recording.name,
        "stations": len(opened.recording),
        "seed": seed,
        **found.to_dict(),
        "warnings": warnings,
    }
    if output is not None:
        write_json(output, data)

    def show(console: "Console") -> None:
        from handeye.cli.wording import figures, heading, notices, pairs  # noqa: PLC0415

        heading(
            console,
            opened.recording.name,
            f"{len(opened.recording)} stations, {splits} halvings, {found.undetermined} of them undetermined",
        )
        for name, one in (data["cameras"] | data["camera_to_camera"]).items():
            rows = [("stated (95 %)", _pair(one["within_95"], figures))]
            for what, words in (("halves", "random halves differ"), ("truth", "error against the truth")):
                if one[what] is not None:
                    nees = figures(one[what]["nees_per_dof"], 2)
                    rows.append((words, f"{_pair(one[what], figures)}, NEES/6 {nees} (ideal 1)"))
            console.print(name)
            pairs(console, rows, indent=2)
        notices(console, "Warnings", warnings)

    return Answer(data, show)
