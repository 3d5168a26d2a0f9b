"""Everything that a report shows, from a recording that is solved or from the result of an earlier solve."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.datasets.reading import located
from handeye.errors import InputError
from handeye.estimation import Measurements, calibrate_examined
from handeye.estimation.estimate import corrected
from handeye.estimation.faults import examine
from handeye.estimation.work import Work
from handeye.export import EXPORTERS, Frames, Mount, Result, checked_text
from handeye.export.result import read_result
from handeye.export.solved import Noise, Solved
from handeye.importing import Opened
from handeye.report import document
from handeye.report.advice import advice
from handeye.report.document import Answer, NoiseLevels, Open, Report, Said, ViewLine, Within
from handeye.report.drawings import Drawing, drawings_of
from handeye.report.history import arm_of, attempts, curve, doubt, request
from handeye.report.recipe import recipe
from handeye.report.regions import USUAL_DISTANCES_M, at_points, position_axes, rotation_axes, within
from handeye.report.views import ViewPicture, view_lines, view_picture
from handeye.types import Camera, Mounting, Pose, Recording, Target
from handeye.types.calibration import Calibration, ModelName
from handeye.types.units import MM_PER_M

# Formats that a report shows, ready to be copied.
SHOWN_EXPORTS = ("ros2", "urdf", "easy_handeye2", "opencv")


@dataclass(frozen=True, eq=False)
class Scene:
    """What stands where.

    Attributes
    ----------
    T_parent_camera, T_fixed_target
        The answer.
    flanges
        Name, `T_base_flange` and whether it was used of every view; empty where they are not known.
    target
        The target, None where it is not known.
    """

    mounting: Mounting
    T_parent_camera: Pose
    T_fixed_target: Pose
    camera: Camera | None
    target: Target | None
    flanges: tuple[tuple[str, Pose, bool], ...] = ()


@dataclass(frozen=True, eq=False)
class Gathered:
    """Numbers, and what the pictures are drawn from; camera pictures only where they were asked for."""

    numbers: Report
    scene: Scene
    pictures: tuple[ViewPicture, ...] = ()
    drawings: tuple[Drawing, ...] | None = None


def gather_recording(
    opened: Opened,
    model: ModelName,
    *,
    command: str,
    reduced: bool = False,
    made: str | None = None,
    is_drawn: bool = False,
    work: Work | None = None,
) -> Gathered:
    """Solve a recording and gather what there is to say.

    Parameters
    ----------
    opened
        Where the views come from; a session among them is reported with its request and its failed attempts,
        unless its settings or its journal were changed: then a warning says so.
    model, reduced
        As for `handeye.estimation.solve`.
    command
        The command line that makes this report.
    made
        Time to write into it, ISO 8601; None for none.
    is_drawn
        Whether the camera's pictures are to be shown with what was found in them.
    work
        What is touched; None for a usual tool where the board was seen.

    Raises
    ------
    InputError, DegenerateError, SolveError
        As `handeye.estimation.solve`.
    """
    recording = opened.recording
    measurements = Measurements.of_recording(recording)
    doubtful = doubt(opened.folder)
    kinematics = None if doubtful else arm_of(opened.folder, recording, model)
    examination = examine(measurements, by_joints=kinematics is not None)
    calibration = calibrate_examined(
        examination, model, reduced=reduced, kinematics=kinematics, work=work or Work()
    )
    measurements = examination.among(measurements)
    warnings = [str(warning) for warning in opened.warnings] + ([doubtful] if doubtful else [])
    known = within(calibration.covariance, calibration.degrees_of_freedom)
    lines = view_lines(calibration, measurements)
    distances = _working_distances(line.distance_mm for line in lines if line.used)
    used = [i for i, view in enumerate(measurements.views) if view.name in set(calibration.used)]
    numbers = _report(
        Result.of(
            calibration,
            recording.name,
            warnings,
            camera_origin=opened.camera_origin.value,
            source=recording.source,
        ),
        distances,
        warnings=[*warnings, *calibration.warnings],
        target=recording.target.to_dict(),
        views=[*lines, *_left_out(calibration, opened, {line.name for line in lines})],
        curve=curve(measurements.select(used), model, kinematics),
        attempts=[] if doubtful else attempts(opened.folder),
        request=None if doubtful else request(opened.folder, known),
        true_error=_true_error(calibration, recording),
        recipe=recipe(command, recording, made),
    )
    flags = {line.name: line.used for line in lines}
    T_parent_camera, T_fixed_target = calibration.results.values()
    scene = Scene(
        calibration.mounting,
        T_parent_camera,
        T_fixed_target,
        calibration.camera,
        recording.target,
        tuple((view.name, view.T_base_flange, flags.get(view.name, False)) for view in recording.views),
    )
    put_right = corrected(measurements, kinematics, calibration.arm_correction)
    pictures = tuple(view_picture(calibration, put_right, view) for view in put_right.views)
    return Gathered(numbers, scene, pictures, drawings_of(opened) if is_drawn else None)


def gather_result(path: Path, *, command: str, made: str | None = None) -> Gathered:
    """Gather what the JSON of an earlier solve says; it has neither poses of the robot nor points.

    Raises
    ------
    InputError
        Not such a file.
    """
    result = read_result(path)
    with located(str(path)):
        solved, _, _ = _told(result)
        views = [
            ViewLine(name=name, used=True, reason="", rmse_px=solved.views.rmse_px.get(name))
            for name in solved.views.used
        ]
        views += [ViewLine(name=view.name, used=False, reason=view.reason) for view in solved.views.rejected]
        sentences = {direction.sentence for direction in solved.unobservable}
        numbers = _report(
            result,
            [(distance, "") for distance in USUAL_DISTANCES_M],
            warnings=[warning for warning in result.warnings if warning not in sentences],
            views=views,
            recipe=recipe(command, None, made),
        )
    return Gathered(
        numbers,
        Scene(result.mounting, result.T_parent_camera, result.T_fixed_target, result.camera, None),
    )


def _told(result: Result) -> tuple[Solved, Noise, float]:
    """Return all that the solve said, its noise and its residual."""
    solved = result.solved
    if solved is None or solved.noise is None or solved.rmse_px is None or not solved.model:
        raise InputError(
            "rmse_px, noise or model is missing, expected all that a solve writes",
            code=Code.INVALID_FIELD,
            hint="give the JSON object as `handeye solve --json` wrote it",
        )
    return solved, solved.noise, solved.rmse_px


def _report(
    result: Result,
    distances: list[tuple[float, str]],
    **parts: Any,  # noqa: ANN401 - fields
) -> Report:
    solved, noise, rmse_px = _told(result)
    mount = Mount(result, Frames.usual(result.mounting))
    optional: dict[str, Any] = {
        "target": None,
        "curve": [],
        "attempts": [],
        "request": None,
        "true_error": None,
    }
    return Report(
        format=document.FORMAT,
        version=document.VERSION,
        recording=result.recording,
        source=solved.source,
        mounting=result.mounting.value,
        model=solved.model,
        camera=None if result.camera is None else result.camera.to_dict(),
        camera_origin=solved.camera_origin,
        answer=_answer(result, distances),
        noise=NoiseLevels(
            pixel_sigma_px=noise.pixel_sigma_px,
            robot_side=noise.robot_side,
            robot_translation_mm=noise.robot_translation_mm,
            robot_rotation_deg=noise.robot_rotation_deg,
            how=noise.how,
            evidence=noise.evidence,
        ),
        touch=solved.touch,
        start=solved.start,
        ending=solved.ending,
        rmse_px=rmse_px,
        diagnosis=[
            Said(code=f.code, sentence=f.sentence, advice=advice(f.code), evidence=f.evidence)
            for f in solved.diagnosis
        ],
        unobservable=[
            Open(sentence=sentence, cure=cure)
            for sentence, cure in dict.fromkeys((d.sentence, d.cure) for d in solved.unobservable)
        ],
        exports={name: checked_text(EXPORTERS[name], mount) for name in SHOWN_EXPORTS},
        **(optional | parts),
    )


def _answer(result: Result, distances: list[tuple[float, str]]) -> Answer:
    in_hand = result.mounting is Mounting.EYE_IN_HAND
    parent = "flange" if in_hand else "base"
    pose, covariance = result.T_parent_camera, result.covariance
    freedom = result.degrees_of_freedom
    spread = pose.rotation @ covariance[:3, :3] @ pose.rotation.T
    return Answer(
        parent=parent,
        T_parent_camera=pose.to_list(),
        position_mm=(MM_PER_M * pose.translation).tolist(),
        sigma_along_parent_axes_mm=(MM_PER_M * np.sqrt(np.diag(spread))).tolist(),
        quaternion_xyzw=pose.quaternion_xyzw.tolist(),
        roll_pitch_yaw_deg=np.rad2deg(pose.roll_pitch_yaw_rad).tolist(),
        target_parent="base" if in_hand else "flange",
        T_fixed_target=result.T_fixed_target.to_list(),
        sigma_translation_mm=MM_PER_M * result.sigma_translation_m,
        sigma_rotation_deg=float(np.rad2deg(result.sigma_rotation_rad)),
        within_95=within(covariance, freedom),
        position_axes=position_axes(covariance, freedom, pose.rotation, parent),
        rotation_axes=rotation_axes(covariance, freedom, pose.rotation, parent),
        points=at_points(covariance, freedom, distances),
        covariance=covariance.tolist(),
        degrees_of_freedom=None if np.isinf(freedom) else freedom,
    )


def _working_distances(distances_mm: Iterable[float | None]) -> list[tuple[float, str]]:
    """Return the distances at which views were taken, with words; the usual ones if there are none."""
    known = [distance / MM_PER_M for distance in distances_mm if distance is not None]
    if not known:
        return [(distance, "") for distance in USUAL_DISTANCES_M]
    return [
        (min(known), "nearest view"),
        (float(np.median(known)), "median of the views"),
        (max(known), "farthest view"),
    ]


def _left_out(calibration: Calibration, opened: Opened, known: set[str]) -> list[ViewLine]:
    """Return a line for every view and image that could not even be measured."""
    reasons = {view.name: view.reason for view in calibration.views if not view.used} | dict(opened.missed)
    return [
        ViewLine(name=name, used=False, reason=reason)
        for name, reason in reasons.items()
        if name not in known
    ]


def _true_error(calibration: Calibration, recording: Recording) -> Within | None:
    """Return how far off the answer truly is, where a simulation knows."""
    if recording.truth is None or recording.truth.X is None:
        return None
    off = (calibration.X @ recording.truth.X.inverse()).log()
    return Within(
        translation_mm=MM_PER_M * float(np.linalg.norm(off[:3])),
        rotation_deg=float(np.rad2deg(np.linalg.norm(off[3:]))),
    )
