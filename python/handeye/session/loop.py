"""The closed loop: choose, go, look, write down, until the accuracy asked for is reached.

What happens next is a function of the journal and the seed alone: after a break the same decisions follow.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from typing import Any

import numpy as np

from handeye.detection import Detection
from handeye.errors import HandeyeError, InputError, OutputError
from handeye.planning import Planner, PlannerOptions, Proposal, Stop, StopReason
from handeye.planning.feasibility import Generator
from handeye.planning.policies import Policy
from handeye.planning.policies.next_best_view import NextBestView
from handeye.planning.refinement import offered, refine
from handeye.planning.sieve import ViewLimits
from handeye.planning.stopping import NumberOfViews, StopRule
from handeye.planning.travel import Travel
from handeye.robots import ArmKinematics
from handeye.robots.protocol import Goal, Reading
from handeye.session.attempt import Cell, Missed, Seen, attempt, encoded
from handeye.session.entry import TRANSIENT, Entry, Failure
from handeye.session.judging import foreseen, labeled, objection
from handeye.session.request import Reach, Requested, reach
from handeye.session.starting import Start, starting_goal
from handeye.session.store import SessionStore
from handeye.solving import Estimate, Estimator, Measurements, calibrate_examined, make_estimator, view_pose
from handeye.solving.estimate import Sight
from handeye.solving.mistakes import examine
from handeye.types import Pose, View
from handeye.types.calibration import Calibration, ModelName

START_VIEWS = 3
# Fewer views than these cannot speak against one of them.
FEWEST_EXAMINED = 5
_WRITE_PAUSE_S = 0.2


class EndReason(StrEnum):
    """How a run ended."""

    ACCURACY_REACHED = "accuracy_reached"
    VIEWS_TAKEN = "views_taken"
    NO_CANDIDATE = "no_candidate"
    NO_START = "no_start"
    TOO_MANY_FAILURES = "too_many_failures"


# Ends without an answer.
FAILED = (EndReason.NO_START, EndReason.TOO_MANY_FAILURES)


@dataclass(frozen=True)
class Wish:
    """What is asked for.

    Parameters
    ----------
    accuracy_mm, accuracy_deg
        Radii within which the error shall lie with 95 % probability; None to take all views.
    most_views
        Stop at so many views in any case.
    seed
        Of every choice by chance.
    failures_in_a_row
        Stop after so many attempts without a view.
    tries_at_a_place
        Attempts at one goal where nothing says that the place is to blame.
    speed_rad_s
        No joint moves faster.
    joints_err
        Weigh noise and offsets of the joints as causes of error: the description of the arm is known anyway.
    refine
        Climb from the best candidates to better ones near them, rather than take the best that was drawn.

    Raises
    ------
    InputError
        A value out of its range.
    """

    accuracy_mm: float | None = 0.5
    accuracy_deg: float | None = 0.05
    most_views: int = 20
    seed: int = 0
    model: ModelName = ModelName.AUTO
    failures_in_a_row: int = 10
    tries_at_a_place: int = 3
    speed_rad_s: float = 0.5
    joints_err: bool = True
    refine: bool = True
    policy: Policy = field(default_factory=NextBestView)

    def __post_init__(self) -> None:
        self.rules()  # checks what they check
        if not 0 < self.speed_rad_s < float("inf") or min(self.failures_in_a_row, self.tries_at_a_place) < 1:
            raise InputError("a speed above zero and at least one attempt are needed", code="out_of_range")

    def rules(self) -> tuple[StopRule, ...]:
        """Return when to stop, in the order asked."""
        number = NumberOfViews(self.most_views)
        if self.accuracy_mm is None or self.accuracy_deg is None:
            return (number,)
        return Requested(self.accuracy_mm, self.accuracy_deg), number


@dataclass(frozen=True, eq=False)
class Step:
    """What to do next, and how it was decided."""

    goal: Goal
    phase: str
    decision: dict[str, Any]
    estimate: Estimate | None


@dataclass(frozen=True, eq=False)
class End:
    """How a run ended: the answer if the views determine one, and how far off it may be."""

    reason: EndReason
    sentence: str
    calibration: Calibration | None
    reach: Reach | None
    views: int
    attempts: int


Progress = Callable[[Entry, Estimate | None], None]


class Session:
    """Runs the loop on a cell and writes every attempt into a store.

    Parameters
    ----------
    cell
        The world.
    store
        Open session.
    start
        Where the arm stood when the session began.
    wish
        What is asked for.
    generator_limits
        What makes a view usable.
    progress
        Told of every attempt.
    """

    def __init__(
        self,
        cell: Cell,
        store: SessionStore,
        start: Start,
        wish: Wish,
        limits: ViewLimits | None = None,
        progress: Progress | None = None,
    ) -> None:
        self._cell = cell
        self._store = store
        self._start = start
        self._wish = wish
        self._generator = Generator(cell.arm, cell.workspace, limits or ViewLimits())
        self._progress = progress
        known = wish.joints_err and wish.model is ModelName.AUTO
        self._kinematics = ArmKinematics(cell.arm) if known else None
        self._estimator: Estimator = make_estimator(wish.model, self._kinematics)
        self._measurements = Measurements.of(store.recording.mounting, cell.camera, cell.target)

    def run(self) -> End:
        """Run until the end; an interruption stops the arm first and leaves the session whole.

        Raises
        ------
        OutputError
            The disk does not take an attempt, also not when asked again.
        """
        try:
            while True:
                step = self.next()
                if isinstance(step, End):
                    return step
                self._take(step)
        except BaseException:
            self._cell.stop()
            raise

    def next(self) -> Step | End:
        """Decide what to do next, without doing it."""
        began = time.monotonic()
        entries = self._store.entries
        views = [entry.view for entry in entries if entry.view is not None]
        missed = _failures_at_end(entries)
        if len(missed) >= self._wish.failures_in_a_row:
            last = missed[-1]
            return self._end(
                EndReason.TOO_MANY_FAILURES,
                f"{len(missed)} attempts in a row brought no view; the last: {last.failure}: {last.detail}",
            )
        measurements = _without_mistakes(self._with(views))
        if len(measurements) < len(views) and len(views) >= self._wish.most_views:
            return self._end(EndReason.VIEWS_TAKEN, f"{len(views)} views taken, as asked")
        estimate = self._estimator(measurements) if len(measurements) >= START_VIEWS else None
        again = self._same_place(missed, estimate)
        if again is not None:
            return again
        if estimate is None:
            return self._starting(views, missed, None)
        if missed and missed[-1].failure is Failure.NOT_FOUND and missed[-1].phase == "plan":
            nudge = self._nudge(missed[-1], views, estimate)
            if nudge is not None:
                return nudge
        step = self._planned(views, missed, measurements, estimate)
        if isinstance(step, Step):
            step.decision["seconds"] = time.monotonic() - began
        return step

    def _with(self, views: list[View]) -> Measurements:
        """Return the measurements of these views; those measured before are not measured again."""
        known = {view.name for view in self._measurements.views} | set(self._measurements.rejected)
        self._measurements = self._measurements.with_views(view for view in views if view.name not in known)
        return self._measurements

    # Choosing

    def _same_place(self, missed: list[Entry], estimate: Estimate | None) -> Step | None:
        """Return another try at the last goal, if it failed for no reason of its own."""
        if not missed or missed[-1].failure not in TRANSIENT:
            return None
        last = missed[-1]
        tries = sum(1 for entry in missed if entry.goal_joints == last.goal_joints)
        if tries >= self._wish.tries_at_a_place:
            return None
        return Step(self._goal(last.goal, last.goal_joints), "retry", {"after": last.number}, estimate)

    def _starting(self, views: list[View], missed: list[Entry], estimate: Estimate | None) -> Step | End:
        if not views and missed and missed[-1].failure is Failure.NOT_FOUND:
            tries = sum(1 for entry in missed if entry.failure is Failure.NOT_FOUND)
            if tries >= self._wish.tries_at_a_place:
                return self._end(
                    EndReason.NO_START,
                    f"the target is not seen where the arm stands: {missed[-1].detail}; drive it so that the "
                    "camera sees the whole target, and begin anew",
                )
        places = len({entry.goal_joints for entry in missed})
        found = starting_goal(
            self._start, views, places, self._cell.camera, self._cell.arm, self._cell.workspace
        )
        if found is None:
            return self._end(
                EndReason.NO_START if estimate is None else EndReason.NO_CANDIDATE,
                "no safe pose left around where the arm stood; the workspace or the joint limits are too near"
                if estimate is None
                else "no pose left that the arm can take and that should show the whole target",
            )
        pose, joints = found
        return Step(self._goal(pose, tuple(joints.tolist())), "start", {}, estimate)

    def _nudge(self, last: Entry, views: list[View], estimate: Estimate) -> Step | None:
        """Return the place half way back from where the target was lost to the nearest view."""
        postures = np.array([self._joints(view) for view in views])
        lost = np.array(last.goal_joints)
        nearest = postures[int(np.argmin(np.abs(postures - lost).max(axis=1)))]
        joints = 0.5 * (lost + nearest)
        if self._generator.body(estimate).obstacle_on_path(self._standing(), joints) is not None:
            return None
        pose = Pose(self._cell.arm.forward(joints))
        return Step(self._goal(pose, tuple(joints.tolist())), "nudge", {"after": last.number}, estimate)

    def _planned(
        self, views: list[View], missed: list[Entry], measurements: Measurements, estimate: Estimate
    ) -> Step | End:
        random = np.random.default_rng([self._wish.seed, 4, len(self._store.entries)])
        postures = [self._joints(view) for view in reversed(views)]
        shunned = [
            entry.goal_joints
            for entry in self._store.entries
            if entry.failure is not None and entry.failure not in TRANSIENT
        ]
        drawn = self._generator.draw(estimate, postures, random, shunned=shunned)
        options = PlannerOptions(
            policy=self._wish.policy,
            stop_rules=self._wish.rules(),
            sight=drawn.sight,
            seed=self._wish.seed,
            travel=self._travel(),
        )
        planner = Planner(measurements, drawn.pool, _known(estimate), options)
        turned_down = dict(drawn.turned_down)
        joints_of = dict(drawn.joints)
        answer = planner.ask()
        climbed: dict[str, dict[str, Any]] = {}
        if self._wish.refine and not isinstance(answer, Stop):
            refined = refine(drawn, planner.gains(), options, random)
            joints_of |= {one.name: one.joints for one in refined}
            climbed = {one.name: {"from": one.seed, "seed_gain": one.seed_gain} for one in refined}
            if refined:
                planner.offer(offered(refined, self._cell.arm))
                answer = planner.ask()
        while not isinstance(answer, Stop):
            name = answer.candidate.name
            why = drawn.sieve.body.obstacle_on_path(self._standing(), joints_of[name])
            if why is None:
                decision = _decision(answer, drawn.sight, turned_down, estimate)
                if name in climbed:
                    decision["refined"] = climbed[name]
                goal = self._goal(answer.candidate.T_base_flange, tuple(joints_of[name].tolist()))
                return Step(goal, "plan", decision, estimate)
            turned_down[f"on the way: {why}"] = turned_down.get(f"on the way: {why}", 0) + 1
            planner.give_up(name)
            answer = planner.ask()
        if answer.reason is StopReason.NO_CANDIDATE:
            # An estimate too young to promise anything: widen it around the start.
            return self._starting(views, missed, estimate)
        reason = (
            EndReason.ACCURACY_REACHED
            if answer.reason is StopReason.ACCURACY_REACHED
            else EndReason.VIEWS_TAKEN
        )
        return self._end(reason, answer.sentence)

    def _travel(self) -> Travel:
        fastest = np.minimum(self._cell.arm.velocities, self._wish.speed_rad_s)
        return Travel(np.array(self._standing()), fastest)

    def _goal(self, pose: Pose, joints: tuple[float, ...]) -> Goal:
        entries = self._store.entries
        number = 1 + sum(1 for entry in entries if entry.view is not None)
        attempt_number = 1 + len(_failures_at_end(entries))
        return Goal(f"view_{number:02d}.{attempt_number}", pose, joints, self._wish.speed_rad_s)

    def _joints(self, view: View) -> tuple[float, ...]:
        """Return the joints of a view; where the robot does not tell them, those that it was sent to."""
        if view.joints_rad is not None:
            return view.joints_rad
        entry = next(e for e in self._store.entries if e.view is not None and e.view.name == view.name)
        return entry.goal_joints

    def _standing(self) -> tuple[float, ...]:
        """Return the joints where the arm stands, as far as the journal knows."""
        for entry in reversed(self._store.entries):
            if entry.view is not None:
                return self._joints(entry.view)
            if entry.moved:
                return entry.goal_joints
        return self._start.joints_rad

    # Taking

    def _take(self, step: Step) -> None:
        timings = {"decide": float(step.decision.pop("seconds", 0.0))}
        digests = frozenset(e.image_digest for e in self._store.entries if e.image_digest is not None)
        foresee = partial(foreseen, self._cell.camera, self._cell.target, step.estimate)
        outcome = attempt(self._cell, step.goal, digests, timings, foresee)
        number = len(self._store.entries) + 1
        if isinstance(outcome, Seen):
            outcome = self._judged(step, outcome)
        if isinstance(outcome, Missed):
            entry = Entry(
                number,
                step.goal.label,
                step.phase,
                step.goal.T_base_flange,
                step.goal.joints_rad or (),
                outcome.moved,
                failure=outcome.failure,
                detail=outcome.detail[:500],
                decision=step.decision,
                timings_s=timings,
                image_digest=outcome.digest,
            )
            image = None
        else:
            view, seen = outcome
            entry = Entry(
                number,
                step.goal.label,
                step.phase,
                step.goal.T_base_flange,
                step.goal.joints_rad or (),
                moved=True,
                view=view,
                detail=seen.note,
                decision=step.decision,
                timings_s=timings,
                image_digest=seen.digest,
            )
            image = None if seen.image is None else encoded(seen.image)
        self._write(entry, image)
        if self._progress is not None:
            self._progress(entry, step.estimate)

    def _judged(self, step: Step, seen: Seen) -> tuple[View, Seen] | Missed:
        cell, estimate = self._cell, step.estimate
        name = step.goal.label.rpartition(".")[0]
        detection = self._labels(seen, estimate)
        image = None if seen.image is None else f"images/{name}.png"
        joints = seen.reading.joints_rad
        try:
            view = View(
                name,
                seen.reading.T_base_flange,
                detection.point_ids,
                detection.pixels,
                image,
                seen.timestamp_s,
                joints if joints is not None else self._joints_of(seen.reading, step.goal),
            )
            self._store.recording.with_views((*self._store.recording.views, view))
        except HandeyeError as error:
            return Missed(Failure.BAD_IMAGE, error.message, moved=True, digest=seen.digest)
        why = objection(cell.camera, cell.target, view, estimate, len(self._store.recording.views))
        if why is not None:
            return Missed(Failure.INCONSISTENT, why, moved=True, digest=seen.digest)
        return view, seen

    def _labels(self, seen: Seen, estimate: Estimate | None) -> Detection:
        cell = self._cell
        views = self._store.recording.views
        if estimate is not None:
            A = estimate.mounting.chain(seen.reading.T_base_flange)
            expected = estimate.X @ A @ estimate.Y
        elif views:
            # The first moves turn little: the board looks as it did at first.
            expected = view_pose(cell.camera, cell.target, views[0]).T_camera_target
        else:
            return seen.detection
        return labeled(cell.camera, cell.target, seen.detection, seen.reading.T_base_flange, expected)

    def _joints_of(self, reading: Reading, goal: Goal) -> tuple[float, ...] | None:
        """Return joints for a pose that came without, None where the description does not reach it."""
        start = np.array(goal.joints_rad) if goal.joints_rad is not None else None
        found, reached = self._cell.arm.inverse_all(
            reading.T_base_flange.matrix[np.newaxis], start, attempts=1
        )
        return tuple(found[0].tolist()) if reached[0] else None

    def _write(self, entry: Entry, image: bytes | None) -> None:
        """Write an attempt down; where the disk refuses, wait and ask again before giving up."""
        for patience in (1, 2, 0):
            try:
                if len(self._store.entries) >= entry.number:  # written, but the recording lagged behind
                    return
                if image is not None and entry.view is not None:
                    self._store.keep_image(entry.view.name, image)
                self._store.append(entry)
                return
            except OutputError:
                if patience == 0:
                    raise
                time.sleep(patience * _WRITE_PAUSE_S)

    # Ending

    def _end(self, reason: EndReason, sentence: str) -> End:
        entries = self._store.entries
        views = [entry.view for entry in entries if entry.view is not None]
        calibration, radii = None, None
        measurements = self._with(views)
        if len(measurements) >= START_VIEWS:
            try:
                examination = examine(measurements)
            except InputError as error:
                if reason not in FAILED:
                    raise
                # What all views share may well be why nothing came of the attempts.
                return End(reason, f"{sentence}; {error.message}", None, None, len(views), len(entries))
            estimate = self._estimator(examination.measurements)
            if estimate.determined:
                calibration = calibrate_examined(examination, self._wish.model, kinematics=self._kinematics)
                radii = reach(estimate)
        return End(reason, sentence, calibration, radii, len(views), len(entries))


def _failures_at_end(entries: tuple[Entry, ...]) -> list[Entry]:
    """Return the attempts since the last view."""
    missed: list[Entry] = []
    for entry in reversed(entries):
        if entry.view is not None:
            break
        missed.append(entry)
    return missed[::-1]


def _without_mistakes(measurements: Measurements) -> Measurements:
    """Return what is left to plan from: one wrong view would make all the others look uncertain."""
    if len(measurements) < FEWEST_EXAMINED:
        return measurements
    try:
        return examine(measurements).measurements
    except InputError:
        return measurements  # Shared by all of them; said at the end.


def _known(estimate: Estimate) -> Estimator:
    """Return what answers with an estimate that is there already."""

    def answer(measurements: Measurements, previous: Estimate | None = None) -> Estimate:
        del measurements, previous
        return estimate

    return answer


def _decision(
    answer: Proposal, sight: Sight, turned_down: dict[str, int], estimate: Estimate
) -> dict[str, Any]:
    now = reach(estimate)
    return {
        "predicted_gain": answer.predicted_gain,
        "candidates": {
            name: round(float(gain), 6)
            for name, gain in zip(answer.names, answer.gains, strict=True)
            if np.isfinite(gain)
        },
        "turned_down": turned_down,
        "margin_px": sight.margin_px,
        "reach_before": {"translation_mm": now.translation_mm, "rotation_deg": now.rotation_deg},
    }
