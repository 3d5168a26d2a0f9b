"""Look for mistakes before anything is estimated: name them, leave out what is wrong, use what is right."""

from dataclasses import dataclass, field, replace

import numpy as np

from handeye.errors import HandeyeError
from handeye.estimation.faults.alternatives import find_alternative, refuse_alternative
from handeye.estimation.faults.explanation import Explanation, explain
from handeye.estimation.faults.kinds import repeated_view, stale_poses, wrong_unit
from handeye.estimation.faults.kinds.view_flipped import flipped_finding
from handeye.estimation.faults.kinds.view_shuffled import pairing_words, shuffled_finding
from handeye.estimation.faults.lone import lone_finding
from handeye.estimation.faults.pictures import FEWEST_VIEWS, check_lens, examine_pictures
from handeye.estimation.faults.points import without_gross_points
from handeye.estimation.faults.relabel import Relabeling, shifts
from handeye.estimation.faults.selection import weigh_pairs
from handeye.estimation.faults.shuffles import Pairing, pair_suspects
from handeye.estimation.measurements import Measurements, ViewPose
from handeye.types.calibration import Calibration, Finding
from handeye.types.recording import Recording
from handeye.types.view import View


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
    notes: dict[str, str] = field(default_factory=dict[str, str])

    def among(self, given: Measurements) -> Measurements:
        """Return the given measurements with the views that are left as they are used."""
        kept = {
            view.name: (view, pose)
            for view, pose in zip(self.measurements.views, self.measurements.poses, strict=True)
        }
        both = [
            kept.get(view.name, (view, pose)) for view, pose in zip(given.views, given.poses, strict=True)
        ]
        return replace(given, views=tuple(view for view, _ in both), poses=tuple(pose for _, pose in both))

    def told(self, calibration: Calibration) -> Calibration:
        """Return a calibration of the measurements that says what was found."""
        views = tuple(
            replace(view, reason=self.notes.get(view.name, "")) if view.used else view
            for view in calibration.views
        )
        return replace(calibration, views=views, diagnosis=(*self.findings, *calibration.diagnosis))


def measured(recording: Recording) -> Measurements:
    """Return the measurements of a recording.

    Raises
    ------
    SharedFaultError
        Through the camera as stated most views show nothing, and another camera shows them.
    """
    measurements = Measurements.of_recording(recording)
    if 2 * len(measurements) < len(recording):
        check_lens(recording)
    return measurements


def examine(measurements: Measurements, *, by_joints: bool = False) -> Examination:
    """Find the mistakes in measurements.

    Parameters
    ----------
    measurements
        The views.
    by_joints
        Whether the poses are those of the joints, by the description of the arm: then they cannot be
        written in another way than they are read.

    Raises
    ------
    InputError
        All views share a mistake: a wrong direction, unit or convention, or images filed with the wrong
        poses; the code names it. Or nothing explains the views.
    """
    if len(measurements) < FEWEST_VIEWS:
        return Examination(measurements)
    wrong_unit.check(measurements)
    stale_poses.check(measurements)
    measurements, findings = repeated_view.without_repeated(measurements)
    if len(measurements) < FEWEST_VIEWS:
        return Examination(measurements, findings)
    findings += examine_pictures(measurements)
    measurements, of_points = without_gross_points(measurements)
    findings += of_points
    if len(measurements) < FEWEST_VIEWS:
        return Examination(measurements, findings)
    explanation = _explained(measurements)
    if explanation is None or not explanation.is_convincing:
        examine_pictures(measurements, closely=True)
    alternative = find_alternative(measurements, explanation, by_joints=by_joints)
    explanation = refuse_alternative(measurements, explanation, alternative)
    examination = _sort_out(measurements, explanation)
    return replace(examination, findings=(*findings, *examination.findings))


def _explained(measurements: Measurements) -> Explanation | None:
    """Return the explanation of the views as given, None where they are as far apart as no noise explains."""
    try:
        return explain(measurements)
    except HandeyeError:
        return None


def _sort_out(measurements: Measurements, explanation: Explanation) -> Examination:
    """Put right what can be, leave out the rest, and say so."""
    sorting = _Sorting(measurements, explanation)
    sorting.take_members()
    sorting.pair_anew()
    sorting.look_at_the_rest()
    return sorting.result()


class _Sorting:
    """The views that are taken so far, and what was said of the others."""

    def __init__(self, measurements: Measurements, explanation: Explanation) -> None:
        self._given, self._explanation = measurements, explanation
        self._names = [view.name for view in measurements.views]
        self._taken: dict[int, tuple[View, ViewPose]] = {}
        self._rejected = dict(measurements.rejected)
        self._findings: list[Finding] = []
        self._notes: dict[str, str] = {}

    def take_members(self) -> None:
        """Take the views that belong, with the labels under which they do."""
        flips: dict[int, list[int]] = {}
        for k in np.flatnonzero(self._explanation.members).tolist():
            label = int(self._explanation.labels[k])
            self._taken[k] = self._read(k, label)
            kind = label % len(self._explanation.readings.relabelings)
            if kind:
                flips.setdefault(kind, []).append(k)
        for kind, flipped in flips.items():
            self._say_flipped(self._explanation.readings.relabelings[kind], flipped)

    def pair_anew(self) -> None:
        """Pair the images of the others with the robot poses that they fit, where that leaves no doubt."""
        pairings = pair_suspects(self._explanation.selection, self._explanation.readings)
        if not pairings:
            return
        applied = _closed(pairings, self._explanation)
        for pairing in applied:
            view, pose = self._read(pairing.image, pairing.label)
            at = self._given.views[pairing.motion]
            paired = replace(
                at, point_ids=view.point_ids, pixels=view.pixels, sigmas_px=view.sigmas_px, image=view.image
            )
            self._taken[pairing.motion] = (paired, pose)
            self._notes[at.name] = f"with the picture of {view.name}"
        pairs = [(pairing.image, pairing.motion) for pairing in pairings]
        self._findings.append(shuffled_finding(self._names, pairs, applied=len(applied) == len(pairings)))
        for pairing in pairings:
            if pairing not in applied:
                image, motion = self._names[pairing.image], self._names[pairing.motion]
                self._rejected[image] = pairing_words(image, motion)

    def look_at_the_rest(self) -> None:
        """Read part of a board as another part of it, or name what is wrong and leave the view out."""
        for k, name in enumerate(self._names):
            if k in self._taken or name in self._rejected:
                continue
            shifted = _shifted(self._given, self._explanation, k)
            if shifted is not None:
                self._taken[k] = (
                    shifted.applied(self._given.views[k]),
                    shifted.applied_to_pose(self._given.poses[k]),
                )
                self._say_flipped(shifted, [k])
                continue
            finding = lone_finding(self._given, self._explanation, k)
            self._findings.append(finding)
            self._rejected[name] = finding.sentence.removeprefix(f"{name}: ")

    def result(self) -> Examination:
        """Return what is left, in the order given."""
        taken = [self._taken[k] for k in sorted(self._taken)]
        kept = replace(
            self._given,
            views=tuple(view for view, _ in taken),
            poses=tuple(pose for _, pose in taken),
            rejected=self._rejected,
        )
        return Examination(kept, tuple(self._findings), self._notes)

    def _read(self, k: int, label: int) -> tuple[View, ViewPose]:
        """Return a view and its pose under one of its readings."""
        relabelings = self._explanation.readings.relabelings
        view, pose = self._given.views[k], self._given.poses[k]
        if label >= len(relabelings) and pose.mirrored is not None:
            other = (pose.T_camera_target, pose.rmse_px)
            pose = replace(pose, T_camera_target=pose.mirrored[0], rmse_px=pose.mirrored[1], mirrored=other)
        kind = label % len(relabelings)
        if kind == 0:
            return view, pose
        return relabelings[kind].applied(view), relabelings[kind].applied_to_pose(pose)

    def _say_flipped(self, relabeling: Relabeling, flipped: list[int]) -> None:
        names = [self._names[k] for k in flipped]
        for name in names:
            self._notes[name] = f"labels {relabeling.words}, read again"
        self._findings.append(flipped_finding(names, relabeling.words, relabeling.looks_the_same))


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


def _shifted(measurements: Measurements, explanation: Explanation, k: int) -> Relabeling | None:
    """Return the labels under which a view that shows part of the target belongs, if there are such."""
    view = measurements.views[k]
    candidates = shifts(measurements.target, view.point_ids, list(explanation.readings.relabelings))
    if not candidates:
        return None
    poses = measurements.poses[k].T_camera_target.matrix @ np.array([c.factor for c in candidates])
    selection = explanation.selection
    # Only those that come near: there are as many as there are points.
    agreement = selection.agreement
    chain = agreement.X @ agreement.stations.motions[k] @ agreement.Y
    near = np.argsort(np.linalg.norm(poses[:, :3, 3] - chain[:3, 3], axis=1))[:8]
    at = np.full(len(near), k)
    odds, _ = weigh_pairs(selection, at, at, poses[near])
    best = int(np.argmin(odds))
    return candidates[int(near[best])] if odds[best] < 0 else None
