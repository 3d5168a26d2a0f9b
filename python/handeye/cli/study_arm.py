"""`handeye study arm`: whether an arm that was put right is nearer to the truth where nobody looked."""

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


def arm(
    *,
    arms: int = 50,
    views: int = 30,
    postures: int = 1000,
    seed: Seed = 0,
    workers: Annotated[int | None, Parameter(show_default=False)] = None,
    scheduler: Annotated[str | None, Parameter(show_default=False)] = None,
    checkpoint: Path | None = None,
    output: Path | None = None,
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Compare arms with wrong links, as described and as put right, with the truth at unseen postures.

    Views are planned for it one by one. Errors of the tool are counted up to a motion of base and flange,
    which no view tells.

    Parameters
    ----------
    arms
        How many.
    views
        Views of each.
    postures
        Unseen postures of each.
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
    from handeye.studies.arm import ArmStudy, study_arm  # noqa: PLC0415

    check_folder(output)
    with progress("Putting arms right") as advance:
        document = study_arm(
            ArmStudy(arms=arms, views=views, postures=postures, seed=seed),
            workers=Trials(workers=workers, scheduler=scheduler, checkpoint=checkpoint).crew,
            progress=advance,
        )
    written = write_results(output, "arm", document, lambda: ())
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it
    from handeye.cli.wording import figures, heading, pairs  # noqa: PLC0415

    heading(console, f"{document['arms']} arms with wrong links", f"{document['views']} planned views each")
    before, after = figures(document["described_mm"]), figures(document["corrected_mm"])
    rows = [
        (
            "tool off by",
            f"{before} mm as described, {after} mm put right: {document['ratio']:.1f} times less",
        ),
        ("within what is stated", f"{document['held']:.1%}"),
    ]
    pairs(console, rows, indent=2)
    tables.show_written(console, written)
