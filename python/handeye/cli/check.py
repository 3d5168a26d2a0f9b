"""`handeye check`: whether camera, board and arm still are where the calibration says."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output, check_picture, write_figure, write_json
from handeye.cli.source import Source, mindful_of
from handeye.codes import Code
from handeye.datasets import PosePair, PosePairs
from handeye.datasets.check_log import LoggedCheck, alike, append_check, read_check_log
from handeye.datasets.images import read_image
from handeye.detection import NotFound, detect
from handeye.errors import ExitCode, InputError, printable
from handeye.estimation import Measurements, make_estimator, require_determined
from handeye.estimation.change import change_of
from handeye.estimation.faults import examine
from handeye.estimation.shift import Check, check_views, plan_check
from handeye.importing import check_poses, plan_pose_check, solve_poses
from handeye.types import Recording, View
from handeye.types.calibration import ModelName
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    from rich.console import Console

PLANNED = 2


def check(
    calibrated: Path,
    views: Path | None = None,
    /,
    *,
    plan: int | None = None,
    at: str | None = None,
    log: Path | None = None,
    picture: Path | None = None,
    output: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Test with a few views whether camera, board and arm still are where the calibration says.

    The exit code is 9 where something has moved. Without views it says which two poses of the calibration
    show a shift best: go there again, take pictures of the board as it lies, and give them.

    Parameters
    ----------
    calibrated
        Folder with the views of the calibration.
    views
        Folder with new views of the same board through the same camera; two are enough if they are the ones
        that were planned. Or one picture, with --at.
    at
        Name of a view of the calibration: the picture was taken with the arm there. For an arm that cannot be
        asked where it stands. One picture shows that something moved, not what.
    plan
        Without views: how many poses to choose, at least two.
    log
        File that the check is added to, one line each; it says since which check something has moved.
    picture
        Draw the log: .png, .svg or .pdf.
    output
        Also write the JSON object to this file.
    """
    check_output(output)
    check_output(log)
    if picture is not None:
        check_picture(picture)
        if log is None:
            raise UsageError("--picture draws the log, and --log is missing")
    if (views is not None and plan is not None) or (plan is not None and plan < PLANNED):
        raise UsageError("--plan chooses at least two poses for a check, and goes without views")
    if at is not None and views is None:
        raise UsageError("--at says where a picture was taken, and no picture is given")
    if views is None and log is not None:
        raise UsageError("--log keeps checks, and no views are given to check with")
    opened = source.open_any(calibrated, arm.described())
    if isinstance(opened, PosePairs):
        answer = _of_poses(opened, views, plan or PLANNED, at, source, log, picture)
    else:
        recording = opened.recording
        kinematics = arm.kinematics(recording.views, ModelName.AUTO)
        known = examine(Measurements.of_recording(recording), by_joints=kinematics is not None).measurements
        estimate = make_estimator(ModelName.AUTO, kinematics)(known)
        require_determined(estimate)
        if views is None:
            joints = None if estimate.arm is None else known.joints
            answer = _planned(
                recording.name, known.views, *plan_check(estimate, known.motions, joints, plan or PLANNED)
            )
        else:
            if at is not None:
                new = (_pictured(views, at, recording),)
            else:
                new = _of_the_same(source.open(views, arm.described()).recording, recording)
            measured = Measurements.of(estimate.mounting, estimate.camera, estimate.target, new)
            answer = _checked(check_views(estimate, measured), new, recording.name, log, picture)
    if output is not None:
        write_json(output, answer.data)
    return answer


def _of_poses(
    calibrated: PosePairs,
    new: Path | None,
    plan: int,
    at: str | None,
    source: Source,
    log: Path | None,
    picture: Path | None,
) -> Answer:
    """Check samples of poses against samples of poses."""
    if at is not None:
        raise UsageError(
            f"--at takes a picture, and {calibrated.name} has poses of the target without pictures"
        )
    with mindful_of(calibrated.warnings):
        solved = solve_poses(calibrated)
    if new is None:
        return _planned(calibrated.name, calibrated.pairs, *plan_pose_check(solved, plan))
    opened = source.open_any(new)
    if not isinstance(opened, PosePairs):
        raise InputError(
            f"{opened.recording.name}: pictures, the calibration has poses of the target without pictures",
            code=Code.NO_POSES,
            hint="give the poses of the target as the calibration's detector finds them, in the same layout",
        )
    return _checked(check_poses(solved, opened), opened.pairs, calibrated.name, log, picture)


def _of_the_same(new: Recording, calibrated: Recording) -> tuple[View, ...]:
    """Return the views of a recording that shows the target of the calibration.

    Raises
    ------
    InputError
        It shows another one.
    """
    if not np.array_equal(new.target.points, calibrated.target.points):
        raise InputError(
            f"{new.name}: {printable(new.target, 120)}, the calibration has "
            f"{printable(calibrated.target, 120)}",
            code=Code.ANOTHER_TARGET,
            hint="take pictures of the same target, and state it alike",
        )
    return new.views


def _pictured(picture: Path, at: str, recording: Recording) -> View:
    """Find the board in one picture, taken where a view of the calibration was.

    Raises
    ------
    InputError
        No such view, or a picture of another size than the camera's.
    DetectionError
        The board is not in it.
    """
    there = next((view for view in recording.views if view.name == at), None)
    if there is None:
        names = ", ".join(view.name for view in recording.views)
        raise InputError(f"no view {at[:100]!r}", code=Code.UNKNOWN_VIEW, hint=f"views are {names[:300]}")
    image = read_image(picture)
    width, height = recording.camera.size_px
    if image.shape != (height, width):
        raise InputError(
            f"{picture}: {image.shape[1]} x {image.shape[0]} px, the camera has {width} x {height}",
            code=Code.WRONG_IMAGE_SIZE,
        )
    found = detect(image, recording.target)
    if isinstance(found, NotFound):
        raise found.error(picture.name)
    return replace(there, name=f"at_{at}", point_ids=found.point_ids, pixels=found.pixels, sigmas_px=None)


def _planned(name: str, known: Sequence[View | PosePair], chosen: list[int], detectable: float) -> Answer:
    data: dict[str, Any] = {
        "recording": name,
        "detectable_mm": MM_PER_M * detectable,
        "poses": [
            {
                "name": known[i].name,
                "T_base_flange": known[i].T_base_flange.to_list(),
                "joints_rad": list(getattr(known[i], "joints_rad", None) or ()) or None,
            }
            for i in chosen
        ],
    }

    def show(console: "Console") -> None:
        names = ", ".join(pose["name"] for pose in data["poses"])
        console.print(
            f"Take pictures again where {names} were taken: a shift of the camera by "
            f"{data['detectable_mm']:.2g} mm would be found every second time.",
            markup=False,
        )

    return Answer(data, show)


def _checked(
    found: Check, new: Sequence[View | PosePair], name: str, log: Path | None, picture: Path | None
) -> Answer:
    data: dict[str, Any] = {"recording": name, **found.to_dict(), "log": None}
    if log is not None:
        now = LoggedCheck(
            datetime.now(UTC).isoformat(timespec="seconds"),
            found.p_value,
            found.moved.value,
            found.sentence,
            found.misfit,
            tuple(tuple(view.T_base_flange.matrix[:3].ravel().tolist()) for view in new),
        )
        earlier = read_check_log(log)
        append_check(log, now)
        checks = [*earlier, now]
        same = alike(checks)
        change = change_of([checks[number].misfit for number in same])
        first = None if change.first is None else same[change.first]
        data["log"] = {
            "file": str(log),
            "checks": len(checks),
            "compared": len(same),
            "moved_since": None if first is None else checks[first].time,
            "moved_since_check": None if first is None else first + 1,
            "p_value": change.p_value,
        }
        if picture is not None:
            from handeye.studies.check_picture import check_figure  # noqa: PLC0415 - rarely wanted

            times = [(one.time, one.p_value) for one in checks]
            write_figure(picture, check_figure(times, first))

    def show(console: "Console") -> None:
        from handeye.cli.wording import heading, notices  # noqa: PLC0415 - JSON need not wait for it

        heading(console, "moved" if found.alarm else "in place", found.sentence)
        if found.alarm:
            notices(
                console,
                "What may have moved",
                (f"{cause.words} (p = {cause.p_value:.2g})" for cause in found.causes[:3]),
            )
        if data["log"] is not None:
            since = data["log"]["moved_since"]
            said = "nothing has moved" if since is None else f"something has moved since {since}"
            console.print(f"{data['log']['checks']} checks in {log}: {said}", markup=False, soft_wrap=True)

    return Answer(data, show, exit_code=ExitCode.MOVED if found.alarm else ExitCode.SUCCESS)
