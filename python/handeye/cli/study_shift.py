"""`handeye study shift`: whether a check finds what moved, and names it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Effort, write_results
from handeye.studies.nights import study_nights
from handeye.studies.shift import ShiftStudy, study_shift

if TYPE_CHECKING:
    from rich.console import Console

FEWEST_NIGHTS = 2


def shift(
    *,
    trials: int = ShiftStudy.trials,
    sigmas: float = ShiftStudy.sigmas,
    views: int = ShiftStudy.views,
    described: bool = ShiftStudy.arm_known,
    nights: int | None = None,
    effort: Effort = Effort(),  # noqa: B008
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
    nights
        Instead: logs of a check every night, so many nights, with the shift in a random one; how often the
        log names that night.
    """
    check_folder(effort.output)
    if nights is not None and nights < FEWEST_NIGHTS:
        raise UsageError(f"--nights {nights}: a shift needs a night before it")
    options = ShiftStudy(trials, sigmas, views, described, effort.seed)
    with progress("Checking") as advance:
        if nights is None:
            document = study_shift(options, workers=effort.crew, progress=advance)
        else:
            document = study_nights(options, nights, workers=effort.crew, progress=advance)
    written = write_results(effort.output, document["study"], document, lambda: ())
    show = _show if nights is None else _show_nights
    return Answer(document, lambda console: show(console, document, written))


def _show_nights(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from rich import box  # noqa: PLC0415 - JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli import study_tables as tables  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("moved")
    for name in ("night named", "within one", "none named", "alarms before"):
        table.add_column(name, justify="right")
    for name, one in document["moved"].items():
        keys = ("named", "named_within_one", "none_named", "early_alarms_per_night")
        shares = ["" if name == "nothing" and "within" in key else f"{one[key]:.1%}" for key in keys]
        table.add_row(name, *shares)
    console.print(table)
    tables.show_written(console, written)


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
