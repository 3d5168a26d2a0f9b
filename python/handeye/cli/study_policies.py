"""`handeye study policies` and `handeye study gains`: who chooses views best, and what gains are worth."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Trials, write_results
from handeye.types.mounting import Mounting

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console
    from rich.table import Table


class SimulatedArmKind(StrEnum):
    """What is wrong with the arm of the cells."""

    EXACT = "exact"
    REALISTIC = "realistic"


def policies(
    *,
    budgets: Annotated[tuple[int, ...], Parameter(consume_multiple=True)] = (8, 12),
    arm: SimulatedArmKind = SimulatedArmKind.REALISTIC,
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Compare policies in the same simulated cells: the same start, budget and noise.

    Ours as `handeye run` drives, one view after another from a pool and all at once, the paper's two
    baselines from the pool and from the candidates of `handeye run`, the fixed moves of other tools, a
    lattice driven to and fro, and poses as people choose them. What each brings is solved alike, by the
    default with the arm described, and measured several times with all noise drawn again. Beside each mean
    stands how many times the error of the first row it is (geometric mean over the cells), and its 95 %
    interval.

    Parameters
    ----------
    budgets
        Numbers of views, the three of the start included.
    arm
        exact, or realistic: encoders, offsets, links and play at once, as in the cell of `handeye run`.
    """
    from handeye.studies.policies import study_policies  # noqa: PLC0415 - help need not wait for it

    check_folder(trials.output)
    with progress("Calibrating by every policy") as advance:
        result = study_policies(
            budgets=budgets,
            arm=arm.value,
            trials=trials.count(40),
            seed=trials.seed,
            workers=trials.crew,
            progress=advance,
        )
    document = result.to_dict()
    name = f"policies_{arm.value}"
    written = write_results(trials.output, name, document, lambda: _policies_picture(name, document))
    return Answer(document, lambda console: _show_policies(console, document, written))


def gains(
    *,
    mounting: Mounting = Mounting.EYE_IN_HAND,
    arm: SimulatedArmKind = SimulatedArmKind.REALISTIC,
    candidates: int = 25,
    draws: int = 50,
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Correlate predicted gains with what candidates bring in expectation, and in single draws.

    Every candidate of a first step is taken many times in a twin of the cell, all noise drawn again, and the
    reduction of the error against the truth, and of the RMSE on held-out views, is averaged.

    Parameters
    ----------
    mounting
        Where the camera sits.
    arm
        exact, or realistic: encoders, offsets, links and play at once.
    candidates
        Candidates of each start.
    draws
        Repetitions of each candidate.
    """
    from handeye.studies.gains import study_gains  # noqa: PLC0415 - help need not wait for it

    check_folder(trials.output)
    with progress("Taking candidates again and again") as advance:
        result = study_gains(
            mounting=mounting,
            arm=arm.value,
            model=trials.model,
            trials=trials.count(20),
            candidates=candidates,
            draws=draws,
            seed=trials.seed,
            workers=trials.crew,
            progress=advance,
        )
    document = result.to_dict()
    name = f"gains_{mounting.value}_{arm.value}"
    written = write_results(trials.output, name, document, lambda: _gains_picture(name, document))
    return Answer(document, lambda console: _show_gains(console, document, written))


def _policies_picture(name: str, document: dict[str, Any]) -> "list[tuple[str, Figure]]":
    from handeye.studies.policies_picture import draw_policies  # noqa: PLC0415 - only where one is asked for

    return [(name, draw_policies(document))]


def _gains_picture(name: str, document: dict[str, Any]) -> "list[tuple[str, Figure]]":
    from handeye.studies.gains_picture import draw_gains  # noqa: PLC0415 - only where one is asked for

    return [(name, draw_gains(document))]


def _show_policies(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it
    from handeye.cli.wording import figures, heading  # noqa: PLC0415

    for mounting, parts in document["mountings"].items():
        heading(
            console,
            f"Mean error of the camera, {mounting.replace('_', ' ')}",
            f"arm {document['arm']}, {document['trials']} cells, seed {document['seed']}",
        )
        table = _table("policy")
        for budget in parts:
            table.add_column(f"{budget} views (mm)", justify="right")
            table.add_column("times ours", justify="right")
            table.add_column("(deg)", justify="right")
            table.add_column("times ours", justify="right")
        for policy in next(iter(parts.values())):
            cells: list[str] = []
            for rows in parts.values():
                for name in ("translation_mm", "rotation_deg"):
                    found = rows[policy][name]
                    low, high = found["over_ours_95"]
                    cells += [figures(found["mean"]), f"{found['over_ours']:.2f} ({low:.2f}-{high:.2f})"]
            table.add_row(policy.replace("_", " "), *cells)
        console.print(table)
    tables.show_written(console, written)


def _show_gains(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it
    from handeye.cli.wording import heading  # noqa: PLC0415

    heading(
        console,
        "Correlation of predicted gain and reduction, median over the starts",
        f"{document['starts']} starts, {document['candidates']} candidates, {document['draws']} draws each, "
        f"{document['mounting'].replace('_', ' ')}, arm {document['arm']}, seed {document['seed']}",
    )
    for criterion, part in document["correlation"].items():
        table = _table(criterion.replace("_", " "))
        for column in ("expected", "quartiles", "corrected", "of the mean gain", "single draws"):
            table.add_column(column, justify="right")
        for quantity, found in part.items():
            table.add_row(
                quantity.replace("_", " "),
                f"{found['expected_median']:.2f}",
                f"{found['expected_lower_quartile']:.2f} to {found['expected_upper_quartile']:.2f}",
                f"{found['corrected_median']:.2f}",
                f"{found['mean_gain_median']:.2f}",
                f"{found['single_median']:.2f}",
            )
        console.print(table)
    tables.show_written(console, written)


def _table(first: str) -> "Table":
    from rich import box  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    table.add_column(first, no_wrap=True)
    return table
