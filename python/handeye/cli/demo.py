"""`handeye demo`: the shipped recording replayed, or simulated cells driven; a table and a picture."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common, Seed
from handeye.cli.output import check_new_folder, check_picture, write_figure
from handeye.cli.progress import progress
from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.studies.demonstration import Demonstration, Way, demonstrate
from handeye.studies.demonstration_picture import demonstration_figure
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from rich.console import Console

    from handeye.studies.closed_loop import ClosedLoop

# Fewer are done before another process has begun to work.
STARTS_PER_WORKER = 12
STARTS, CELLS = 12, 4
_NAMES = {
    Way("next_best_view"): "next best view",
    Way("random"): "random",
    Way("max_distance"): "max distance",
    Way("next_best_view", ModelName.PAPER): "next best (paper)",
}


def demo(
    *,
    picture: Path = Path("handeye-demo.png"),
    cell: Annotated[Path | None, Parameter(show_default=False)] = None,
    rig: Annotated[Path | None, Parameter(show_default=False)] = None,
    folder: Annotated[Path | None, Parameter(show_default=False)] = None,
    starts: Annotated[int | None, Parameter(show_default=False)] = None,
    points_only: Annotated[float | None, Parameter(show_default=False)] = None,
    seed: Seed = 0,
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Show what choosing views is worth: on a recording that comes with handeye, or with --cell on the move.

    Random starts of 3 views are continued with 5 more, chosen by the next-best-view, the random and the
    max-distance policy, and each answer is compared with the truth. The recording: corners and robot poses of
    a rendered chessboard (Ali, Suominen, Gotchev and Ruiz Morales, Sensors 19(12), 2837, 2019).

    With --cell a simulated arm is driven: it looks, decides and moves; pictures are rendered and the target
    is looked for in them. What was reached is compared with what was promised, and with the truth, which the
    loop does not see.

    With --rig a simulated arm with two cameras on its flange, two beside it and two boards is driven until
    every camera is as accurate as asked; pixels are projected, not rendered. Broken off, it goes on.

    With --folder nothing is shown: a new folder with rendered pictures of a ChArUco board and the poses of a
    simulated robot is written, to try the other commands on.

    Parameters
    ----------
    picture
        Where to write the picture (.png, .svg or .pdf).
    cell
        Drive simulated cells; a new folder for the session of the first one, with its report.
    rig
        Drive a simulated rig; a folder for its recording.
    folder
        Write a folder of pictures and poses.
    starts
        Number of random starts, the same for every policy (12); with --cell the number of cells (4).
    points_only
        With --cell: project points with so much noise (px) instead of rendering and detecting; faster.
    seed
        Seed of the starts, or of the cells.
    """
    if folder is not None:
        return _example(folder, seed)
    if rig is not None:
        from handeye.cli.demo_rig import drive_rig  # noqa: PLC0415 - the recording needs none of it

        return drive_rig(rig, seed)
    check_picture(picture)
    if cell is not None:
        return _closed_loop(picture, cell, CELLS if starts is None else starts, points_only, seed)
    if points_only is not None:
        raise UsageError("--points-only needs --cell", hint="the recording has points only anyway")
    count = STARTS if starts is None else starts
    recording = read_recording(shipped_recording()).recording
    workers = max(1, min(os.cpu_count() or 1, count // STARTS_PER_WORKER))
    with progress("Replaying from random starts") as advance:
        shown = demonstrate(recording, starts=count, seed=seed, workers=workers, progress=advance)
    write_figure(picture, demonstration_figure(shown))
    data = shown.to_dict() | {"picture": str(picture)}
    return Answer(data, lambda console: _show(console, shown, picture))


def _example(folder: Path, seed: int) -> Answer:
    check_new_folder(folder)
    from handeye.simulation.example_folder import POSES_FILE, TARGET_FILE, write_example  # noqa: PLC0415

    with progress("Rendering pictures") as advance:
        example = write_example(folder, seed, progress=advance)
    x, y, z = (1e3 * value for value in example.T_flange_camera.translation)
    data = {
        "folder": str(folder),
        "pictures": list(example.pictures),
        "poses": POSES_FILE,
        "target": TARGET_FILE,
        "T_flange_camera": example.T_flange_camera.to_list(),
    }

    def show(console: "Console") -> None:
        count = len(example.pictures)
        console.print(f"{folder}: {count} pictures, {POSES_FILE}, {TARGET_FILE}", soft_wrap=True)
        console.print(f"the camera truly sits at {x:.3f} {y:.3f} {z:.3f} mm in the flange frame")

    return Answer(data, show)


def _closed_loop(picture: Path, folder: Path, cells: int, points_only: float | None, seed: int) -> Answer:
    check_new_folder(folder)
    from handeye.cli.session_report import report_of_session  # noqa: PLC0415 - the recording needs none of it
    from handeye.studies.closed_loop import LoopOptions, drive_cells  # noqa: PLC0415
    from handeye.studies.closed_loop_picture import closed_loop_figure  # noqa: PLC0415

    options = LoopOptions(cells=cells, seed=seed, points_only=points_only)
    workers = max(1, min(os.cpu_count() or 1, cells))
    with progress("Driving simulated cells under three policies") as advance:
        shown = drive_cells(options, folder, workers=workers, progress=advance)
    write_figure(picture, closed_loop_figure(shown))
    report, trouble = report_of_session(folder, ModelName.AUTO)
    data = shown.to_dict() | {
        "picture": str(picture),
        "session": str(folder),
        "report": None if report is None else str(report),
    }

    def show(console: "Console") -> None:
        _show_loop(console, shown)
        console.print(f"\nwritten: {picture}", soft_wrap=True)
        console.print(f"session: {folder}", soft_wrap=True)
        console.print(trouble if report is None else f"report:  {report}", soft_wrap=True)

    return Answer(data, show)


def _show_loop(console: "Console", shown: "ClosedLoop") -> None:
    from rich import box  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli.wording import figures, heading, pairs  # noqa: PLC0415

    options = shown.options
    seen = "rendered pictures" if options.points_only is None else "projected points"
    heading(
        console,
        "closed loop",
        f"{options.cells} simulated cells, {options.robot}, {seen}; the truth is hidden from it",
    )
    console.print(
        f"\nError of the camera's position in mm by number of views, mean of {options.cells} cells; after "
        f"{options.views[-1]}: radius promised with 95 %, how often kept, and error of the rotation"
    )
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    table.add_column("policy", no_wrap=True)
    for name in (*map(str, options.views), "95 %", "kept", "deg"):
        table.add_column(name, justify="right")
    for way, name in _NAMES.items():
        if way.model is ModelName.PAPER:
            continue
        drives = shown.drives[way.policy]
        table.add_row(
            name,
            *(figures(float(v), 2) for v in shown.values(way.policy, "translation_mm").mean(axis=0)),
            figures(float(shown.values(way.policy, "within_mm")[:, -1].mean()), 2),
            f"{sum(drive.inside for drive in drives)}/{len(drives)}",
            figures(float(shown.values(way.policy, "rotation_deg")[:, -1].mean()), 2),
        )
    console.print(table)
    console.print(shown.sentence)
    kept = shown.shown
    console.print(f"\nThe first cell, views chosen for their gain ({len(kept.entries)} attempts):")
    rows = [
        (name, f"{figures(float(mm), 2)} mm and {figures(float(deg), 2)} deg{note}")
        for name, mm, deg, note in (
            ("promised", kept.within_mm[-1], kept.within_deg[-1], " with 95 % probability"),
            ("reached", kept.translation_mm[-1], kept.rotation_deg[-1], " off the hidden truth"),
        )
    ]
    pairs(console, rows, indent=2)


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
