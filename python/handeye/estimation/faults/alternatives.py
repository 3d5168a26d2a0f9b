"""Other ways to understand all views at once, tried where the views do not agree as they are given.

There are hundreds; all are ranked by how well X and Y in closed form bring chain and images together, and the
best are explained like the recording as given. One is named if its evidence is clearly larger.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye.errors import HandeyeError, SolveError
from handeye.estimation.faults.consensus import closed_forms, distances
from handeye.estimation.faults.explanation import BEARABLE_SCALE, Explanation, explain
from handeye.estimation.faults.kinds import (
    HYPOTHESES,
    OF_NUMBERS,
    Hypothesis,
    SharedFaultError,
    board_size,
    inconsistent,
    view_shuffled,
    wrong_direction,
)
from handeye.estimation.faults.kinds.numbers import angles_between
from handeye.estimation.faults.kinds.wrong_rotation import ODD
from handeye.estimation.faults.selection import FEWEST_VIEWS
from handeye.estimation.faults.shuffles import find_pairing
from handeye.estimation.faults.stations import Stations, centres, inverted, target_centre
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.mounting import Mounting
from handeye.types.recording import Recording

# Logarithm of the factor in evidence that another way to understand all views must have.
CLEARLY_BETTER = 20.0
# Within this of the best another way explains the views as well; so many are named.
AS_WELL = 10.0
MOST_RIVALS = 2
# So many usual and so many odd ones are explained, of those whose misfit is less than this share of that as
# given.
MOST_EXPLAINED = 8
BETTER_SHARE = 0.7
# Where the views agree as given, the inverse is explained if its misfit in closed form is below so many times
# that as given.
NEARLY = 3.0
# Angles between views may be off by so much, in the middle, before a reading is dropped.
TURN_SLACK_RAD = np.deg2rad(2.0)
# Of what has no change, such as views that have to be taken again.
DENSITY_OF_NO_MISTAKE = -30.0


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another way to understand all views, how well it explains them, and other kinds that do so as well."""

    hypothesis: Hypothesis
    explanation: Explanation
    log_evidence: float
    rivals: tuple[Hypothesis, ...] = ()


def find_alternative(
    measurements: Measurements, given: Explanation | None, *, by_joints: bool = False
) -> Alternative | None:
    """Find another way to understand all views that explains them much better, None if there is none.

    Where the poses are those of the joints, how they are written is not in question.
    """
    compared = given is not None and given.has_evidence
    needed = given.log_evidence + CLEARLY_BETTER if given is not None and compared else -math.inf
    if given is not None and given.is_convincing:
        tried = _even_so(measurements)
    else:
        told = [h for h in HYPOTHESES if not (by_joints and h in OF_NUMBERS)]
        tried = [*_promising(measurements, told), *_paired(measurements, given)]
    found: list[Alternative] = []
    for hypothesis in tried:
        try:
            explanation = explain(_applied(hypothesis, measurements))
        except HandeyeError:
            continue
        evidence = explanation.log_evidence + hypothesis.log_prior + hypothesis.log_unit
        if evidence > needed and explanation.is_bearable:
            found.append(Alternative(hypothesis, explanation, evidence))
    if not found:
        return None
    best = max(found, key=lambda alternative: alternative.log_evidence)
    others = [a for a in found if a.hypothesis.kind is not best.hypothesis.kind]
    close = [
        other.hypothesis
        for other in others
        if other.log_evidence > best.log_evidence - AS_WELL
        or (other.hypothesis.is_mirror and best.hypothesis.is_mirror)
    ]
    return replace(best, rivals=tuple(close))


def refuse_alternative(
    measurements: Measurements, given: Explanation | None, alternative: Alternative | None
) -> Explanation:
    """Return the explanation of the views as given, where nothing explains them better.

    Raises
    ------
    SharedFaultError
        The code names the fault.
    """
    if alternative is not None:
        raise _told(measurements, given, alternative)
    if given is None:
        raise inconsistent.error(0, len(measurements), math.inf, math.inf)
    if not given.is_bearable_alone:
        raise inconsistent.error(int(given.members.sum()), len(given.members), *given.levels)
    return given


def _told(
    measurements: Measurements, given: Explanation | None, alternative: Alternative
) -> SharedFaultError:
    hypothesis, explanation = alternative.hypothesis, alternative.explanation
    sentence, hint = hypothesis.sentence, hypothesis.hint
    if hypothesis.kind is wrong_direction.KIND:
        fit = explanation.selection.fit
        sentence, hint, mounting = wrong_direction.told(measurements.mounting, fit.X, fit.Y)
        if mounting:
            hypothesis = replace(hypothesis, name="mounting", change=_other_mounting)
    numbers = comparison(explanation, given)
    apart = (
        f"; as given, {numbers['agreeing_as_given']} within "
        f"{numbers['robot_translation_mm_as_given']:.3g} mm and "
        f"{numbers['robot_rotation_deg_as_given']:.2g} deg"
        if given is not None
        else ""
    )
    rivals = alternative.rivals[:MOST_RIVALS]
    sentences = " or that ".join(rival.sentence for rival in rivals)
    as_well = f"; as well it may be that {sentences}" if rivals else ""
    return SharedFaultError(
        f"{sentence}: read so, {numbers['agreeing']} of {numbers['views']} views agree within "
        f"{numbers['robot_translation_mm']:.2g} mm and {numbers['robot_rotation_deg']:.2g} deg"
        f"{apart}{as_well}",
        hypothesis,
        hint=hint,
        as_well=tuple(rival.kind.code for rival in rivals),
    )


def _other_mounting(recording: Recording) -> Recording:
    return replace(recording, mounting=next(m for m in Mounting if m is not recording.mounting))


def comparison(explanation: Explanation, given: Explanation | None) -> dict[str, Any]:
    """Return how many views agree and how well, so and as given."""
    translation, rotation = explanation.levels
    numbers: dict[str, Any] = {
        "views": len(explanation.members),
        "agreeing": int(explanation.members.sum()),
        "robot_translation_mm": translation * 1e3,
        "robot_rotation_deg": float(np.rad2deg(rotation)),
    }
    if given is not None:
        translation, rotation = given.levels
        numbers |= {
            "agreeing_as_given": int(given.members.sum()),
            "robot_translation_mm_as_given": translation * 1e3,
            "robot_rotation_deg_as_given": float(np.rad2deg(rotation)),
        }
    return numbers


def _even_so(measurements: Measurements) -> list[Hypothesis]:
    """Return what may be meant where the views agree as given: motions of few kinds agree with several.

    Turns about two axes through one place may be read backwards, and turns about a point at one distance
    leave the size of the board to small deviations.
    """
    views, seen = measurements.motions, measurements.camera_poses
    limit = NEARLY * _misfit(views, seen, measurements)
    backwards = (
        wrong_direction.hypotheses(measurements)
        if _misfit(inverted(views), seen, measurements) < limit
        else ()
    )
    return [*backwards, *board_size.hypotheses(measurements, smallest=BEARABLE_SCALE)]


def _promising(
    measurements: Measurements, makers: Sequence[Callable[[Measurements], Iterator[Hypothesis]]]
) -> list[Hypothesis]:
    """Return the hypotheses under which X and Y in closed form miss least, of equals the more usual."""
    limit = BETTER_SHARE * _misfit(measurements.motions, measurements.camera_poses, measurements)
    ranked: list[tuple[float, float, int, Hypothesis]] = []
    robot = np.array([view.T_base_flange.matrix for view in measurements.views])
    # Rotation angles between the views are those of the robot, however camera and target are fixed: few
    # readings of the rotations are left then.
    seen = _turns(measurements.camera_poses)
    slack = max(TURN_SLACK_RAD, BETTER_SHARE * _median_gap(_turns(robot), seen))
    every = (hypothesis for hypotheses in makers for hypothesis in hypotheses(measurements))
    for number, hypothesis in enumerate(every):
        try:
            if hypothesis.poses is not None:
                meant = hypothesis.poses(robot)
                if not np.isfinite(meant).all() or _median_gap(_turns(meant), seen) > slack:
                    continue
                in_hand = measurements.mounting is Mounting.EYE_IN_HAND
                misfit = _misfit(
                    inverted(meant) if in_hand else meant, measurements.camera_poses, measurements
                )
            else:
                changed = _applied(hypothesis, measurements)
                misfit = _misfit(changed.motions, changed.camera_poses, changed)
        except (HandeyeError, np.linalg.LinAlgError):
            continue
        if misfit < limit:
            ranked.append((misfit, -hypothesis.log_prior, number, hypothesis))
    ranked.sort(key=lambda entry: (round(math.log(max(entry[0], 1e-12)), 3), entry[1], entry[2]))
    return _different(ranked)


def _applied(hypothesis: Hypothesis, measurements: Measurements) -> Measurements:
    """Return the measurements as they would be meant; raises `SolveError` where few views have a pose so."""
    changed = hypothesis.applied(measurements)
    if len(changed) < max(FEWEST_VIEWS, math.ceil(len(measurements) / 2)):
        raise SolveError(f"{hypothesis.name}: {len(changed)} of {len(measurements)} views show the target")
    return changed


def _different(ranked: Sequence[tuple[float, float, int, Hypothesis]]) -> list[Hypothesis]:
    """Return the first few hypotheses that are not the same but for X and Y, usual and odd ones apart."""
    chosen: list[Hypothesis] = []
    known: set[tuple[str, bool, float]] = set()
    left = {True: MOST_EXPLAINED, False: MOST_EXPLAINED}
    for misfit, *_, hypothesis in ranked:
        # What misses by exactly as much is the same up to a change of X and Y: the most usual stands for all.
        what = (hypothesis.kind.code, hypothesis.poses is None, round(math.log(max(misfit, 1e-12)), 7))
        odd = hypothesis.log_prior <= ODD
        if what not in known and left[odd] > 0:
            chosen.append(hypothesis)
            left[odd] -= 1
        known.add(what)
    return chosen


def _turns(poses: FloatArray) -> FloatArray:
    """Return the rotation angles between all pairs of poses (K, 4, 4)."""
    return angles_between(poses[:, :3, :3], poses[:, :3, :3])[np.triu_indices(len(poses), 1)]


def _median_gap(one: FloatArray, other: FloatArray) -> float:
    return float(np.median(np.abs(one - other)))


def _misfit(motions: FloatArray, poses: FloatArray, measurements: Measurements) -> float:
    """Median distance between chain and images as a share of the working distance, in closed form."""
    centre = target_centre(measurements.target)
    lever = float(np.median(np.linalg.norm(centres(poses, centre), axis=1)))
    kept = np.arange(len(poses))
    away = np.zeros(len(poses))
    for _ in range(2):  # Again without those that fit worst.
        X, Y = closed_forms(motions[np.newaxis, kept], poses[np.newaxis, kept])
        away = distances(X @ motions @ Y, poses, centre, lever)
        kept = np.sort(np.argsort(away)[: max(3, math.ceil(0.7 * len(poses)))])
    return float(np.median(away)) / lever


def _paired(measurements: Measurements, given: Explanation | None) -> Iterator[Hypothesis]:
    """Yield the images paired again with the robot poses, where most of the list is wrong."""
    stations = Stations.of(measurements)
    pairing = find_pairing(stations)
    if pairing is None:
        return
    count = len(stations)
    images = np.flatnonzero(pairing >= 0)
    moved = [(int(i), int(pairing[i])) for i in images if pairing[i] != i]
    # Where the others are enough to tell the rest by, these can be paired again and used.
    if not moved or (given is not None and len(moved) <= count // 2 and given.is_bearable):
        return
    names = [view.name for view in measurements.views]
    left = count - len(images)
    yield Hypothesis(
        view_shuffled.KIND,
        "paired",
        view_shuffled.shuffled_words(names, moved),
        "pair each image with the robot pose at which it was taken",
        _Paired(names, pairing),
        log_prior=left * _typical_mistake(given) - math.lgamma(count + 1),
    )


@dataclass(frozen=True, eq=False)
class _Paired:
    """Images paired with the robot poses of other views; those without one are left out."""

    names: list[str]
    pairing: IndexArray

    def __call__(self, recording: Recording) -> Recording:
        at = {view.name: view for view in recording.views}
        views = [
            replace(
                at[self.names[motion]],
                point_ids=at[self.names[image]].point_ids,
                pixels=at[self.names[image]].pixels,
                sigmas_px=at[self.names[image]].sigmas_px,
                image=at[self.names[image]].image,
            )
            for image, motion in enumerate(self.pairing.tolist())
            if motion >= 0
        ]
        return recording.with_views(sorted(views, key=lambda view: self.names.index(view.name)))


def _typical_mistake(given: Explanation | None) -> float:
    """Logarithm of the density of a mistaken view, for views that a pairing leaves over."""
    if given is None or given.members.all():
        return DENSITY_OF_NO_MISTAKE
    selection = given.selection
    density = selection.fit.log_density + selection.log_odds
    return float(np.median(density[~given.members]))
