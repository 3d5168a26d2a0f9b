"""Look for mistakes before anything is estimated: name them, leave out what is wrong, go on with what is right."""

import math
from dataclasses import dataclass, replace

import numpy as np

from handeye.errors import InputError
from handeye.solving.measurements import Measurements, ViewPose
from handeye.solving.mistakes.conventions import (
    READINGS,
    Scale,
    possible_scales,
    pitch_of,
    read_as,
    rotation_consensus,
    scale_of,
)
from handeye.solving.mistakes.explanation import Explanation, explain
from handeye.solving.mistakes.naming import (
    flipped_finding,
    lone_finding,
    pairing_words,
    reading_error,
    scale_error,
    shuffled_finding,
)
from handeye.solving.mistakes.noise_grid import NoiseGrid, noise_grid
from handeye.solving.mistakes.outliers import weigh_pairs
from handeye.solving.mistakes.points import without_gross_points
from handeye.solving.mistakes.relabel import Readings, Relabeling, shifts
from handeye.solving.mistakes.shuffles import Pairing, find_pairing, pair_suspects
from handeye.solving.mistakes.sightings import Sightings
from handeye.types.calibration import Finding
from handeye.types.view import View

FEWEST_VIEWS = 3
# Logarithm of the factor in evidence that another way to understand all views must have.
CLEARLY_BETTER = 20.0
# A factor of any value is less probable beforehand than a unit's, by this logarithm.
ANY_SCALE = 8.0


@dataclass(frozen=True, eq=False)
class Examination:
    """What is left to estimate from, and what was found.

    Parameters
    ----------
    measurements
        The views that belong, with labels and pairs put right; the others are in `rejected`.
    findings
        Every mistake, with its evidence.
    notes
        What was changed of views that are used, by name.
    """

    measurements: Measurements
    findings: tuple[Finding, ...] = ()
    notes: dict[str, str] | None = None


def examine(measurements: Measurements) -> Examination:
    """Find the mistakes in measurements.

    Raises
    ------
    InputError
        All views share a mistake: a wrong direction, unit or convention, or images filed with the wrong poses; the
        code names it. Or nothing explains the views.
    """
    if len(measurements) < FEWEST_VIEWS:
        return Examination(measurements)
    measurements, of_points = without_gross_points(measurements)
    if len(measurements) < FEWEST_VIEWS:
        return Examination(measurements, of_points)
    sightings, readings, grid = Sightings.of(measurements), Readings.of(measurements), noise_grid()
    first = explain(sightings, readings, grid)
    if not first.is_convincing:
        _look_elsewhere(measurements, sightings, readings, first, grid)
    examination = _sort_out(measurements, first)
    return replace(examination, findings=(*of_points, *examination.findings))


def _look_elsewhere(
    measurements: Measurements,
    sightings: Sightings,
    readings: Readings,
    first: Explanation,
    grid: NoiseGrid,
) -> None:
    """Raise if another way to understand all views explains them much better, or nothing does."""
    count = len(sightings)
    best: tuple[float, InputError] | None = None

    def consider(evidence: float, explanation: Explanation, error: InputError) -> None:
        nonlocal best
        better = evidence > first.log_evidence + CLEARLY_BETTER and explanation.is_bearable
        if better and (best is None or evidence > best[0]):
            best = (evidence, error)

    for reading in READINGS:
        explanation = explain(read_as(sightings, reading), readings, grid)
        weighing = explanation.selection.weighing
        error = reading_error(measurements, reading, _comparison(explanation, first), weighing.X, weighing.Y)
        consider(explanation.log_evidence, explanation, error)
    for scale in _scales(measurements, sightings):
        rescaled, in_poses = _rescaled(sightings, readings, scale)
        explanation = explain(rescaled, in_poses, grid)
        # Densities are per cubic metre of the target's shift: those of a scaled target count in its own metres.
        correction = 0.0 if scale.blamed == "robot" else 3 * count * math.log(scale.factor)
        if scale.unit is None:
            correction -= ANY_SCALE
        error = scale_error(scale, {"scale": scale.factor, **_comparison(explanation, first)})
        consider(explanation.log_evidence + correction, explanation, error)
    pairing = find_pairing(sightings)
    if pairing is not None:
        images = np.flatnonzero(pairing >= 0)
        paired = sightings.paired(images, pairing[images])
        explanation = explain(paired, replace(readings, poses=readings.poses[images]), grid)
        moved = [(int(i), int(pairing[i])) for i in images if pairing[i] != i]
        finding = shuffled_finding(
            measurements, moved, applied=False, evidence=_comparison(explanation, first)
        )
        error = InputError(
            finding.sentence.removesuffix("; they were left out"),
            code=finding.code,
            hint="pair each image with the pose at which it was taken",
        )
        left = count - len(images)
        penalty = math.lgamma(count + 1) - left * _typical_mistake(first)
        if len(moved) > count // 4:
            consider(explanation.log_evidence - penalty, explanation, error)
    if best is not None:
        raise best[1]
    if not first.is_bearable:
        translation, rotation = first.levels
        raise InputError(
            f"the robot poses and the images do not agree under any reading: {int(first.members.sum())} of {count} "
            f"views within {translation * 1e3:.3g} mm and {np.rad2deg(rotation):.2g} deg",
            code="inconsistent",
            hint="check which pose belongs to which image, the unit and the order of the numbers, the size of the "
            "target and the camera's calibration",
        )


def _typical_mistake(explanation: Explanation) -> float:
    """Logarithm of the density of a mistaken view, for views that a pairing leaves over."""
    outside = ~explanation.members
    if not outside.any():
        return -30.0
    selection = explanation.selection
    density = selection.prediction.log_density + selection.log_odds
    return float(np.median(density[outside]))


def _comparison(explanation: Explanation, first: Explanation) -> dict[str, float]:
    translation, rotation = explanation.levels
    given_translation, given_rotation = first.levels
    return {
        "views": len(first.members),
        "agreeing": int(explanation.members.sum()),
        "robot_translation_mm": translation * 1e3,
        "robot_rotation_deg": float(np.rad2deg(rotation)),
        "agreeing_as_given": int(first.members.sum()),
        "robot_translation_mm_as_given": given_translation * 1e3,
        "robot_rotation_deg_as_given": float(np.rad2deg(given_rotation)),
        "log_evidence_ratio": explanation.log_evidence - first.log_evidence,
    }


def _scales(measurements: Measurements, sightings: Sightings) -> list[Scale]:
    factor = scale_of(sightings, rotation_consensus(sightings))
    if factor is None:
        return []
    reach = float(np.median([np.linalg.norm(v.T_base_flange.translation) for v in measurements.views]))
    return possible_scales(factor, reach, pitch_of(measurements.target))


def _rescaled(sightings: Sightings, readings: Readings, scale: Scale) -> tuple[Sightings, Readings]:
    if scale.blamed == "robot":
        motions = sightings.motions.copy()
        motions[:, :3, 3] /= scale.factor
        return sightings.with_motions(motions), readings
    poses = readings.poses.copy()
    poses[..., :3, 3] *= scale.factor
    relabelings = []
    for relabeling in readings.relabelings:
        factor = relabeling.factor.copy()
        factor[:3, 3] *= scale.factor
        relabelings.append(replace(relabeling, factor=factor))
    return sightings.scaled(scale.factor), Readings(tuple(relabelings), poses)


def _sort_out(measurements: Measurements, explanation: Explanation) -> Examination:
    """Put right what can be, leave out the rest, and say so."""
    readings, kinds = explanation.readings, len(explanation.readings.relabelings)
    names = [view.name for view in measurements.views]
    views: dict[int, View] = {}
    poses: dict[int, ViewPose] = {}
    findings: list[Finding] = []
    notes: dict[str, str] = {}
    rejected = dict(measurements.rejected)
    flips: dict[int, list[int]] = {}
    for k in np.flatnonzero(explanation.members).tolist():
        label = int(explanation.labels[k])
        views[k], poses[k] = _read(measurements, readings, k, label)
        if label % kinds:
            flips.setdefault(label % kinds, []).append(k)
    for kind, flipped in flips.items():
        relabeling = readings.relabelings[kind]
        findings.append(_flip(measurements, explanation, relabeling, flipped, notes))
    suspects = [int(k) for k in np.flatnonzero(~explanation.members)]
    pairings = pair_suspects(explanation.selection, readings)
    if pairings:
        applied = _closed(pairings, explanation)
        for pairing in applied:
            view, pose = _read(measurements, readings, pairing.image, pairing.label)
            at = measurements.views[pairing.motion]
            views[pairing.motion] = View(
                at.name,
                at.T_base_flange,
                view.point_ids,
                view.pixels,
                view.image,
                at.timestamp_s,
                at.joints_rad,
            )
            poses[pairing.motion] = pose
            notes[at.name] = f"with the picture of {names[pairing.image]}"
        findings.append(
            shuffled_finding(
                measurements,
                [(p.image, p.motion) for p in pairings],
                applied=bool(applied) and len(applied) == len(pairings),
                evidence={},
            )
        )
        for pairing in pairings:
            if pairing not in applied:
                rejected[names[pairing.image]] = pairing_words(names[pairing.image], names[pairing.motion])
    for k in suspects:
        if k in views or names[k] in rejected:
            continue
        shifted = _shifted(measurements, explanation, k)
        if shifted is not None:
            views[k], poses[k] = (
                shifted.applied(measurements.views[k]),
                shifted.applied_to_pose(measurements.poses[k]),
            )
            findings.append(_flip(measurements, explanation, shifted, [k], notes))
            continue
        finding = lone_finding(measurements, explanation, k)
        findings.append(finding)
        rejected[names[k]] = finding.sentence.removeprefix(f"{names[k]}: ")
    order = sorted(views)
    kept = replace(
        measurements,
        views=tuple(views[k] for k in order),
        poses=tuple(poses[k] for k in order),
        rejected=rejected,
    )
    return Examination(kept, tuple(findings), notes)


def _read(measurements: Measurements, readings: Readings, k: int, label: int) -> tuple[View, ViewPose]:
    """Return a view and its pose under one of its readings."""
    kinds = len(readings.relabelings)
    view, pose = measurements.views[k], measurements.poses[k]
    if label >= kinds and pose.mirrored is not None:
        pose = ViewPose(
            pose.mirrored[0], pose.mirrored[1], pose.information, (pose.T_camera_target, pose.rmse_px)
        )
    relabeling = readings.relabelings[label % kinds]
    return (relabeling.applied(view), relabeling.applied_to_pose(pose)) if label % kinds else (view, pose)


def _closed(pairings: list[Pairing], explanation: Explanation) -> list[Pairing]:
    """Pairs that can be applied: each image fits one pose only, and images and poses are the same views."""
    clear = [p for p in pairings if p.unambiguous and not explanation.members[p.motion]]
    while clear:
        images, motions = {p.image for p in clear}, {p.motion for p in clear}
        kept = [p for p in clear if p.image in motions and p.motion in images]
        if len(kept) == len(clear):
            break
        clear = kept
    return clear


def _flip(
    measurements: Measurements,
    explanation: Explanation,
    relabeling: Relabeling,
    flipped: list[int],
    notes: dict[str, str],
) -> Finding:
    names = [measurements.views[k].name for k in flipped]
    for name in names:
        notes[name] = f"labels {relabeling.words}, read anew"
    return flipped_finding(names, relabeling.words, {"labels": relabeling.words}, relabeling.looks_the_same)


def _shifted(measurements: Measurements, explanation: Explanation, k: int) -> Relabeling | None:
    """Return the labels under which a view that shows part of the target belongs, if there are such."""
    view = measurements.views[k]
    candidates = shifts(measurements.target, view.point_ids, list(explanation.readings.relabelings))
    if not candidates:
        return None
    poses = measurements.poses[k].T_camera_target.matrix @ np.array([c.factor for c in candidates])
    selection = explanation.selection
    # Only those that come near: there are as many as there are points.
    weighing = selection.weighing
    chain = weighing.X @ weighing.sightings.motions[k] @ weighing.Y
    near = np.argsort(np.linalg.norm(poses[:, :3, 3] - chain[:3, 3], axis=1))[:8]
    at = np.full(len(near), k)
    odds, _ = weigh_pairs(selection, at, at, poses[near])
    best = int(np.argmin(odds))
    return candidates[near[best]] if odds[best] < 0 else None
