"""`handeye study cheap-arms`: arms of hobby servos, and what nobody reaches with them."""

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


def cheap_arms(
    *,
    cells: int = 200,
    views: int = 20,
    play: bool = False,
    seed: Seed = 0,
    workers: Annotated[int | None, Parameter(show_default=False)] = None,
    scheduler: Annotated[str | None, Parameter(show_default=False)] = None,
    checkpoint: Path | None = None,
    output: Path | None = None,
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Count how often the region holds with arms of hobby servos, and how early a request is refused.

    Made-up arms of five joints with play of one to two degrees and zeros off by a degree, the camera in the
    hand and beside the arm, the arm described and not.

    Parameters
    ----------
    cells
        How many.
    views
        Views of each.
    play
        Estimate the play of the joints of arms that are described.
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
    from handeye.studies.cheap_arm import CheapArmStudy, study_cheap_arms  # noqa: PLC0415

    check_folder(output)
    with progress("Making up arms") as advance:
        document = study_cheap_arms(
            CheapArmStudy(cells, views, play, seed),
            workers=Trials(workers=workers, scheduler=scheduler, checkpoint=checkpoint).crew,
            progress=advance,
        )
    written = write_results(output, "cheap_arms", document, lambda: ())
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it
    from handeye.cli.wording import figures, heading, pairs  # noqa: PLC0415

    heading(console, f"{document['cells']} arms of hobby servos", f"{document['views']} views each")
    error, stated = figures(document["error_mm"]), figures(document["stated_mm"])
    rows = [
        ("region holds", f"{document['held']:.1%}, the stated radius {document['within']:.1%}"),
        ("camera off by", f"{error} mm on average, {stated} mm stated"),
        ("refused", f"{document['refused_in_time']:.1%} within six views"),
    ]
    if document["forecast_mm"] is not None:
        forecast, reached = figures(document["forecast_mm"]), figures(document["reached_mm"])
        rows.append(("forecast", f"{forecast} mm with 40 views, which came to {reached} mm"))
    pairs(console, rows, indent=2)
    tables.show_written(console, written)
