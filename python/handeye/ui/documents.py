"""What a page is told, as plain values: the scene, the candidates, what is known, the last picture."""

import math
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from handeye import _core
from handeye.cameras.protocol import Grey
from handeye.detection import Detection
from handeye.errors import DegenerateError
from handeye.estimation import Estimate, Measurements
from handeye.estimation.confidence import ellipsoid
from handeye.estimation.work import USUAL_TOOL_M
from handeye.planning.limits import NOTHING, limits
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Reading
from handeye.session.deciding import Considered
from handeye.types import Camera, Mounting, Pose, Target, View
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.calibration import ModelName
from handeye.types.units import MM_PER_M

# How large the longest half axis of an ellipsoid is drawn, as a part of how far apart the views are but at
# least of the other, and an arrow of the usual residual.
DRAWN, LEAST_M, DRAWN_PX = 0.07, 0.8, 30.0
# Cells of the picture in which points are counted.
_COVERAGE = (8, 6)


@dataclass(frozen=True, eq=False)
class Picture:
    """What a camera showed last; `detection` is None where the target was not found."""

    number: int
    label: str
    image: Grey | None
    detection: Detection | None
    T_base_flange: Pose | None


@dataclass(frozen=True, eq=False)
class Shown:
    """Everything that a page shows, as values that do not change.

    Parameters
    ----------
    standing, goal
        Where the arm is, and where it should go; None if nobody knows.
    considered
        Candidates of the last decision, None if there was none.
    chosen
        The candidate that is next; without a name the one at the goal.
    known
        Views, and the 95 % radii in mm and deg that were stated after so many.
    gains
        Views, the gain predicted for the one that was taken then, and the gain that it brought.
    planned
        As `known`, had the views been taken in the order of planning.
    """

    mounting: Mounting
    camera: Camera
    target: Target
    arm: Arm | None = None
    views: tuple[View, ...] = ()
    estimate: Estimate | None = None
    standing: Reading | None = None
    goal: Goal | None = None
    considered: Considered | None = None
    chosen: str | None = None
    picture: Picture | None = None
    known: tuple[tuple[int, float, float], ...] = ()
    gains: tuple[tuple[int, float, float | None], ...] = ()
    asked: tuple[float, float] | None = None
    rejected: dict[str, str] = field(default_factory=dict[str, str])
    planned: tuple[tuple[int, float, float], ...] = ()

    @property
    def at(self) -> Pose | None:
        """Where the flange is, or was at the last view; None if nobody knows."""
        if self.standing is not None:
            return self.standing.T_base_flange
        return self.views[-1].T_base_flange if self.views else None


def scene(shown: Shown) -> dict[str, Any]:
    """Return what stands where, in the frame of the robot's base, metres."""
    estimate, standing, at = shown.estimate, shown.standing, shown.at
    seen = _sight(shown)
    return {
        "arm": _frames(shown.arm, None if standing is None else standing.joints_rad),
        "ghost": _frames(shown.arm, None if shown.goal is None else shown.goal.joints_rad),
        "flange": None if at is None else _flat(at.matrix),
        "boards": _boards(shown, at),
        "cameras": _cameras(shown, at),
        "views": [
            {"name": view.name, "pose": _flat(pose), "sight": seen}
            for view, pose in zip(shown.views, _moving(shown, _poses(shown.views)), strict=True)
        ],
        "goal": None
        if shown.goal is None
        else {"pose": _flat(_moving(shown, shown.goal.T_base_flange.matrix[None])[0]), "sight": seen},
        "ellipsoids": [] if estimate is None or at is None else _ellipsoids(shown, estimate, at),
    }


def candidates(shown: Shown) -> dict[str, Any]:
    """Return where the camera, or the target, could go, with the gain of each or why it may not.

    There may be thousands of poses, so they are packed: the first three rows of each as 32-bit numbers in
    base 64, which takes a tenth of the time of a list.
    """
    considered = shown.considered
    if considered is None:
        nothing: dict[str, Any] = {name: [] for name in ("gains", "names", "reasons", "reason_of")}
        return nothing | {"poses": "", "ruled_out": "", "chosen": None, "sight": None}
    names = [candidate.name for candidate in considered.pool.candidates]
    poses = considered.pool.motions(Mounting.EYE_TO_HAND)
    chosen = shown.chosen
    if chosen is None and shown.goal is not None:
        there = (poses == shown.goal.T_base_flange.matrix).all(axis=(1, 2))
        chosen = next((name for name, is_there in zip(names, there, strict=True) if is_there), None)
    reasons = sorted(set(considered.reasons))
    return {
        "poses": _packed(_moving(shown, poses)),
        "gains": [None if math.isnan(gain) else gain for gain in np.round(considered.gains, 4).tolist()],
        "names": names,
        "chosen": chosen,
        "ruled_out": _packed(_moving(shown, considered.ruled_out)),
        "reason_of": [reasons.index(reason) for reason in considered.reasons],
        "reasons": reasons,
        "sight": _sight(shown),
    }


def knowledge(shown: Shown) -> dict[str, Any]:
    """Return the curves of what was stated and asked, gains, and what limits the accuracy now."""
    estimate = shown.estimate
    now: list[dict[str, Any]] = []
    sentence = None
    if estimate is not None:
        sentence = None if estimate.attribution is None else estimate.attribution.sentence
        if estimate.determined:
            now = [{"name": None, **estimate.within_95.to_dict()}]
    curves = [curve_of(None, shown.known), *([curve_of("planned", shown.planned)] if shown.planned else [])]
    return {
        "now": now,
        "asked": None if shown.asked is None else dict(zip(("mm", "deg"), shown.asked, strict=True)),
        "curves": curves,
        "gains": [{"views": n, "predicted": p, "realised": r} for n, p, r in shown.gains],
        "shares": shares_of(shown),
        "sentence": sentence,
        "open": [] if estimate is None else [direction.sentence for direction in estimate.unobservable],
    }


def curve_of(name: str | None, known: Sequence[tuple[int, float, float]]) -> dict[str, Any]:
    """Return a curve: what was stated after each number of views."""
    return {"name": name, "points": [{"views": n, "mm": mm, "deg": deg} for n, mm, deg in known]}


def shares_of(shown: Shown) -> list[dict[str, Any]]:
    """Return the share of each source of error in the variance of the answer, the largest first."""
    estimate = shown.estimate
    if estimate is None or estimate.model is not ModelName.AUTO:
        return []
    try:
        found = limits(estimate, _measured(shown))
    except DegenerateError:
        return []
    return [{"name": name, "share": share} for name, share in found.items() if share > NOTHING]


def views(shown: Shown) -> dict[str, Any]:
    """Return a row for each view, and where in the picture the views have seen the target."""
    rows: list[dict[str, Any]] = []
    for view, pose in zip(shown.views, _put_right(shown), strict=True):
        off = _residuals(shown, pose, view.point_ids, view.pixels)[1]
        rmse = None if off is None or len(off) == 0 else float(np.sqrt(np.square(off).sum(axis=1).mean()))
        rows.append({"name": view.name, "points": len(view), "rmse_px": rmse})
    pixels = np.concatenate([np.empty((0, 2)), *(view.pixels for view in shown.views)])
    place = (pixels / shown.camera.size_px * _COVERAGE).clip(0, np.array(_COVERAGE) - 1).astype(int)
    counts = np.zeros(_COVERAGE[::-1], dtype=int)
    np.add.at(counts, (place[:, 1], place[:, 0]), 1)
    rejected = [{"name": name, "why": why} for name, why in shown.rejected.items()]
    return {"views": rows, "rejected": rejected, "coverage": [{"name": None, "cells": counts.tolist()}]}


def picture(shown: Shown) -> dict[str, Any] | None:
    """Return what is drawn over the last picture, None without one."""
    return None if shown.picture is None else drawn_over(shown, shown.picture)


def picture_of_view(shown: Shown, name: str) -> dict[str, Any] | None:
    """Return what is drawn over the picture of a view, None if there is no such view."""
    for number, view in enumerate(shown.views):
        if view.name == name:
            detection = Detection(view.point_ids, view.pixels)
            picture = Picture(-1 - number, name, None, detection, view.T_base_flange)
            alone = replace(shown, views=(view,))
            return drawn_over(alone, picture) | {"has_image": view.image is not None}
    return None


def drawn_over(shown: Shown, last: Picture) -> dict[str, Any]:
    """Return the points of a picture, where they were expected, and how large arrows are drawn."""
    width, height = shown.camera.size_px
    answer: dict[str, Any] = {
        "number": last.number,
        "label": last.label,
        "size": [width, height],
        "has_image": last.image is not None,
        "found": None,
        "predicted": None,
        "rmse_px": None,
        "magnification": 1,
    }
    if last.detection is None:
        return answer
    pixels = last.detection.pixels
    answer["found"] = _listed(pixels)
    if last.T_base_flange is not None:
        at = _corrected_pose(shown, last.T_base_flange)
        predicted, off = _residuals(shown, at, last.detection.point_ids, pixels)
        if predicted is not None and off is not None and len(off):
            rmse = float(np.sqrt(np.square(off).sum(axis=1).mean()))
            answer |= {
                "predicted": _listed(predicted),
                "rmse_px": rmse,
                "magnification": round_factor(DRAWN_PX / max(rmse, 1e-3)),
            }
    return answer


def round_factor(factor: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20 ... that is not above a factor."""
    if factor <= 1:
        return 1
    tens = 10.0 ** np.floor(np.log10(factor))
    return float(max(step * tens for step in (1, 2, 5) if step * tens <= factor * (1 + 1e-9)))


def _poses(views: Sequence[View]) -> FloatArray:
    return np.array([view.T_base_flange.matrix for view in views]).reshape(-1, 4, 4)


def _moving(shown: Shown, flanges: FloatArray) -> FloatArray:
    """(N, 4, 4) poses in the base of what moves with the flange, at poses (N, 4, 4) of the flange."""
    if shown.estimate is None:
        return flanges
    in_hand = shown.mounting is Mounting.EYE_IN_HAND
    return flanges @ (shown.estimate.X.inverse() if in_hand else shown.estimate.Y).matrix


def _boards(shown: Shown, at: Pose | None) -> list[dict[str, Any]]:
    estimate = shown.estimate
    if estimate is None:
        return []
    pose = estimate.Y
    if shown.mounting is Mounting.EYE_TO_HAND:
        if at is None:
            return []
        pose = at @ pose
    points = shown.target.points
    return [
        {
            "name": "target",
            "pose": _flat(pose.matrix),
            "points": np.round(points, 5).tolist(),
            "low": points.min(axis=0).tolist(),
            "high": points.max(axis=0).tolist(),
        }
    ]


def _cameras(shown: Shown, at: Pose | None) -> list[dict[str, Any]]:
    estimate = shown.estimate
    if estimate is None:
        return []
    pose = estimate.X.inverse()
    if shown.mounting is Mounting.EYE_IN_HAND:
        if at is None:
            return []
        pose = at @ pose
    return [{"name": "camera", "pose": _flat(pose.matrix), "sight": _opening(shown.camera)}]


def _sight(shown: Shown) -> list[float] | None:
    """How wide what moves with the flange sees, if that is a camera; None for a target."""
    return _opening(shown.camera) if shown.mounting is Mounting.EYE_IN_HAND else None


def _opening(camera: Camera) -> list[float]:
    """Half the width and the height of what a camera sees at a distance of one."""
    width, height = camera.size_px
    fx, fy = camera.parameters[:2]
    return [round(float(width / 2 / fx), 4), round(float(height / 2 / fy), 4)]


def _ellipsoids(shown: Shown, estimate: Estimate, at: Pose) -> list[dict[str, Any]]:
    """Return 95 % ellipsoids of the camera's centre, and of target and tool as the camera has them."""
    if not estimate.determined:
        return []
    A = shown.mounting.chain(at)
    T_camera_target = estimate.X @ A @ estimate.Y
    in_hand = shown.mounting is Mounting.EYE_IN_HAND
    T_base_camera = at @ estimate.X.inverse() if in_hand else estimate.X.inverse()
    aim = T_camera_target.act(shown.target.points.mean(axis=0, keepdims=True))[0]
    tip = (T_base_camera.inverse() @ at).act(np.array([USUAL_TOOL_M]))[0]
    covariance = estimate.hand_eye_covariance
    apart = np.ptp(_poses(shown.views)[:, :3, 3], axis=0).max() if shown.views else 0.0
    drawn_m = DRAWN * max(float(apart), LEAST_M)
    found: list[dict[str, Any]] = []
    for name, point in (("camera", np.zeros(3)), ("a point at the target", aim), ("tool", tip)):
        x, y, z = point
        jacobian = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
        region = ellipsoid(jacobian @ covariance @ jacobian.T, estimate.degrees_of_freedom)
        factor = round_factor(drawn_m / max(float(region.semi_axes_m[0]), 1e-9))
        axes = (T_base_camera.rotation @ region.directions.T).T * region.semi_axes_m[:, np.newaxis] * factor
        found.append(
            {
                "name": name,
                "middle": _rounded(T_base_camera.act(point[np.newaxis])[0]),
                "axes": [_rounded(axis) for axis in axes],
                "magnification": factor,
                "longest_mm": MM_PER_M * float(region.semi_axes_m[0]),
            }
        )
    return found


def _put_right(shown: Shown) -> tuple[Pose, ...]:
    """Return where the flange stands in each view by what is known of the arm."""
    estimate, reported = shown.estimate, tuple(view.T_base_flange for view in shown.views)
    if estimate is None or not reported or any(view.joints_rad is None for view in shown.views):
        return reported
    joints = np.array([view.joints_rad for view in shown.views])
    return tuple(Pose(pose) for pose in estimate.poses_as_built(_poses(shown.views), joints))


def _measured(shown: Shown) -> Measurements:
    return Measurements(shown.mounting, shown.camera, shown.target, shown.views, ())


def _corrected_pose(shown: Shown, T_base_flange: Pose) -> Pose:
    """Return the corrected pose of the view that was taken there, or the pose itself."""
    there = tuple(view for view in shown.views if view.T_base_flange == T_base_flange)[:1]
    return _put_right(replace(shown, views=there))[0] if there else T_base_flange


def _residuals(
    shown: Shown,
    T_base_flange: Pose,
    ids: IndexArray,
    pixels: FloatArray,
) -> tuple[FloatArray | None, FloatArray | None]:
    """Return where points are predicted (N, 2), and by how much those in sight are off."""
    estimate = shown.estimate
    if estimate is None:
        return None, None
    chain = estimate.X @ shown.mounting.chain(T_base_flange) @ estimate.Y
    target, camera = shown.target, estimate.camera
    predicted, seen = _core.project_features(
        camera.lens, camera.parameters, chain.matrix, target.points[ids], target.radii_m[ids]
    )
    if not np.all(seen):
        return None, (pixels - predicted)[seen]
    return predicted, pixels - predicted


def _frames(arm: Arm | None, joints: Sequence[float] | None) -> list[list[float]] | None:
    if arm is None or joints is None or len(joints) != len(arm):
        return None
    return _many(arm.frames(np.array(joints)))


def _listed(pixels: FloatArray) -> list[list[float]]:
    return np.round(pixels, 2).tolist()


def _many(poses: FloatArray) -> list[list[float]]:
    return np.round(poses[:, :3], 4).reshape(len(poses), 12).tolist()


def _packed(poses: FloatArray) -> str:
    return b64encode(poses[:, :3].astype("<f4").tobytes()).decode()


def _flat(pose: FloatArray) -> list[float]:
    return _rounded(pose[:3].ravel())


def _rounded(values: FloatArray) -> list[float]:
    return [round(float(value), 5) for value in values]
