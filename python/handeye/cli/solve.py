"""`handeye solve`: the answer for a folder of views."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output, write_json
from handeye.cli.page import Page, serve, show_views
from handeye.cli.solve_poses import answer_for_poses
from handeye.cli.solve_rig import answer_for_rig
from handeye.cli.source import Source, mindful_of
from handeye.cli.work import WorkOptions, height_of, touch_lines
from handeye.datasets import PosePairs
from handeye.datasets.touches import read_touches
from handeye.estimation import Measurements, make_estimator
from handeye.estimation import solve as solve_recording
from handeye.estimation.certificate import Certificate, certify_calibration
from handeye.estimation.confidence import Ellipsoid, position_region, within
from handeye.estimation.faults import examine
from handeye.importing import Opened, is_rig
from handeye.robots import ArmKinematics
from handeye.types.calibration import Calibration, JointOffset, ModelName, RobotSide

if TYPE_CHECKING:
    from rich.console import Console


def solve(
    folder: Path,
    /,
    *,
    model: ModelName = ModelName.AUTO,
    reduced: bool = False,
    camera_fixed: bool = False,
    certify: bool = False,
    touches: Path | None = None,
    height_mm: tuple[float, float] | None = None,
    output: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    work: WorkOptions = WorkOptions(),  # noqa: B008 - frozen
    page: Page = Page(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Calibrate from a folder of views.

    The folder is a recording (docs: conventions), or images and the robot's poses in a file of any kind or in
    a layout that is known (docs: import); then the target is found in the images first and, if the files hold
    no camera, the camera is calibrated from the same images. Where nothing says how the poses are written,
    the images tell. Nothing in the folder is changed.

    Parameters
    ----------
    folder
        Folder with the views or with a folder for each camera, or a file of samples of easy_handeye2 or
        MoveIt.
    model
        auto: the data say how noisy robot and camera are. paper: robot and camera are taken as exact.
    reduced
        Answer even where the views leave directions open, such as for an arm with four axes.
    camera_fixed
        Hold the camera as it is given. Else its parameters are found again within what is known of them.
    certify
        Bound from below how well any other answer could fit the poses, and say whether this is the best.
    touches
        Points that were touched, as measurements beside the pictures: the file of `handeye verify`.
    height_mm
        Height of the middle of the target in the frame that it is fixed to (base, or flange with the camera
        beside the robot), and how well it is known: for an arm that turns about one axis only, such as SCARA
        and gantry, which cannot tell it.
    output
        Also write the JSON object to this file.
    """
    check_output(output)
    if source.only is None and is_rig(folder):
        if touches is not None or height_mm is not None:
            raise UsageError("--touches and --height-mm take one camera", hint="leave them out for several")
        rig = source.open_rig(folder)
        views = [station.views[0].view for station in rig.recording.stations]
        return answer_for_rig(
            rig,
            model,
            output,
            reduced=reduced,
            kinematics=arm.kinematics(views, model),
            camera_fixed=camera_fixed,
            certify=certify,
            page=page,
            arm=arm,
        )
    opened = source.open_any(folder, arm.described())
    if isinstance(opened, PosePairs):
        return answer_for_poses(opened, output)
    with mindful_of(opened.warnings):
        kinematics = arm.kinematics(opened.recording.views, model)
        calibration = solve_recording(
            opened.recording,
            model,
            reduced=reduced,
            kinematics=kinematics,
            camera_fixed=camera_fixed,
            work=work.work(),
            probing=None if touches is None else read_touches(touches),
            height=height_of(height_mm, model),
        )
    region = position_region(calibration)
    data = _data(opened, calibration, region)
    certificate = certify_calibration(opened.recording, calibration) if certify else None
    if certificate is not None:
        data["certificate"] = certificate.to_dict()
    if output is not None:
        write_json(output, data)
    after = None if not page.ui else partial(_page, page, opened, model, kinematics, arm.robot)
    return Answer(
        data, lambda console: _show(console, opened, calibration, region, certificate, output), after
    )


def _page(
    page: Page, opened: Opened, model: ModelName, kinematics: ArmKinematics | None, description: str | None
) -> None:
    measurements = examine(
        Measurements.of_recording(opened.recording), by_joints=kinematics is not None
    ).measurements
    estimate = make_estimator(model, kinematics)(measurements)
    known = None if kinematics is None else kinematics.arm
    serve(show_views(page, opened, measurements, estimate, arm=known, description=description))


def _data(opened: Opened, calibration: Calibration, region: Ellipsoid) -> dict[str, Any]:
    data = calibration.to_dict()
    data["views"]["rejected"] += [{"name": name, "reason": why} for name, why in opened.missed.items()]
    data["warnings"] = [str(warning) for warning in opened.warnings] + data["warnings"]
    return {
        "recording": opened.recording.name,
        "layout": opened.layout,
        "source": opened.recording.source,
        "within_95": within(calibration.covariance, calibration.degrees_of_freedom).to_dict(),
        **data,
        "camera_origin": opened.camera_origin.value,
        **({} if opened.timing is None else {"timing": opened.timing.to_dict()}),
        "position_region": region.to_dict(),
    }


def _show(
    console: "Console",
    opened: Opened,
    calibration: Calibration,
    region: Ellipsoid,
    certificate: Certificate | None,
    output: Path | None,
) -> None:
    from handeye.cli.wording import (  # noqa: PLC0415 - a program reading JSON need not wait for it
        MOUNTINGS,
        both,
        camera_line,
        deviations_in,
        figures,
        heading,
        notices,
        open_directions,
        pairs,
        pose_lines,
    )

    used = [view for view in calibration.views if view.used]
    left_out = {view.name: view.reason for view in calibration.views if not view.used} | dict(opened.missed)
    heading(
        console,
        opened.recording.name,
        f"{MOUNTINGS[calibration.mounting]}, {len(used)} views used, {len(left_out)} left out, "
        f"model {calibration.model}",
    )
    camera_name, target_name = calibration.mounting.result_names
    frame = camera_name.split("_")[1]
    camera, target = calibration.results[camera_name], calibration.results[target_name]
    console.print()
    heading(console, camera_name, f"the camera in the {frame} frame")
    lines = pose_lines(camera)
    sigmas = " ".join(
        f"{figures(1e3 * float(s), 2):>6}" for s in deviations_in(camera.rotation, calibration.covariance)
    )
    lines.insert(1, ("  one sigma", f"{sigmas}  mm, along the axes of the {frame}"))
    pairs(console, lines, indent=2)
    console.print()
    heading(console, target_name, f"the target in the {target_name.split('_')[1]} frame")
    pairs(console, pose_lines(target), indent=2)
    console.print()
    axes = " x ".join(figures(1e3 * float(length), 2) for length in region.semi_axes_m)
    worst = max(used, key=lambda view: view.rmse_px)
    known = within(calibration.covariance, calibration.degrees_of_freedom)
    stated = f"within {figures(known.translation_mm)} mm and {figures(known.rotation_deg)} deg"
    accuracy = both(calibration.sigma_translation_m, calibration.sigma_rotation_rad)
    residuals = f"{figures(calibration.rmse_px)} px RMS, worst view {worst.name}: {figures(worst.rmse_px)} px"
    pairs(
        console,
        [
            ("accuracy", f"{stated} with 95 % probability (centre of the camera, rotation)"),
            ("standard deviation", f"{accuracy} of position and rotation"),
            ("95 % ellipsoid", f"of the position, semi-axes {axes} mm"),
            *(() if calibration.touch is None else touch_lines(calibration.touch)),
            ("residuals", residuals),
            ("noise", _noise(calibration)),
            *((f"joint {offset.joint}", _offset(offset)) for offset in calibration.joint_offsets),
            ("camera", camera_line(opened)),
            *([] if opened.timing is None else [("timing", str(opened.timing))]),
            *([] if certificate is None else [("certificate", certificate.sentence)]),
        ],
    )
    notices(console, "Left out", (f"{name}: {why}" for name, why in left_out.items()))
    open_directions(console, calibration.unobservable)
    notices(console, "Diagnosis", (finding.sentence for finding in calibration.diagnosis), "cyan")
    notices(console, "Warnings", [*map(str, opened.warnings), *calibration.warnings])
    if output is not None:
        console.print(f"written: {output}")


def _offset(offset: JointOffset) -> str:
    values = offset.to_dict()
    unit = "mm" if offset.sliding else "deg"
    value, sigma = values[f"offset_{unit}"], values[f"sigma_{unit}"]
    return f"{value:+.4f} {unit} beyond where it is read, standard deviation {sigma:.4f}"


def _noise(calibration: Calibration) -> str:
    from handeye.cli.wording import both, figures  # noqa: PLC0415

    noise = calibration.noise
    pixel = f"{figures(noise.to_dict()['pixel_sigma_px'], 2)} px in the images"
    if noise.robot_side is RobotSide.NONE:
        return f"{pixel}; robot poses taken as exact"
    share = noise.evidence.get(noise.robot_side.value)
    certainty = "" if share is None else f" ({share:.0%} of its misfit)"
    robot = both(noise.robot_translation_m, noise.robot_rotation_rad)
    if noise.robot_side is RobotSide.JOINTS:
        joints = f"from {figures(float(np.rad2deg(noise.joint_rad)), 2)} deg in every joint"
        return f"{pixel}; robot {robot} per axis at the flange, {joints}{certainty}"
    if noise.robot_side is RobotSide.LINKS:
        put_right = "beside joints that sit wrongly on their links, put right in the answer"
        return f"{pixel}; robot {robot} per axis at the flange, {put_right}{certainty}"
    side = f"mostly from the side of the {noise.robot_side}"
    return f"{pixel}; robot {robot} per axis at the flange, {side}{certainty}"
