"""`handeye study scale`: what many trials cost on this machine, on a cluster, and after a break."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.options import Common, Seed
from handeye.cli.output import check_folder
from handeye.cli.study_options import Effort, write_results

if TYPE_CHECKING:
    from rich.console import Console


def scale(
    *,
    trials: int = 400,
    workers: Annotated[int | None, Parameter(show_default=False)] = None,
    no_cluster: Annotated[bool, Parameter(show_default=False)] = False,
    seed: Seed = 0,
    output: Path | None = None,
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Measure what a million trials of a study cost, how cost grows, and what a break costs.

    Simulated calibrations on several processes, half of them, kept on disk, and the other half after a break;
    the same on a Dask cluster that is started on loopback; and the first tenth on one process. Answers are
    compared to the bit.

    Parameters
    ----------
    trials
        Number of trials.
    workers
        Processes, and workers of the cluster; all processors by default.
    no_cluster
        Leave out the cluster, which needs the extra `cluster`.
    seed
        Seed of the trials.
    output
        Folder for the JSON object; made if it does not exist.
    """
    from handeye.studies.scale import study_scale  # noqa: PLC0415 - help need not wait for it

    check_folder(output)
    processes = Effort(workers=workers).processes
    document = study_scale(trials=trials, processes=processes, cluster=not no_cluster, seed=seed).to_dict()
    written = write_results(output, "scale", document, lambda: ())
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it
    from handeye.cli.wording import figures, heading  # noqa: PLC0415

    heading(console, "Simulated calibrations", f"seed {document['seed']}")
    table = tables.plain_table("way")
    for column in ("processes", "trials", "s", "hours a million, extrapolated", "same to the bit"):
        table.add_column(column, justify="right")
    for name, way in document["ways"].items():
        table.add_row(
            name.replace("_", " "),
            str(way["processes"]),
            str(way["trials"]),
            figures(way["seconds"]),
            figures(way["million_hours_extrapolated"]),
            "yes" if way["same_to_the_bit"] else "no",
        )
    console.print(table)
    resume = document["resume"]
    console.print(f"cost grows with the number of trials to the power of {document['growth_exponent']:.2f}")
    console.print(
        f"resumed after half: {figures(resume['second_half_seconds'])} s; all kept: "
        f"{figures(resume['all_kept_seconds'])} s; {resume['bytes_per_trial']:.0f} bytes a trial"
    )
    tables.show_written(console, written)
