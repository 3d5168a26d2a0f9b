"""Other ways to understand all views at once, tried where the views do not agree as they are given."""

import math
from dataclasses import replace

import numpy as np

from handeye.errors import InputError
from handeye.estimation.measurements import Measurements
from handeye.estimation.mistakes.conventions import (
    READINGS,
    Scale,
    pitch_of,
    possible_scales,
    read_as,
    rotation_consensus,
    scale_of,
)
from handeye.estimation.mistakes.explanation import Explanation, explain
from handeye.estimation.mistakes.naming import reading_error, scale_error, shuffled_words
from handeye.estimation.mistakes.noise_grid import NoiseGrid
from handeye.estimation.mistakes.relabel import Readings, Relabeling
from handeye.estimation.mistakes.shuffles import find_pairing
from handeye.estimation.mistakes.sightings import Sightings

# Logarithm of the factor in evidence that another way to understand all views must have.
CLEARLY_BETTER = 20.0
# A factor of any value is less probable beforehand than a unit's, by this logarithm.
ANY_SCALE = 8.0
# Pictures that differ by more were taken at different places; the share of such views with one robot pose
# that is no chance.
STALE_M, STALE_RAD = 0.005, 0.02
STALE_SHARE = 0.2
MOST_NAMED = 4
# No arm reaches so far and no board has such squares, at once.
ENORMOUS_REACH_M = 20.0
ENORMOUS_PITCH_M = 1.0


def refuse_enormous(measurements: Measurements) -> None:
    """Raise where robot and target are both so large that all lengths must be in another unit.

    They agree with each other then, so nothing else would show.
    """
    reach, pitch = _reach(measurements), pitch_of(measurements.target)
    if reach > ENORMOUS_REACH_M and pitch > ENORMOUS_PITCH_M:
        raise InputError(
            f"the flange is {reach:.4g} m from the base and the points of the target {pitch:.4g} m apart: "
            "robot poses and target are in millimetres and were taken for metres",
            code="wrong_unit",
            hint="divide the translations of the robot poses and the measures of the target by 1000",
        )


def refuse_stale(measurements: Measurements) -> None:
    """Raise where robot poses were not read again: the same to the last digit though the pictures differ.

    Raises
    ------
    InputError
        At least `STALE_SHARE` of the views have the pose of another one; the message names them.
    """
    stale: list[tuple[str, str]] = []
    views, poses = measurements.views, measurements.poses
    for k, view in enumerate(views):
        for j in range(k):
            if views[j].T_base_flange != view.T_base_flange:
                continue
            moved = poses[k].T_camera_target @ poses[j].T_camera_target.inverse()
            if np.linalg.norm(moved.translation) > STALE_M or moved.rotation_angle_rad > STALE_RAD:
                stale.append((views[j].name, view.name))
                break
    if len(stale) < max(2, STALE_SHARE * len(views)):
        return
    words = ", ".join(f"{first} and {second}" for first, second in stale[:MOST_NAMED])
    more = f" and {len(stale) - MOST_NAMED} more pairs" if len(stale) > MOST_NAMED else ""
    raise InputError(
        f"the robot poses of {words}{more} are the same to the last digit, though their pictures differ: the "
        "pose was not read again",
        code="inconsistent",
        hint="read the robot's pose again at every picture, once the arm has come to rest",
    )


def _reach(measurements: Measurements) -> float:
    """Median distance of the flange from the base."""
    return float(np.median([np.linalg.norm(view.T_base_flange.translation) for view in measurements.views]))


def look_elsewhere(
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
        # Densities are per cubic metre of the target's shift: those of a scaled target count in its own
        # metres.
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
        names = [view.name for view in measurements.views]
        comparison = _comparison(explanation, first)
        error = InputError(
            f"{shuffled_words(names, moved)}: so paired, {comparison['agreeing']} of {count} views agree "
            f"within {comparison['robot_translation_mm']:.2g} mm",
            code="view_shuffled",
            hint="pair each image with the robot pose at which it was taken",
        )
        left = count - len(images)
        penalty = math.lgamma(count + 1) - left * _typical_mistake(first)
        # Where the others are enough to tell the rest by, these can be paired again and used.
        if moved and (len(moved) > count // 2 or not first.is_bearable):
            consider(explanation.log_evidence - penalty, explanation, error)
    if best is not None:
        raise best[1]
    if not first.is_bearable:
        translation, rotation = first.levels
        raise InputError(
            f"the robot poses and the images do not agree under any reading: {int(first.members.sum())} of "
            f"{count} views within {translation * 1e3:.3g} mm and {np.rad2deg(rotation):.2g} deg",
            code="inconsistent",
            hint="check which pose belongs to which image, the unit and the order of the numbers, the size "
            "of the target and the camera's calibration",
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
    return possible_scales(factor, _reach(measurements), pitch_of(measurements.target))


def _rescaled(sightings: Sightings, readings: Readings, scale: Scale) -> tuple[Sightings, Readings]:
    if scale.blamed == "robot":
        motions = sightings.motions.copy()
        motions[:, :3, 3] /= scale.factor
        return sightings.with_motions(motions), readings
    poses = readings.poses.copy()
    poses[..., :3, 3] *= scale.factor
    relabelings: list[Relabeling] = []
    for relabeling in readings.relabelings:
        factor = relabeling.factor.copy()
        factor[:3, 3] *= scale.factor
        relabelings.append(replace(relabeling, factor=factor))
    return sightings.scaled(scale.factor), Readings(tuple(relabelings), poses)
