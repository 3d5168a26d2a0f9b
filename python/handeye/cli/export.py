"""`handeye export`: the answer in the formats of others."""

import sys
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output
from handeye.cli.solve_poses import ONLY_POSES
from handeye.cli.source import Source
from handeye.codes import Code
from handeye.datasets import PosePairs
from handeye.datasets.writing import replace_file
from handeye.errors import InputError
from handeye.estimation import solve, solve_rig
from handeye.export import EXPORTERS, Frames, Mount, Result, checked_text, moveit_samples, read_result
from handeye.importing import OpenedRig, PosesSolved, is_rig, solve_poses
from handeye.types import Pose
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from rich.console import Console


class Format(StrEnum):
    """Names of the formats; `EXPORTERS` has those of the transform."""

    ROS2 = "ros2"
    URDF = "urdf"
    ROS1 = "ros1"
    MOVEIT2 = "moveit2"
    MOVEIT = "moveit"
    EASY_HANDEYE2 = "easy_handeye2"
    OPENCV = "opencv"
    JSON = "json"
    MOVEIT_SAMPLES = "moveit_samples"


@Parameter(name="*", group="Names of the frames")
@dataclass(frozen=True)
class Names:
    """What the frames are called in the robot's software."""

    parent_frame: str | None = None
    """Frame that the camera is fixed to; tool0 for a camera in the hand, else base."""
    child_frame: str | None = None
    """Optical frame of the camera; camera_optical_frame if not given."""
    camera_link: str | None = None
    """Link of the camera below which its driver publishes the optical frame; then that link is exported."""
    robot_frame: str | None = None
    """The other end of the robot, for formats that name it; base for a camera in the hand, else tool0."""
    target_frame: str | None = None
    """The target, for formats that name it; calibration_target if not given."""
    link_optical: tuple[float, float, float, float, float, float, float] | None = None
    """Pose of the optical frame in the camera link, as the driver has it: x y z (metres) qx qy qz qw. Without
    it the link has the same origin and axes by ROS REP 103."""

    def frames(self, usual: Frames) -> Frames:
        """Return the frames with these names.

        Raises
        ------
        UsageError
            A pose in a link that is not named.
        InputError
            A name or pose that cannot be used.
        """
        if self.link_optical is not None and self.camera_link is None:
            raise UsageError("--link-optical says where --camera-link is", hint="give --camera-link too")
        link_optical = self.link_optical
        pose = None if link_optical is None else Pose.from_quaternion(link_optical[:3], link_optical[3:])
        return Frames(
            parent=self.parent_frame or usual.parent,
            camera=self.child_frame or usual.camera,
            robot=self.robot_frame or usual.robot,
            target=self.target_frame or usual.target,
            link=self.camera_link,
            T_link_camera=pose,
        )


def export(
    result: Path,
    /,
    *,
    format: Format,  # noqa: A002 - the name of the option
    output: Path | None = None,
    model: ModelName | None = None,
    reduced: bool = False,
    names: Names = Names(),
    source: Source = Source(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Write the answer in the format of another program.

    Transforms have their frames and units beside them; angles are checked against the rotation, and the
    quaternion is always there.

    Parameters
    ----------
    result
        JSON that solve wrote or printed, or a folder with views, which is solved first.
    format
        ros2: command for static_transform_publisher. urdf: fixed joint. ros1: line for a launch file.
        moveit2, moveit: launch file as MoveIt Calibration writes it, ROS 2 and ROS 1. easy_handeye2: .calib
        file. opencv: FileStorage YAML. json: frames and units spelled out. moveit_samples: poses of robot and
        target of every view, from a folder only.
    output
        Write to this file instead of printing.
    model
        For a folder: auto (the data say how noisy robot and camera are) or paper (both are exact).
    reduced
        For a folder: answer even where the views leave directions open.
    """
    check_output(output)
    is_folder = result.is_dir() or result.suffix.lower() != ".json"
    if format is Format.MOVEIT_SAMPLES:
        if not is_folder:
            raise UsageError(f"{format.value} needs the views", hint="give the folder instead of the result")
        return _answer(format, moveit_samples(source.open(result).recording), output, (), {})
    if is_folder:
        answer = _solved(result, source, model or ModelName.AUTO, reduced=reduced)
    elif replace(source, only=None) != Source() or model is not None or reduced:
        raise UsageError(
            "a result is solved already", hint="leave out the options for folders, or give the folder"
        )
    else:
        answer = read_result(result, source.only)
    mount = Mount(answer, names.frames(Frames.usual(answer.mounting)))
    data = {
        "parent_frame": mount.parent,
        "child_frame": mount.child,
        "T_parent_child": mount.T_parent_child.to_list(),
    }
    return _answer(format, checked_text(EXPORTERS[format], mount), output, mount.warnings, data)


def _of_rig(opened: OpenedRig, only: str | None, *, reduced: bool) -> Result:
    names = list(opened.recording.cameras)
    if only not in names:
        asked = "" if only is None else f"no camera {only[:60]!r}; "
        raise InputError(
            f"{asked}{len(names)} cameras ({', '.join(names)})",
            code=Code.SEVERAL_CAMERAS,
            hint="name one with --only",
        )
    rig = solve_rig(opened.recording, reduced=reduced)
    if rig.targets_of[only] is None:
        raise InputError(
            f"camera {only}: saw no target that the arm moves against it, and formats name one",
            code=Code.NOT_TIED,
            hint="take its pose from the JSON of handeye solve",
        )
    return Result.of(rig.cameras[only], opened.recording.name, [*map(str, opened.warnings), *rig.warnings])


def _solved(folder: Path, source: Source, model: ModelName, *, reduced: bool) -> Result:
    if is_rig(folder):
        return _of_rig(source.open_rig(folder), source.only, reduced=reduced)
    opened = source.open_any(folder)
    if isinstance(opened, PosePairs):
        return _of_poses(solve_poses(opened))
    calibration = solve(opened.recording, model, reduced=reduced)
    return Result.of(calibration, opened.recording.name, map(str, opened.warnings))


def _of_poses(solved: PosesSolved) -> Result:
    camera, target = solved.results.values()
    warnings = (*map(str, solved.pairs.warnings), ONLY_POSES)
    count = len(solved.pairs) - len(solved.left_out)
    return Result(
        solved.pairs.mounting,
        camera,
        target,
        solved.covariance,
        recording=solved.pairs.name,
        view_count=count,
        warnings=warnings,
    )


def _answer(
    format: Format,  # noqa: A002 - as the option
    text: str,
    output: Path | None,
    warnings: tuple[str, ...],
    data: dict[str, Any],
) -> Answer:
    if output is not None:
        replace_file(output, text.encode())
    data = {
        "format": format.value,
        **data,
        "output": None if output is None else str(output),
        "text": text,
        "warnings": list(warnings),
    }
    return Answer(data, lambda console: _show(console, text, output, warnings))


def _show(console: "Console", text: str, output: Path | None, warnings: tuple[str, ...]) -> None:
    if output is not None:
        console.print(f"written: {output}", markup=False, soft_wrap=True)
    else:
        # As it is, so that it can be redirected into a file: no wrapping, no colours.
        console.file.write(text)
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)
