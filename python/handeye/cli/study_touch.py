"""`handeye study touch`: whether the tool lands where it is said to."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Effort, write_results
from handeye.cli.work import check_touch
from handeye.studies.touch import TouchStudy, study_touch

if TYPE_CHECKING:
    from rich.console import Console


def touch(
    *,
    cells: int = TouchStudy.cells,
    touches: int = TouchStudy.touches,
    touch_mm: float | None = None,
    views: int = TouchStudy.views,
    effort: Effort = Effort(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Count how often the tool lands within the stated touch error, at places where nobody looked before.

    Made-up cells in which everything is wrong a little (mixtures of the coverage study), the camera in the
    hand and beside the robot, the arm described and not. In each a part of known size is seen at random
    places of a box from random postures, and touched with the tool at random tilts.

    Parameters
    ----------
    cells
        Cells of each of the four groups.
    touches
        Random places and postures in each.
    touch_mm
        Also choose views one by one out of 40, by entropy and by touch error, and stop at this touch error;
        and how much less than entropy the best choice of all would leave, everything known.
    views
        Views after which entropy and touch error are compared.
    """
    check_touch(touch_mm)
    check_folder(effort.output)
    with progress("Seeing and touching") as advance:
        document = study_touch(
            TouchStudy(cells=cells, touches=touches, views=views, asked_mm=touch_mm, seed=effort.seed),
            workers=effort.crew,
            progress=advance,
        )
    written = write_results(effort.output, "touch", document, lambda: ())
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from rich import box  # noqa: PLC0415 - JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli import study_tables as tables  # noqa: PLC0415
    from handeye.cli.wording import figures  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("cells")
    planned = document["asked_mm"] is not None
    names = ["within", "error mm", "stated mm"]
    if planned:
        names += ["by entropy mm", "by touch mm", "all 40 mm", "best choice", "reached", "kept"]
    for name in names:
        table.add_column(name, justify="right")
    for name, group in document["groups"].items():
        row = [name.replace("_", " "), f"{group['held']:.1%}"]
        row += [figures(group["error_mm"]), figures(group["radius_mm"])]
        if planned:
            row += [figures(group["planned_by_entropy_mm"]), figures(group["planned_by_touch_mm"])]
            row += [figures(group["whole_pool_mm"])]
            row += [f"{group['foretold_best_mm'] / group['foretold_by_entropy_mm'] - 1:.1%}"]
            row += [f"{group['asked_met']} of {document['cells']}", f"{group['asked_held']:.1%}"]
        table.add_row(*row)
    console.print(table)
    tables.show_written(console, written)
