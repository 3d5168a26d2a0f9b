"""`handeye demo`: the shipped recording replayed under the policies, a table and a picture."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_picture, write_figure
from handeye.cli.progress import progress
from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.evaluation.demonstration import Demonstration, Way, demonstrate
from handeye.evaluation.demonstration_picture import demonstration_figure
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from rich.console import Console

# Fewer are done before another process has begun to work.
STARTS_PER_WORKER = 12
_NAMES = {
    Way("next_best_view"): "next best view",
    Way("random"): "random",
    Way("max_distance"): "max distance",
    Way("next_best_view", ModelName.PAPER): "next best (paper)",
}


def demo(
    *,
    picture: Path = Path("handeye-demo.png"),
    starts: int = 12,
    seed: int = 0,
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Show what choosing views is worth, on a recording that comes with handeye.

    Random starts of 3 views are continued with 5 more, chosen by the next-best-view, the random and the
    max-distance policy, and each answer is compared with the truth. The recording: corners and robot poses of
    a rendered chessboard (Ali, Suominen, Gotchev and Ruiz Morales, Sensors 19(12), 2837, 2019).

    Parameters
    ----------
    picture
        Where to write the picture (.png, .svg or .pdf).
    starts
        Number of random starts, the same for every policy.
    seed
        Seed of the starts.
    """
    check_picture(picture)
    recording = read_recording(shipped_recording()).recording
    workers = max(1, min(os.cpu_count() or 1, starts // STARTS_PER_WORKER))
    with progress("Replaying from random starts") as advance:
        shown = demonstrate(recording, starts=starts, seed=seed, workers=workers, progress=advance)
    write_figure(picture, demonstration_figure(shown))
    data = shown.to_dict() | {"picture": str(picture)}
    return Answer(data, lambda console: _show(console, shown, picture))


def _show(console: "Console", shown: Demonstration, picture: Path) -> None:
    from rich import box  # noqa: PLC0415 - a program reading JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli.wording import figures, heading  # noqa: PLC0415

    heading(
        console, shown.recording.name, f"{len(shown.recording)} views of a rendered chessboard, truth known"
    )
    console.print(shown.recording.source, style="dim")
    last = shown.views[-1]
    console.print(
        f"\nError of the camera's position in mm by number of views, mean of {shown.protocol.trials} random "
        f"starts; median and error of the rotation after {last}"
    )
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("policy")
    for name in (*map(str, shown.views), "median", "deg"):
        table.add_column(name, justify="right")
    for way, name in _NAMES.items():
        curve = shown.curves[way].to_dict()
        cells = [figures(value, 2) for value in curve["translation_mm"]["mean"]]
        cells.append(figures(curve["translation_mm"]["median"][-1], 2))
        cells.append(figures(curve["rotation_deg"]["mean"][-1], 2))
        table.add_row(name, *cells)
    console.print(table)
    console.print(shown.sentence)
    console.print(f"\nwritten: {picture}")
