"""Sentences and evidence of what was found."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from handeye.errors import InputError
from handeye.estimation.measurements import Measurements
from handeye.estimation.mistakes.conventions import Reading, Scale
from handeye.estimation.mistakes.explanation import Explanation
from handeye.estimation.mistakes.outliers import CLEAR, weigh
from handeye.estimation.mistakes.sightings import inverted, twists
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Finding
from handeye.types.mounting import Mounting

MM_PER_M = 1000.0
# A picture taken while the arm moved is off by what it moves in a fraction of a second; more is another
# mistake.
MOVING_TRANSLATION_M = 0.02
MOVING_ROTATION_RAD = np.deg2rad(2.0)
# An error along the way to the view before or after: directions within this cosine, and no further than this
# share.
ALONG_COSINE = 0.95
MOST_OF_THE_WAY = 0.3
MOST_LISTED = 6
MOVED = "the picture was probably taken while the arm moved"
READ_MOVING = "the robot's pose was probably read while the arm moved"


def listed(names: Sequence[str]) -> str:
    """Join names for a sentence, the first few of them."""
    if len(names) > MOST_LISTED:
        return f"{', '.join(names[:MOST_LISTED])} and {len(names) - MOST_LISTED} more"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def size_of(deviation: FloatArray) -> dict[str, float]:
    """Millimetres and degrees of a twist."""
    return {
        "translation_mm": float(np.linalg.norm(deviation[:3])) * MM_PER_M,
        "rotation_deg": float(np.rad2deg(np.linalg.norm(deviation[3:]))),
    }


def view_evidence(explanation: Explanation, k: int) -> dict[str, Any]:
    """How far a view is off, how far was to be expected, and the odds."""
    selection = explanation.selection
    deviation, covariance = selection.weighing.at_flange(selection.prediction)
    expected = np.sqrt(np.diag(covariance[k]))
    return {
        **size_of(deviation[k]),
        "expected_mm": float(np.linalg.norm(expected[:3])) * MM_PER_M,
        "expected_deg": float(np.rad2deg(np.linalg.norm(expected[3:]))),
        "log_odds": float(selection.log_odds[k]),
        "p_value": float(selection.prediction.p_value[k]),
    }


def lone_finding(measurements: Measurements, explanation: Explanation, k: int) -> Finding:
    """Name a view that fits no other pose: taken while moving, or a gross error of the robot."""
    name = measurements.views[k].name
    evidence: dict[str, Any] = {"views": [name], **view_evidence(explanation, k)}
    apart = (
        f"{name}: image and robot pose are apart by {evidence['translation_mm']:.3g} mm and "
        f"{evidence['rotation_deg']:.2g} deg where {evidence['expected_mm']:.2g} mm and "
        f"{evidence['expected_deg']:.2g} deg are to be expected"
    )
    on_the_way = _on_the_way(measurements, explanation, k)
    small = evidence["translation_mm"] < MOVING_TRANSLATION_M * MM_PER_M and evidence[
        "rotation_deg"
    ] < np.rad2deg(MOVING_ROTATION_RAD)
    rivals = _rivals(measurements, explanation, k)
    evidence["ambiguous_with"] = rivals
    doubt = f"; it may as well be {listed(rivals)}: more views would tell" if rivals else ""
    twin = _twin(measurements, k)
    if twin is not None:
        evidence["same_pose_as"] = twin
        doubt = f"; its robot pose is that of {twin}" + doubt
    if on_the_way is not None:
        other, share, of_picture = on_the_way
        evidence.update({"on_the_way_to": other, "share_of_the_way": share})
        apart += f", {100 * share:.0f} % of the way to {other}"
        return Finding("view_moving", f"{apart}: {MOVED if of_picture else READ_MOVING}{doubt}", evidence)
    if small:
        return Finding("view_moving", f"{apart}: {MOVED}{doubt}", evidence)
    return Finding("gross_pose", f"{apart}: the robot pose of this view is wrong{doubt}", evidence)


def _rivals(measurements: Measurements, explanation: Explanation, k: int) -> list[str]:
    """Views whose exclusion would explain the data nearly as well."""
    members = explanation.members.copy()
    members[k] = True
    odds = weigh(explanation.selection.weighing, members).log_odds
    close = [j for j in np.flatnonzero(members) if j != k and odds[j] > max(0.0, odds[k] - CLEAR)]
    return [measurements.views[j].name for j in close]


def _twin(measurements: Measurements, k: int) -> str | None:
    """Name another view with exactly the same robot pose."""
    own = measurements.views[k].T_base_flange
    return next((v.name for i, v in enumerate(measurements.views) if i != k and v.T_base_flange == own), None)


def _on_the_way(
    measurements: Measurements, explanation: Explanation, k: int
) -> tuple[str, float, bool] | None:
    """Name the view before or after on the way to which something was done too early or too late.

    Also the share of the way, and whether the picture was taken there; else the pose was read there.
    """
    weighing = explanation.selection.weighing
    sightings = weighing.sightings
    # The robot pose that the image asks for, from the other views.
    asked = inverted(weighing.X) @ sightings.poses[k] @ inverted(weighing.Y)
    # T_base_flange of A, and of what the image asks for.
    in_hand = measurements.mounting is Mounting.EYE_IN_HAND
    flanges = inverted(sightings.motions) if in_hand else sightings.motions
    wanted = inverted(asked) if in_hand else asked
    for other in (k + 1, k - 1):
        if not 0 <= other < len(measurements):
            continue
        for at_rest, moving in ((flanges[k], wanted), (wanted, flanges[k])):
            share = _share_of_way(at_rest, moving, flanges[other])
            if share is not None:
                return measurements.views[other].name, share, moving is wanted
    return None


def _share_of_way(start: FloatArray, between: FloatArray, end: FloatArray) -> float | None:
    """Share of the way from a pose to another at which a third lies; None if it lies elsewhere."""
    moved = twists((inverted(start) @ between)[np.newaxis])[0]
    way = twists((inverted(start) @ end)[np.newaxis])[0]
    shares = [_share(moved[part], way[part]) for part in (slice(0, 3), slice(3, 6))]
    first, second = (0.0 if share is None else share for share in shares)
    if 0 < max(first, second) < MOST_OF_THE_WAY and max(first, second) < 1.5 * min(first, second):
        return 0.5 * (first + second)
    return None


def _share(moved: FloatArray, way: FloatArray) -> float | None:
    """Share of a way (3,) that a shift (3,) covers; None if it goes elsewhere."""
    length, step = float(np.linalg.norm(way)), float(np.linalg.norm(moved))
    if length <= 0 or step <= 0 or float(moved @ way) < ALONG_COSINE * length * step:
        return None
    return step / length


def flipped_finding(names: list[str], words: str, looks_the_same: bool) -> Finding:
    """Name views whose labels were read again."""
    reason = (
        "as the board looks the same after it"
        if looks_the_same
        else "though its picture tells the ends apart"
    )
    they = "they were" if len(names) > 1 else "it was"
    return Finding(
        "view_flipped",
        f"{listed(names)}: the points of the board are labelled {words} against the other views, {reason}; "
        f"{they} labelled again and used",
        {"views": names, "labels": words, "looks_the_same": looks_the_same},
    )


def pairing_words(image: str, motion: str) -> str:
    """Say which robot pose an image belongs to."""
    return f"the picture of {image} was taken at the robot pose of {motion}"


def shuffled_words(names: Sequence[str], pairs: Sequence[tuple[int, int]]) -> str:
    """Say which images were filed with the wrong poses."""
    involved = [names[k] for k in sorted({k for pair in pairs for k in pair})]
    words = shift_of(dict(pairs), len(names)) or "; ".join(
        pairing_words(names[image], names[motion]) for image, motion in pairs[:MOST_LISTED]
    )
    return f"{listed(involved)}: images and robot poses are paired wrongly ({words})"


def shuffled_finding(names: Sequence[str], pairs: Sequence[tuple[int, int]], *, applied: bool) -> Finding:
    """Name images that were filed with the wrong poses."""
    done = "they were paired again and used" if applied else "what could not be paired again was left out"
    return Finding(
        "view_shuffled",
        f"{shuffled_words(names, pairs)}; {done}",
        {
            "views": [names[k] for k in sorted({k for pair in pairs for k in pair})],
            "pose_of_image": {names[image]: names[motion] for image, motion in pairs},
            "applied": applied,
        },
    )


def shift_of(pairing: dict[int, int], count: int) -> str:
    """Say in words what a pairing of images to poses has in common, empty if nothing."""
    if len(pairing) < 3:
        return ""
    steps = {(motion - image) % count for image, motion in pairing.items()}
    if len(steps) == 1:
        step = steps.pop()
        step = step if step <= count // 2 else step - count
        if step == 0:
            return ""
        return f"the list of images is shifted by {abs(step)} against that of the poses"
    if {image + motion for image, motion in pairing.items()} == {count - 1}:
        return "one of the lists is in reverse order"
    return ""


def reading_error(
    measurements: Measurements, reading: Reading, evidence: dict[str, Any], X: FloatArray, Y: FloatArray
) -> InputError:
    """Return the error for robot poses that were taken for something else."""
    numbers = (
        f"read so, {evidence['agreeing']} of {evidence['views']} views agree within "
        f"{evidence['robot_translation_mm']:.2g} mm and {evidence['robot_rotation_deg']:.2g} deg; as given, "
        f"{evidence['agreeing_as_given']} within {evidence['robot_translation_mm_as_given']:.3g} mm and "
        f"{evidence['robot_rotation_deg_as_given']:.2g} deg"
    )
    sentence = reading.sentence
    hint = "write the poses as T_base_flange in metres, the flange as seen from the base"
    if reading.code == "wrong_direction":
        other = (
            Mounting.EYE_TO_HAND if measurements.mounting is Mounting.EYE_IN_HAND else Mounting.EYE_IN_HAND
        )
        # With the directions swapped the same numbers describe the other mounting. The nearer of camera and
        # target is on the flange.
        camera_nearer = np.linalg.norm(X[:3, 3]) < np.linalg.norm(Y[:3, 3])
        as_given = measurements.mounting is Mounting.EYE_IN_HAND
        if bool(camera_nearer) != as_given:
            words = "sits in the room" if other is Mounting.EYE_TO_HAND else "sits on the flange"
            given = measurements.mounting.value
            sentence = f"the camera {words} ({other.value}), not as given ({given}); or {sentence}"
            hint = f"set the mounting to {other.value}, or invert the poses"
        else:
            sentence = f"{sentence}; or the mounting is {other.value}"
            hint = f"invert the poses, or set the mounting to {other.value}"
    return InputError(f"{sentence}: {numbers}", code=reading.code, hint=hint)


def scale_error(scale: Scale, evidence: dict[str, Any]) -> InputError:
    """Return the error for lengths in different units."""
    numbers = (
        f"with lengths scaled by {evidence['scale']:.5g}, {evidence['agreeing']} of {evidence['views']} "
        f"views agree within {evidence['robot_translation_mm']:.2g} mm and "
        f"{evidence['robot_rotation_deg']:.2g} deg"
    )
    hint = (
        "divide the translations of the robot poses, or name their unit"
        if scale.blamed == "robot"
        else "give the measures of the target in metres, as printed"
    )
    return InputError(f"{scale.sentence}: {numbers}", code="wrong_unit", hint=hint)
