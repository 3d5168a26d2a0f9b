"""`handeye study cheap-arms`: arms of hobby servos, and what nobody reaches with them."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Effort, write_results
from handeye.studies.cheap_arm import CheapArmStudy, study_cheap_arms

if TYPE_CHECKING:
    from rich.console import Console


def cheap_arms(
    *,
    cells: int = CheapArmStudy.cells,
    views: int = CheapArmStudy.views,
    play: bool = CheapArmStudy.play,
    effort: Effort = Effort(),  # noqa: B008
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
    """
    check_folder(effort.output)
    with progress("Making up arms") as advance:
        document = study_cheap_arms(
            CheapArmStudy(cells, views, play, effort.seed),
            workers=effort.crew,
            progress=advance,
        )
    written = write_results(effort.output, "cheap_arms", document, lambda: ())
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
