"""`handeye study probing`: whether touching finds a board of another size."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.options import Common, Seed
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study import Trials, write_results

if TYPE_CHECKING:
    from rich.console import Console


def probing(
    *,
    cells: int = 100,
    board_percent: float = 0.5,
    seed: Seed = 0,
    workers: Annotated[int | None, Parameter(show_default=False)] = None,
    scheduler: Annotated[str | None, Parameter(show_default=False)] = None,
    checkpoint: Path | None = None,
    output: Path | None = None,
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Count what finds a board that is larger than stated: halves, residuals, or three touched corners.

    Made-up cells in which everything is wrong a little, the camera in the hand and beside the robot, the arm
    described and not.

    Parameters
    ----------
    cells
        How many.
    board_percent
        By how much their boards are larger than stated; 0 counts false alarms.
    seed
        Seed of everything random.
    workers
        Processes; all processors by default. The results do not depend on it.
    scheduler
        Address of a Dask scheduler whose workers do the work, such as tcp://127.0.0.1:8786.
    checkpoint
        Folder that keeps finished pieces: the same command goes on where it was broken off.
    output
        Folder for the JSON object; made if it does not exist.
    """
    from handeye.studies.probing import ProbingStudy, study_probing  # noqa: PLC0415

    check_folder(output)
    with progress("Touching boards") as advance:
        document = study_probing(
            ProbingStudy(cells, board_percent / 100, seed),
            workers=Trials(workers=workers, scheduler=scheduler, checkpoint=checkpoint).crew,
            progress=advance,
        )
    written = write_results(output, "probing", document, lambda: ())
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it
    from handeye.cli.wording import heading, pairs  # noqa: PLC0415

    heading(console, f"{document['cells']} cells", f"boards {100 * document['board_scale']:g} % too large")
    rows = [
        ("halves differ", f"{document['halves_differ']:.1%}"),
        ("residuals", f"{document['residual_ratio']:.2f} times the noise of the pixels"),
        ("touches alarm", f"{document['alarms']:.1%}, the board named in {document['named']:.1%}"),
        ("region holds", f"{document['held']:.1%}, with the touches {document['held_with_touches']:.1%}"),
    ]
    pairs(console, rows, indent=2)
    tables.show_written(console, written)
