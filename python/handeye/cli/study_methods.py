"""`handeye study methods`: every method of the field a row, on the same simulated cells."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Trials, write_results

# Below this an error is rounding, mm and degrees.
NOTHING = 1e-6

if TYPE_CHECKING:
    from rich.console import Console


def methods(*, trials: Trials = Trials(), common: Common = Common()) -> Answer:  # noqa: ARG001, B008
    """Compare every method on the same simulated cells, by level of noise and mounting.

    Closed forms, costs on poses, OpenCV's seven where its wheel has them, plain reprojection least squares
    with the arm taken as exact, and the default. Level 1 is an arm of 0.02 deg and 0.35 mm and pixels of
    0.1 px; level 0 is without noise, where every method must find the truth.
    """
    from handeye.studies.methods import study_methods  # noqa: PLC0415 - help need not wait for it

    check_folder(trials.output)
    with progress("Calibrating by every method") as advance:
        result = study_methods(
            trials=trials.count(50), seed=trials.seed, workers=trials.crew, progress=advance
        )
    document = result.to_dict()
    written = write_results(trials.output, "methods", document, lambda: ())
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from rich import box  # noqa: PLC0415 - JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli import study_tables as tables  # noqa: PLC0415
    from handeye.cli.wording import heading  # noqa: PLC0415

    for mounting, rows in document["mountings"].items():
        heading(
            console,
            f"Median error of the camera, {mounting.replace('_', ' ')}",
            f"{document['trials']} cells of each level, seed {document['seed']}, OpenCV {document['opencv']}",
        )
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        table.add_column("method", no_wrap=True)
        for level in document["levels"]:
            table.add_column(f"level {level['level']:g}", justify="right")
        for method, cells in rows.items():
            table.add_row(method, *map(_cell, cells))
        console.print(table)
    console.print("mm / deg; level 1: arm 0.02 deg and 0.35 mm per axis, pixels 0.1 px")
    tables.show_written(console, written)


def _cell(cell: dict[str, Any]) -> str:
    from handeye.cli.wording import figures  # noqa: PLC0415

    if cell["translation_mm"] is None:
        return "refused"
    values = (cell["translation_mm"], cell["rotation_deg"])
    return " / ".join("0" if value < NOTHING else figures(value) for value in values)
