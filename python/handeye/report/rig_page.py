"""The page about several cameras: each of them, each in the others, every target, and what was left out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from handeye.estimation import RigCalibration, solve_rig
from handeye.estimation.rig import Relative
from handeye.importing import OpenedRig
from handeye.report.page import rendered
from handeye.report.wording import figures, fixed
from handeye.types import Pose
from handeye.types.kinematics import Kinematics
from handeye.types.units import MM_PER_M
from handeye.validation import metrics

_FRAME = "the optical frame: x right, y down, z forward"
_BETWEEN = "of one body: the arm does not move them against each other"


@dataclass(frozen=True, eq=False)
class RigReport:
    """The calibration of several cameras, and what a page about it says besides."""

    opened: OpenedRig
    calibration: RigCalibration
    command: str
    made: str

    @classmethod
    def of(
        cls,
        opened: OpenedRig,
        *,
        command: str,
        made: str,
        reduced: bool = False,
        kinematics: Kinematics | None = None,
    ) -> "RigReport":
        """Solve a recording.

        Raises
        ------
        InputError, DegenerateError, SolveError
            As for `handeye.estimation.solve_rig`.
        """
        calibration = solve_rig(opened.recording, reduced=reduced, kinematics=kinematics)
        return cls(opened, calibration, command, made)

    @property
    def warnings(self) -> list[str]:
        """Everything that is to be minded."""
        return [*map(str, self.opened.warnings), *self.calibration.warnings]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: those of a solve, and the error where the truth is known."""
        recording = self.opened.recording
        return {
            "recording": recording.name,
            "stations": len(recording),
            **self.calibration.to_dict(),
            "true_error": self.true_errors() or None,
            "warnings": self.warnings,
        }

    def true_errors(self) -> dict[str, dict[str, float]]:
        """Return how far off cameras, and cameras in each other, truly are, where a simulation knows."""
        truth = self.opened.recording.truth
        if truth is None:
            return {}
        true = truth.cameras
        found = {name: (one.X, true[name]) for name, one in self.calibration.cameras.items() if name in true}
        found |= {
            f"T_{a}_{b}": (one.pose, true[a] @ true[b].inverse())
            for (a, b), one in self.calibration.camera_to_camera.items()
            if a in true and b in true
        }
        errors = {name: metrics.absolute_error(*poses) for name, poses in found.items()}
        return {
            name: {"translation_mm": error.translation_mm, "rotation_deg": error.rotation_deg}
            for name, error in errors.items()
        }

    def html(self) -> str:
        """Return the page; all text in it is escaped."""
        calibration, recording = self.calibration, self.opened.recording
        errors = self.true_errors()
        radii = {name: calibration.estimate.of_camera(name).within_95 for name in calibration.cameras}
        worst = max(radii, key=lambda name: radii[name].translation_mm)
        mm, deg = radii[worst].translation_mm, max(one.rotation_deg for one in radii.values())
        cameras = [
            {
                **_pose(f"{name}: {one.mounting.result_names[0]}", next(iter(one.results.values()))),
                "mm": radii[name].translation_mm,
                "deg": radii[name].rotation_deg,
                "stations": len({view.name for view in one.views if view.used}),
                "rmse_px": one.rmse_px,
                "off": _off(errors.get(name)),
            }
            for name, one in calibration.cameras.items()
        ]
        between = [
            _relative(f"T_{a}_{b}", one, _off(errors.get(f"T_{a}_{b}")))
            for (a, b), one in calibration.camera_to_camera.items()
        ]
        targets = [
            _relative(f"{name}: T_{calibration.target_bodies[name].value}_target", one, "")
            for name, one in calibration.targets.items()
        ]
        tables = [
            _table("Cameras", _FRAME, cameras, truth=bool(errors), residuals=True),
            _table("Cameras in each other", _BETWEEN, between, truth=bool(errors)),
            _table("Targets", "as they are fixed", targets),
        ]
        left_out = [
            (f"{name}, {view.name}", view.reason)
            for name, one in calibration.cameras.items()
            for view in one.views
            if not view.used
        ]
        left_out += [
            (f"{name}, {view}", why)
            for name, missed in self.opened.missed.items()
            for view, why in missed.items()
        ]
        return rendered(
            "rig.html",
            {
                "fig": figures,
                "title": f"Hand-eye calibration: {recording.name}",
                "subtitle": f"{len(cameras)} cameras, {len(targets)} targets, {len(recording)} stations",
                "verdict": f"With 95 % probability every camera lies within {figures(mm, 2)} mm and "
                f"{figures(deg, 2)} deg; the worst is {worst}.",
                "warnings": self.warnings,
                "tables": [table for table in tables if table["rows"]],
                "diagnosis": [finding.sentence for finding in calibration.diagnosis],
                "left_out": left_out,
                "command": self.command,
                "made": self.made,
            },
        )


def _table(
    title: str, caption: str, rows: Sequence[dict[str, Any]], *, truth: bool = False, residuals: bool = False
) -> dict[str, Any]:
    return {"title": title, "caption": caption, "rows": rows, "truth": truth, "residuals": residuals}


def _pose(name: str, pose: Pose) -> dict[str, Any]:
    return {
        "name": name,
        "position": "  ".join(fixed(MM_PER_M * float(v), 3) for v in pose.translation),
        "quaternion": "  ".join(fixed(float(v), 6) for v in pose.quaternion_xyzw),
    }


def _relative(name: str, one: Relative, off: str) -> dict[str, Any]:
    radii = one.within_95
    return {
        **_pose(name, one.pose),
        "mm": radii.translation_mm,
        "deg": radii.rotation_deg,
        "stations": one.shared,
        "off": off,
    }


def _off(error: dict[str, float] | None) -> str:
    if error is None:
        return ""
    return f"{figures(error['translation_mm'], 2)} mm, {figures(error['rotation_deg'], 2)} deg"
