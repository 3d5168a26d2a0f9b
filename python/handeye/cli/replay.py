"""`handeye replay`: what a recording brought, view by view, and what planning would have made of it."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output, write_json
from handeye.cli.page import Curve, Page, serve, show_views
from handeye.cli.progress import progress
from handeye.cli.source import Source, mindful_of
from handeye.datasets import PosePairs
from handeye.estimation import Measurements, make_estimator
from handeye.estimation.faults import examine
from handeye.importing import Opened, Posed, solve_poses
from handeye.planning.hindsight import START, After, Hindsight, Pictures, hindsight
from handeye.robots import ArmKinematics
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from rich.console import Console


def replay(
    folder: Path,
    /,
    *,
    output: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    page: Page = Page(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Go through old data again: what was known after each view, and what planning would have made of it.

    Says which views did nothing, how many a planned session would have needed out of these, where three more
    pictures would help most, and what they would bring.

    Parameters
    ----------
    folder
        Folder with the views, in any layout that solve reads, poses of the target without pictures too.
    output
        Also write the JSON object to this file.
    """
    check_output(output)
    opened = source.open_any(folder, arm.described())
    after = None
    if isinstance(opened, PosePairs):
        if page.ui:
            raise UsageError(f"--ui shows views, and {opened.name} has poses of the target without pictures")
        data = _of_poses(opened)
    else:
        kinematics = arm.kinematics(opened.recording.views, ModelName.AUTO)
        known = examine(
            Measurements.of_recording(opened.recording), by_joints=kinematics is not None
        ).measurements
        with progress("Going through the views"):
            found = hindsight(Pictures(known, make_estimator(ModelName.AUTO, kinematics)))
        data = {"recording": opened.recording.name, "views": len(known), **found.to_dict()}
        if page.ui:
            after = partial(_page, page, opened, known, found, kinematics, arm.robot)
    if output is not None:
        write_json(output, data)
    return Answer(data, lambda console: _show(console, data), after)


def _of_poses(pairs: PosePairs) -> dict[str, Any]:
    with mindful_of(pairs.warnings):
        used = solve_poses(pairs).used
    kept = replace(pairs, pairs=tuple(pair for pair, good in zip(pairs.pairs, used, strict=True) if good))
    with progress("Going through the samples"):
        found = hindsight(Posed(kept))
    return {"recording": pairs.name, "views": len(kept), **found.to_dict()}


def _page(
    page: Page,
    opened: Opened,
    known: Measurements,
    found: Hindsight,
    kinematics: ArmKinematics | None,
    description: str | None,
) -> None:
    shown = show_views(
        page,
        opened,
        known,
        make_estimator(ModelName.AUTO, kinematics)(known),
        arm=None if kinematics is None else kinematics.arm,
        description=description,
        known=_curve(found.steps),
        planned=_curve(found.planned),
    )
    serve(shown)


def _curve(steps: tuple[After, ...]) -> Curve:
    return tuple(
        (number, step.within.translation_mm, step.within.rotation_deg)
        for number, step in enumerate(steps, START)
        if step.within is not None
    )


def _show(console: "Console", data: dict[str, Any]) -> None:
    from rich import box  # noqa: PLC0415 - JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli.wording import figures, heading  # noqa: PLC0415

    heading(console, data["recording"], f"{data['views']} views, within so much with 95 % probability")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("views", "as taken", "mm", "deg", "planned", "mm", "deg"):
        table.add_column(name, justify="left" if name in {"as taken", "planned"} else "right")
    for number, (taken, planned) in enumerate(zip(data["steps"], data["planned"], strict=True), start=3):
        row = [str(number)]
        for step in (taken, planned):
            known = step["within_95"]
            nothing = " (did nothing)" if step["did_nothing"] else ""
            row.append(f"{step['view']}{nothing}")
            row += (
                ["open", "open"]
                if known is None
                else [
                    figures(known["translation_mm"]),
                    figures(known["rotation_deg"], 2),
                ]
            )
        table.add_row(*row)
    console.print(table)
    if data["enough"] is not None:
        console.print(f"Planned, {data['enough']} of these views would have been enough.", markup=False)
    if data["then_within_95"] is not None:
        then = data["then_within_95"]
        console.print(
            f"Three more pictures help most at {', '.join(data['repeat'])}: then within "
            f"{figures(then['translation_mm'])} mm and {figures(then['rotation_deg'], 2)} deg.",
            markup=False,
        )
