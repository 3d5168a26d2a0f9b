"""The page: one file, nothing to load, nothing to run."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from handeye.export import EXPORTERS
from handeye.report.curve_picture import curve_picture
from handeye.report.document import Report
from handeye.report.gathering import Gathered
from handeye.report.residual_pictures import Tiles, residual_tiles, scale_bar
from handeye.report.scene_picture import cell_picture, mount_picture, views_picture
from handeye.report.touch_picture import touch_picture
from handeye.report.wording import figures, fixed
from handeye.types import Pose, Target

_TEMPLATES = Path(__file__).parent / "templates"
_MOUNTINGS = {"eye_in_hand": "camera in the hand", "eye_to_hand": "camera beside the robot"}
_SIDES = {
    "none": "nowhere: its poses are exact",
    "flange": "at the flange",
    "base": "at the base",
    "joints": "in the joints",
    "links": "in where the joints sit on their links",
}
_SUSPECTS = {
    "robot_flange": "error of the robot, at the flange",
    "robot_base": "error of the robot, at the base",
    "posture_flange": "error of the robot, alike in like postures, at the flange",
    "posture_base": "error of the robot, alike in like postures, at the base",
    "joint_noise": "noise of the joints",
    "joint_offsets": "offsets of the joints",
    "links": "joints that sit wrongly on their links",
    "time_lag": "lag between pictures and poses",
    "camera": "error of the camera's calibration",
    "board_scale": "error of the size of the board",
}
_LIMITS = {
    "camera": "the camera's parameters",
    "hand_eye": "the hand-eye",
    "arm": "constants of the arm",
    "board": "the size of the board",
    "robot_noise": "what the arm errs by each time",
}
_ORIGINS = {"given": "as given", "files": "from the files", "calibrated": "calibrated from these images"}
# Beyond this the page would be too long to read; the worst are shown.
MOST_TILES = 40


def html_page(gathered: Gathered) -> str:
    """Return the page.

    All text is escaped but the style and the pictures, which are ours and escape their words themselves.
    """
    return rendered("report.html", _context(gathered))


def rendered(template: str, context: dict[str, Any]) -> str:
    """Return a page of ours; the style is put in, and all else is escaped."""
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = (_TEMPLATES / "style.css").read_text(encoding="utf-8")
    return environment.get_template(template).render(context | {"style": style})


def _context(gathered: Gathered) -> dict[str, Any]:
    r, scene = gathered.numbers, gathered.scene
    in_hand = r.mounting == "eye_in_hand"
    tiles, tiles_note = _tiles(gathered)
    target = Pose(r.answer.T_fixed_target)
    return {
        "r": r,
        "a": r.answer,
        "fig": figures,
        "fixed": fixed,
        "cell_of": _cell,
        "title": f"Hand-eye calibration: {r.recording}" if r.recording else "Hand-eye calibration",
        "subtitle": _subtitle(r),
        "verdict": _verdict(r),
        "name": "T_flange_camera" if in_hand else "T_base_camera",
        "target_name": "T_base_target" if in_hand else "T_flange_target",
        "target_position": "  ".join(f"{fixed(1000 * v, 2)}" for v in target.translation) + " mm",
        "target_quaternion": "  ".join(fixed(float(v), 6) for v in target.quaternion_xyzw),
        "mount": mount_picture(scene, r.answer),
        "touch_picture": "" if r.touch is None else touch_picture(r.touch),
        "touch_advice": "" if r.touch is None or not r.touch.advice else _sentence(r.touch.advice),
        "limits": [] if r.touch is None else _limits(r.touch.limits),
        "cell": cell_picture(scene),
        "views_picture": views_picture(scene) if scene.flanges else "",
        "cell_caption": _cell_caption(gathered),
        "some_left_out": any(not view.used for view in r.views),
        "views_sentence": _views_sentence(r),
        "target_sentence": _target_sentence(r),
        "camera_sentence": _camera_sentence(r),
        "model_sentence": _model_sentence(r),
        "robot_sentence": _robot_sentence(r),
        "poses_used": _poses_used(r),
        "evidence": [(_SIDES.get(side, side), share) for side, share in r.noise.evidence.items()],
        "suspects": _suspects(r),
        "curves": _curves(r),
        "curve_note": "Fewer views did not determine the answer." if r.curve and r.curve[0].views > 3 else "",
        "tiles": tiles.tiles,
        "tiles_note": tiles_note,
        "scale": tiles.scale,
        "scale_bar": scale_bar(),
        "drawings": gathered.drawings,
        "matrix": "\n".join("  ".join(f"{v: .9f}" for v in row) for row in r.answer.T_parent_camera),
        "exports": [(EXPORTERS[name].title, text) for name, text in r.exports.items()],
    }


def _cell(value: float | None, unit: str) -> str:
    return "" if value is None else f"{figures(value, 2)} {unit}"


def _subtitle(r: Report) -> str:
    used = sum(view.used for view in r.views)
    parts = [_MOUNTINGS[r.mounting], f"{used} of {len(r.views)} views used", f"model {r.model}"]
    if r.recipe.made:
        parts.append(r.recipe.made)
    return " · ".join(parts)


def _verdict(r: Report) -> str:
    known = r.answer.within_95
    where = f"in the frame of the {r.answer.parent}"
    if r.unobservable:
        return (
            f"These views do not determine the answer. What they say {where} rests on a weak prior in the "
            "directions named below."
        )
    return (
        f"With 95 % probability the position of the camera {where} is known to within "
        f"{figures(known.translation_mm, 2)} mm, and its rotation to within "
        f"{figures(known.rotation_deg, 2)} deg."
    )


def _cell_caption(gathered: Gathered) -> str:
    scene, r = gathered.scene, gathered.numbers
    if not scene.flanges:
        return "The base and what the result says; the robot's poses are not in it."
    if r.mounting == "eye_in_hand":
        text = "Above: base, flange and camera at every view, and the target"
    else:
        text = "Above: base, camera, and flange and target at every view"
    left_out = "" if all(used for _, _, used in scene.flanges) else " Orange: left out."
    return f"{text}. Below: the same closer by, with the numbers of the views. Dashed: their order.{left_out}"


def _views_sentence(r: Report) -> str:
    used = sum(view.used for view in r.views)
    points = sum(view.points or 0 for view in r.views if view.used)
    seen = f" with {points} points" if points else ""
    missing = len(r.views) - used
    return f"{used} used{seen}, {missing} left out" if missing else f"{used} used{seen}"


def _target_sentence(r: Report) -> str:
    if r.target is None:
        return ""
    target = Target.from_dict(r.target)
    measures = ", ".join(
        f"{key} {value}" for key, value in r.target.items() if key != "family" and value is not False
    )
    return f"{target.family.replace('_', ' ')} of {target.point_count} points ({measures})"


def _camera_sentence(r: Report) -> str:
    if r.camera is None:
        return ""
    fx, fy, cx, cy = r.camera["parameters"][:4]
    origin = _ORIGINS.get(r.camera_origin or "", "")
    size = f"{r.camera['width_px']} x {r.camera['height_px']} px"
    return (
        f"{r.camera['lens']}, {size}, f {fx:.1f} and {fy:.1f} px, centre {cx:.1f} and {cy:.1f} px"
        f"{', ' + origin if origin else ''}"
    )


def _model_sentence(r: Report) -> str:
    if r.model == "paper":
        return "paper: robot and camera taken as exact, so the stated accuracy is too good where they are not"
    return "auto: errors of robot, camera and board are found together, by what the views say"


def _poses_used(r: Report) -> str:
    if "links" in r.noise.evidence:
        return "as reported, put right by what was found of the arm's joints and links"
    return "as reported"


def _robot_sentence(r: Report) -> str:
    if r.noise.robot_side == "none":
        return "its poses are taken as exact" if r.model == "paper" else "none that the views would show"
    return (
        f"{figures(r.noise.robot_translation_mm, 2)} mm and {figures(r.noise.robot_rotation_deg, 2)} deg per "
        f"axis, {_SIDES.get(r.noise.robot_side, r.noise.robot_side)}"
    )


def _sentence(words: str) -> str:
    return f"{words[0].upper()}{words[1:]}."


def _limits(limits: dict[str, float]) -> list[tuple[str, float]]:
    return [
        (_LIMITS.get(name, name), share) for name, share in sorted(limits.items(), key=lambda one: -one[1])
    ]


def _suspects(r: Report) -> list[tuple[str, str]]:
    found: list[tuple[str, float]] = []
    for said in r.diagnosis:
        for code, value in said.evidence.items():
            if code in _SUSPECTS and isinstance(value, int | float):
                found.append((_SUSPECTS[code], float(value)))
    return [
        (name, "over 1000" if value > 1000 else fixed(value, 1))
        for name, value in sorted(found, key=lambda pair: -pair[1])
    ]


def _curves(r: Report) -> list[str]:
    if len(r.curve) < 2:
        return []
    views = [point.views for point in r.curve]
    measures: tuple[tuple[Callable[[Any], float], str, str], ...] = (
        (lambda within: within.translation_mm, "mm", "position of the camera"),
        (lambda within: within.rotation_deg, "deg", "rotation of the camera"),
    )
    return [
        curve_picture(
            views,
            [measure(point.within_95) for point in r.curve],
            unit,
            title,
            None if r.request is None else measure(r.request),
        )
        for measure, unit, title in measures
    ]


def _tiles(gathered: Gathered) -> tuple[Tiles, str]:
    left_out = frozenset(view.name for view in gathered.numbers.views if not view.used)
    pictures = gathered.pictures
    note = ""
    if len(pictures) > MOST_TILES:
        worst = sorted(pictures, key=lambda picture: -picture.rmse_px)[:MOST_TILES]
        note = f"Only the {MOST_TILES} views with the largest residuals are shown of {len(pictures)}."
        pictures = tuple(picture for picture in pictures if picture in worst)
    return residual_tiles(pictures, left_out), note
