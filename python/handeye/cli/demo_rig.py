"""`handeye demo --rig`: four cameras and two boards, driven until all of them are as accurate as asked."""

from pathlib import Path
from typing import TYPE_CHECKING

from handeye.cli.answer import Answer
from handeye.cli.progress import progress

if TYPE_CHECKING:
    from rich.console import Console

    from handeye.estimation import RigEstimate
    from handeye.types import Station


def drive_rig(folder: Path, seed: int) -> Answer:
    """Drive a simulated rig into a folder; a run that was broken off goes on.

    Raises
    ------
    InputError
        The folder holds the recording of another cell.
    OutputError
        It cannot be written.
    """
    from handeye.session.rig import RigWish  # noqa: PLC0415 - help need not wait for it
    from handeye.studies.rig_loop import drive, judged, rig_cell  # noqa: PLC0415

    cell, wish = rig_cell(seed), RigWish(seed=seed)
    with progress("Taking stations with four cameras") as advance:

        def count(station: "Station", estimate: "RigEstimate | None") -> None:
            del estimate
            advance(int(station.name.split("_")[1]), wish.most_stations)

        end = drive(cell, wish, folder, taken=count)
    run = judged(cell, end, wish)
    request = wish.request
    asked = {} if request is None else {"mm": request.translation_mm, "deg": request.rotation_deg}
    data = {"folder": str(folder), "asked": asked, **run.to_dict()}

    def show(console: "Console") -> None:
        from handeye.cli.wording import figures, heading, pairs  # noqa: PLC0415

        heading(
            console,
            "rig",
            f"{len(run.cameras)} cameras, 2 boards, simulated; the truth is hidden from the loop",
        )
        if asked:
            console.print(f"asked: every camera within {asked['mm']} mm and {asked['deg']} deg with 95 %")
        console.print(f"ended after {run.stations} stations: {run.reason.replace('_', ' ')}\n")
        rows: list[tuple[str, str]] = []
        for name, stated in run.stated_mm.items():
            off = f"{figures(run.error_mm[name], 2)} mm and {figures(run.error_deg[name], 2)} deg"
            rows.append((name, f"promised {figures(stated, 2)} mm, off the truth {off}"))
        pairs(console, rows, indent=2)
        console.print(f"\nrecording: {folder}", soft_wrap=True)

    return Answer(data, show)
