"""`handeye study probing`: whether touching finds a board of another size."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Effort, write_results
from handeye.studies.probing import ProbingStudy, study_probing

if TYPE_CHECKING:
    from rich.console import Console


def probing(
    *,
    cells: int = ProbingStudy.cells,
    board_percent: float = 100 * ProbingStudy.board_scale,
    effort: Effort = Effort(),  # noqa: B008
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
    """
    check_folder(effort.output)
    with progress("Touching boards") as advance:
        document = study_probing(
            ProbingStudy(cells, board_percent / 100, effort.seed),
            workers=effort.crew,
            progress=advance,
        )
    written = write_results(effort.output, "probing", document, lambda: ())
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
