"""Views that fit no other pose: taken while moving, or a gross error of the robot."""

from typing import Any

import numpy as np

from handeye.estimation.faults.explanation import Explanation
from handeye.estimation.faults.kinds import gross_pose, view_moving
from handeye.estimation.faults.kinds.words import listed, size_of
from handeye.estimation.faults.selection import CLEAR, weigh
from handeye.estimation.faults.stations import inverted, twists
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Finding
from handeye.types.mounting import Mounting
from handeye.types.units import MM_PER_M

# A picture taken while the arm moved is off by what it moves in a fraction of a second; more is another
# mistake.
MOVING_TRANSLATION_M = 0.02
MOVING_ROTATION_RAD = np.deg2rad(2.0)
# An error along the way to the view before or after: directions within this cosine, and no further than this
# share.
ALONG_COSINE = 0.95
MOST_OF_THE_WAY = 0.3
# A shift or a turn of less than so many standard deviations has no direction.
SHORTEST_SIGMAS = 3.0


def view_evidence(explanation: Explanation, k: int) -> dict[str, Any]:
    """How far a view is off, how far was to be expected, and the odds."""
    selection = explanation.selection
    deviation, covariance = selection.agreement.at_flange(selection.fit)
    expected = np.sqrt(np.diag(covariance[k]))
    return {
        **size_of(deviation[k]),
        "expected_mm": float(np.linalg.norm(expected[:3])) * MM_PER_M,
        "expected_deg": float(np.rad2deg(np.linalg.norm(expected[3:]))),
        "log_odds": float(selection.log_odds[k]),
        "p_value": float(selection.fit.p_value[k]),
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
        return Finding(
            view_moving.KIND.code,
            f"{apart}: {view_moving.MOVED if of_picture else view_moving.READ_MOVING}{doubt}",
            evidence,
        )
    if small:
        return Finding(view_moving.KIND.code, f"{apart}: {view_moving.MOVED}{doubt}", evidence)
    return Finding(gross_pose.KIND.code, f"{apart}: the robot pose of this view is wrong{doubt}", evidence)


def _rivals(measurements: Measurements, explanation: Explanation, k: int) -> list[str]:
    """Views whose exclusion would explain the data nearly as well."""
    members = explanation.members.copy()
    members[k] = True
    odds = weigh(explanation.selection.agreement, members).log_odds
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
    agreement = explanation.selection.agreement
    stations = agreement.stations
    # The robot pose that the image asks for, from the other views.
    asked = inverted(agreement.X) @ stations.poses[k] @ inverted(agreement.Y)
    # T_base_flange of A, and of what the image asks for.
    _, covariance = agreement.at_flange(explanation.selection.fit)
    variance = np.diag(covariance[k])
    sigmas = np.sqrt([variance[:3].sum(), variance[3:].sum()])
    in_hand = measurements.mounting is Mounting.EYE_IN_HAND
    flanges = inverted(stations.motions) if in_hand else stations.motions
    wanted = inverted(asked) if in_hand else asked
    for other in (k + 1, k - 1):
        if not 0 <= other < len(measurements):
            continue
        for at_rest, moving in ((flanges[k], wanted), (wanted, flanges[k])):
            share = _share_of_way(at_rest, moving, flanges[other], sigmas)
            if share is not None:
                return measurements.views[other].name, share, moving is wanted
    return None


def _share_of_way(
    start: FloatArray, between: FloatArray, end: FloatArray, sigmas: FloatArray
) -> float | None:
    """Share of the way from a pose to another at which a third lies; None if it lies elsewhere.

    `sigmas` (2,) are standard deviations of shift and turn. Where one of them is too small to have a
    direction, it must be what the share of the other leaves.
    """
    moved = twists((inverted(start) @ between)[np.newaxis])[0].reshape(2, 3)
    way = twists((inverted(start) @ end)[np.newaxis])[0].reshape(2, 3)
    clear = np.linalg.norm(moved, axis=1) > SHORTEST_SIGMAS * sigmas
    shares = [_share(moved[part], way[part]) for part in np.flatnonzero(clear)]
    if not shares or None in shares:
        return None
    known = np.array(shares, dtype=np.float64)
    share = float(known.mean())
    left = np.linalg.norm(moved - share * way, axis=1)
    if known.max() >= min(MOST_OF_THE_WAY, 1.5 * known.min()) and len(known) > 1:
        return None
    return share if share < MOST_OF_THE_WAY and (clear | (left < SHORTEST_SIGMAS * sigmas)).all() else None


def _share(moved: FloatArray, way: FloatArray) -> float | None:
    """Share of a way (3,) that a shift (3,) covers; None if it goes elsewhere."""
    length, step = float(np.linalg.norm(way)), float(np.linalg.norm(moved))
    if length <= 0 or step <= 0 or float(moved @ way) < ALONG_COSINE * length * step:
        return None
    return step / length
