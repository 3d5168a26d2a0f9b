"""`handeye study shift`: whether a check finds what moved, and names it."""

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


def shift(
    *,
    trials: int = 100,
    sigmas: float = 3.0,
    views: int = 2,
    described: bool = True,
    seed: Seed = 0,
    workers: Annotated[int | None, Parameter(show_default=False)] = None,
    scheduler: Annotated[str | None, Parameter(show_default=False)] = None,
    checkpoint: Path | None = None,
    output: Path | None = None,
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Count how often a check alarms, and names what moved.

    Made-up cells in which everything is wrong a little: calibrated with ten views, then shifted, then checked
    with planned views and with random ones.

    Parameters
    ----------
    trials
        Checks of each kind of shift, and of none.
    sigmas
        Size of the shift over the standard deviation that the planned views predict for one.
    views
        Planned views of a check.
    described
        Whether the arm is described.
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
    from handeye.studies.shift import ShiftStudy, study_shift  # noqa: PLC0415

    check_folder(output)
    with progress("Checking") as advance:
        document = study_shift(
            ShiftStudy(trials, sigmas, views, described, seed),
            workers=Trials(workers=workers, scheduler=scheduler, checkpoint=checkpoint).crew,
            progress=advance,
        )
    written = write_results(output, "shift", document, lambda: ())
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from rich import box  # noqa: PLC0415 - JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli import study_tables as tables  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("moved")
    counts = list(document["moved"]["nothing"]["random"])
    for name in ("by mm", "alarms", "named", *(f"{count} random" for count in counts)):
        table.add_column(name, justify="right")
    for name, one in document["moved"].items():
        named = "" if name == "nothing" or one["named"] is None else f"{one['named']:.1%}"
        size = "" if name == "nothing" else f"{one['size_mm']:.2f}"
        random = [f"{one['random'][count]:.1%}" for count in counts]
        table.add_row(name, size, f"{one['alarms']:.1%}", named, *random)
    console.print(table)
    tables.show_written(console, written)
