"""`handeye study twin`: the paper's study on real data, on a twin of its cell whose truth is known."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Effort, write_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

_COLUMNS = (
    ("relative_translation_mm", "relative mm"),
    ("relative_rotation_deg", "relative deg"),
    ("rmse_px", "RMSE px"),
    ("translation_mm", "true mm"),
    ("rotation_deg", "true deg"),
)


def twin(
    *,
    sets: int = 7,
    trials: int = 10,
    models: Annotated[tuple[str, ...], Parameter(consume_multiple=True, show_default=False)] = (),
    render: bool = False,
    effort: Effort = Effort(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Repeat the paper's study on real data (table II) on a twin of its cell, where the truth is known.

    An arm with the layout of the Epson C4L, off by about 1 mm and 0.15 deg in a way that changes smoothly
    with the posture, a camera of 1280 x 1024 pixels, a symmetric grid of 4 x 4 circles. From random starts of
    3 views of the training part, 5 are added by each policy; errors are measured on the validation part, and
    against the truth.

    Parameters
    ----------
    sets
        Number of sets; the paper has seven.
    trials
        Random starts of each set.
    models
        Some of paper, auto and auto_with_arm (the default where the arm is described), if not all.
    render
        Render every picture and look for the circles in it, instead of projecting them with noise.
    """
    from handeye.simulation.twin import TwinOptions  # noqa: PLC0415
    from handeye.studies.twin import MODELS, study_twin  # noqa: PLC0415 - help need not wait for it

    check_folder(effort.output)
    with progress("Calibrating twins from random starts") as advance:
        result = study_twin(
            models=models or MODELS,
            sets=sets,
            trials=trials,
            options=TwinOptions(rendered=render),
            seed=effort.seed,
            workers=effort.crew,
            progress=advance,
        )

    def pictures() -> "Iterable[tuple[str, Figure]]":
        from handeye.studies.plots import curves_figure, scatter_figure  # noqa: PLC0415
        from handeye.studies.twin_plots import table_figure, trajectory_figure  # noqa: PLC0415

        yield "twin_table", table_figure(result)
        yield "twin_trajectories", trajectory_figure(result)
        for model, curves in result.models.items():
            yield f"twin_curves_{model}", curves_figure(curves, result.together(model))
            if model == "paper":
                yield "twin_scatter", scatter_figure(curves)

    document = result.to_dict()
    written = write_results(effort.output, "twin", document, pictures)
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from rich import box  # noqa: PLC0415 - JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    from handeye.cli import study_tables as tables  # noqa: PLC0415
    from handeye.cli.wording import figures, heading  # noqa: PLC0415

    arm = document["arm_error"]
    heading(
        console,
        "Twin of the paper's cell, errors on the validation part after 3 + 5 views",
        f"{document['set_count']} sets, {document['trials_per_set']} random starts of each, arm off by "
        f"{arm['translation_mm']:.2f} mm and {arm['rotation_deg']:.2f} deg, seed {document['seed']}",
    )
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    table.add_column("mean", no_wrap=True)
    for _, unit in _COLUMNS:
        table.add_column(unit, justify="right")
    for model, part in document["models"].items():
        table.add_row(Text(model, style="bold"))
        for policy, found in part["policies"].items():
            cells = [figures(found[metric]["mean"]) for metric, _ in _COLUMNS]
            table.add_row("  " + policy.replace("_", " "), *cells)
        table.add_section()
    console.print(table)
    for name, model in document["models"].items():
        if model["correlation"]["trials"]:
            console.print(
                f"{name}: correlation of predicted gain and fall of the RMSE, candidates of the first step: "
                f"median {model['correlation']['median']:.2f}"
            )
    tables.show_written(console, written)
