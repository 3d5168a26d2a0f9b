"""The answer of `handeye solve` for several cameras."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.output import write_json
from handeye.cli.page import Page, serve, show_rig
from handeye.cli.source import mindful_of
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation import RigCalibration, solve_rig
from handeye.estimation.certificate import Certificate, certify_rig
from handeye.estimation.confidence import Within
from handeye.importing import OpenedRig
from handeye.types.calibration import ModelName
from handeye.types.kinematics import Kinematics

if TYPE_CHECKING:
    from rich.console import Console


def answer_for_rig(
    opened: OpenedRig,
    model: ModelName,
    output: Path | None,
    *,
    reduced: bool,
    kinematics: Kinematics | None,
    camera_fixed: bool,
    certify: bool,
    page: Page,
    arm: ArmSource,
) -> Answer:
    """Solve all cameras in one estimate, and certify it where that is asked for.

    Raises
    ------
    InputError, DegenerateError, SolveError
        As for `handeye.estimation.solve_rig`.
    """
    if model is ModelName.PAPER:
        raise InputError(
            "the paper's model has one camera", code=Code.SEVERAL_CAMERAS, hint="leave --model out"
        )
    with mindful_of(opened.warnings):
        rig = solve_rig(opened.recording, reduced=reduced, kinematics=kinematics, camera_fixed=camera_fixed)
    data = rig_data(opened, rig)
    certificate = certify_rig(rig) if certify else None
    if certificate is not None:
        data["certificate"] = certificate.to_dict()
    if output is not None:
        write_json(output, data)
    after = None if not page.ui else partial(_page, page, opened, rig, arm)
    return Answer(data, lambda console: _show(console, opened, rig, certificate, output), after)


def _page(page: Page, opened: OpenedRig, rig: RigCalibration, arm: ArmSource) -> None:
    serve(show_rig(page, opened, rig, arm=arm.described(), description=arm.robot))


def rig_data(opened: OpenedRig, rig: RigCalibration) -> dict[str, Any]:
    """Return what is printed for a program."""
    data: dict[str, Any] = dict(rig.to_dict())
    for name, camera in data["cameras"].items():
        missed = opened.missed.get(name, {})
        camera["views"]["rejected"] += [{"name": view, "reason": why} for view, why in missed.items()]
        camera["camera_origin"] = opened.camera_origins[name].value
    return {
        "recording": opened.recording.name,
        "layout": opened.layout,
        "source": opened.recording.source,
        "stations": len(opened.recording),
        **data,
        "warnings": [*map(str, opened.warnings), *rig.warnings],
    }


def _show(
    console: "Console",
    opened: OpenedRig,
    rig: RigCalibration,
    certificate: Certificate | None,
    output: Path | None,
) -> None:
    from handeye.cli.wording import (  # noqa: PLC0415 - a program reading JSON need not wait for it
        MOUNTINGS,
        figures,
        heading,
        notices,
        open_directions,
        pairs,
        pose_lines,
    )

    heading(
        console,
        opened.recording.name,
        f"{len(rig.cameras)} cameras, {len(rig.targets)} targets, {len(opened.recording)} stations",
    )
    for name, calibration in rig.cameras.items():
        used = {view.name for view in calibration.views if view.used}
        console.print()
        pose_name = calibration.mounting.result_names[0]
        heading(
            console, f"{name}: {pose_name}", f"{MOUNTINGS[calibration.mounting]}, {len(used)} stations used"
        )
        rows = pose_lines(calibration.results[pose_name])
        rows += [
            ("accuracy", _stated(rig.estimate.of_camera(name).within_95)),
            ("residuals", f"{figures(calibration.rmse_px)} px RMS"),
        ]
        pairs(console, rows, indent=2)
    for (a, b), relative in rig.camera_to_camera.items():
        console.print()
        heading(console, f"T_{a}_{b}", f"{b} in {a}, {relative.shared} stations shared")
        pairs(console, [*pose_lines(relative.pose), ("accuracy", _stated(relative.within_95))], indent=2)
    for name, relative in rig.targets.items():
        console.print()
        heading(console, f"{name}: T_{rig.target_bodies[name].value}_target", "")
        pairs(console, [*pose_lines(relative.pose), ("accuracy", _stated(relative.within_95))], indent=2)
    console.print()
    if certificate is not None:
        pairs(console, [("certificate", certificate.sentence)])
    left_out = {
        f"{name}, {view.name}": view.reason
        for name, calibration in rig.cameras.items()
        for view in calibration.views
        if not view.used
    } | {f"{name}, {view}": why for name, missed in opened.missed.items() for view, why in missed.items()}
    notices(console, "Left out", (f"{name}: {why}" for name, why in left_out.items()))
    open_directions(console, [d for found in rig.estimate.unobservable.values() for d in found])
    notices(console, "Diagnosis", (finding.sentence for finding in rig.diagnosis), "cyan")
    notices(console, "Warnings", [*map(str, opened.warnings), *rig.warnings])
    if output is not None:
        console.print(f"written: {output}")


def _stated(within: Within) -> str:
    from handeye.cli.wording import figures  # noqa: PLC0415

    return (
        f"within {figures(within.translation_mm)} mm and {figures(within.rotation_deg)} deg "
        "with 95 % probability"
    )
