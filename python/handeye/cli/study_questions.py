"""`handeye study questions`: what boards, distances, views, tilts, lenses and arms make of the accuracy."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, validators

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Work, write_results
from handeye.studies.expectation import CELLS
from handeye.studies.questions import Question, study_questions

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure
    from rich.console import Console


def questions(
    *,
    only: Annotated[tuple[Question, ...], Parameter(consume_multiple=True)] = tuple(Question),
    cells: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=1000))] = CELLS,
    work: Work = Work(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Answer which board, how far, how many views, how much tilt, which lens and which arm.

    One thing of a good cell is varied at a time; the errors to expect are those of `handeye expect`.

    Parameters
    ----------
    only
        Questions to answer, if not all.
    cells
        Simulated cells of each choice.
    """
    check_folder(work.output)
    with progress("Simulating cells") as advance:
        document = study_questions(only, cells=cells, workers=work.crew, progress=advance)

    def pictures() -> "Iterable[tuple[str, Figure]]":
        from handeye.studies.questions_picture import draw_question  # noqa: PLC0415

        for name, choices in document["questions"].items():
            yield f"which-{name}", draw_question(choices)

    written = write_results(work.output, "questions", document, pictures)
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: "list[Path]") -> None:
    from rich import box  # noqa: PLC0415 - JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli import study_tables as tables  # noqa: PLC0415
    from handeye.cli.wording import figures  # noqa: PLC0415

    for name, choices in document["questions"].items():
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        table.add_column(name)
        for heading in ("views", "mean error mm", "mean error deg"):
            table.add_column(heading, justify="right")
        for choice in choices:
            for level in choice["levels"]:
                values = (figures(level[key], 2) for key in ("mean_mm", "mean_deg"))
                table.add_row(choice["choice"], str(level["views"]), *values)
        console.print(table)
    tables.show_written(console, written)
