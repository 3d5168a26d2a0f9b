"""Choosing where an arm goes next: three small turns first, then the view that teaches most.

Every goal lies within the limits of the joints and can be reached on a free straight path in joint space.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from handeye.estimation import Estimate
from handeye.estimation.estimate import answering
from handeye.planning import Planner, PlannerOptions, Stop, StopReason
from handeye.planning.collisions import Body, Workspace
from handeye.planning.constraints import ViewLimits
from handeye.planning.feasibility import Generator
from handeye.planning.refinement import offered, refine
from handeye.planning.solids import SolidLinks
from handeye.planning.travel import Travel
from handeye.robots import Arm, ArmKinematics
from handeye.robots.protocol import Goal
from handeye.session.deciding import (
    Considered,
    EndReason,
    Halt,
    Situation,
    Step,
    decision_of,
    halt_of,
)
from handeye.session.entry import TRANSIENT, Entry, Failure
from handeye.session.starting import Start, largest_tilt_rad, once_more, starting_goal
from handeye.session.wish import Wish
from handeye.types import Camera, Pose


class ArmChooser:
    """Chooses goals for an arm that is described.

    Parameters
    ----------
    arm, workspace
        The arm, and what no motion may leave.
    camera
        As calibrated.
    start
        Where the arm stood when the session began.
    wish
        What is asked for.
    limits
        What makes a view usable.
    solids
        The shapes of the links; None to judge them by capsules.

    Examples
    --------
    >>> from handeye.session.configuration import prepare
    >>> from handeye.session.settings import Configuration
    >>> prepared = prepare(Configuration("epson_c4l"))  # makes chooser and cell of a simulated arm
    >>> prepared.arm.name
    'epson_c4l'
    """

    def __init__(
        self,
        arm: Arm,
        workspace: Workspace,
        camera: Camera,
        start: Start,
        wish: Wish,
        limits: ViewLimits | None = None,
        solids: SolidLinks | None = None,
    ) -> None:
        self._arm, self._camera = arm, camera
        self._body = Body(arm, workspace, solids=solids)
        self._start = start
        self._wish = wish
        self._generator = Generator(arm, workspace, limits or ViewLimits(), solids=solids)

    @property
    def kinematics(self) -> ArmKinematics | None:
        """The arm, reported in the frames of its description; None if nobody tells joints."""
        return ArmKinematics(self._arm) if self._start.posture_known else None

    def choose(self, situation: Situation) -> Step | Halt:
        """Return the next step, or why there is none."""
        missed, estimate = situation.counted, situation.estimate
        halt = situation.too_many(self._wish.failures_in_a_row) or situation.full(
            self._wish.most_views, "views"
        )
        if halt is not None:
            return halt
        last = situation.to_repeat(self._wish.tries_at_a_place)
        if last is not None:
            goal = self._goal(situation, last.goal, last.goal_joints)
            return Step(goal, "retry", {"after": last.number}, None if situation.doubtful else estimate)
        if estimate is None:
            return self._starting(situation)
        if situation.doubtful:
            # What is seen around the start is judged by no belief, and tells which of the views are wrong.
            step = self._starting(replace(situation, estimate=None))
            if isinstance(step, Step):
                return step
        if missed and missed[-1].failure is Failure.NOT_FOUND and missed[-1].phase == "plan":
            nudge = self._nudge(missed[-1], situation, estimate)
            if nudge is not None:
                return nudge
        return self._planned(situation, estimate)

    def _starting(self, situation: Situation) -> Step | Halt:
        views, missed, estimate = situation.views, situation.counted, situation.estimate
        tries = [entry for entry in missed if entry.failure not in TRANSIENT]
        # The first place is the only one that there is yet.
        if not views and len(tries) >= self._wish.tries_at_a_place:
            last = tries[-1]
            return Halt(
                EndReason.NO_START,
                f"the target is not seen where the arm stands: {last.detail}; drive it so that the "
                "camera sees the whole target, and begin again"
                if last.failure is Failure.NOT_FOUND
                else f"nothing comes of the first view, where the arm stands: {last.failure}: {last.detail}",
            )
        places = len({entry.goal_joints for entry in missed})
        number = len(views)
        if estimate is None:
            number, places = once_more(number, places)
        body = self._body if estimate is None else self._generator.body(estimate)
        tilt_rad = largest_tilt_rad(views[0], self._camera) if views else 0.0
        standing = situation.standing(self._start)
        found = starting_goal(self._start, number, places, tilt_rad, body, standing)
        if found is None:
            return Halt(
                EndReason.NO_START if estimate is None else EndReason.NO_CANDIDATE,
                "no safe pose left around where the arm stood; the workspace or the joint limits are too near"
                if estimate is None
                else "no pose left that the arm can take and that should show the whole target",
            )
        pose, joints = found
        return Step(self._goal(situation, pose, tuple(joints.tolist())), "start", {}, estimate)

    def _nudge(self, last: Entry, situation: Situation, estimate: Estimate) -> Step | None:
        """Return the place half way back from where the target was lost to the nearest view."""
        postures = np.array([situation.joints(view) for view in situation.views])
        lost = np.array(last.goal_joints)
        nearest = postures[int(np.argmin(np.abs(postures - lost).max(axis=1)))]
        joints = 0.5 * (lost + nearest)
        standing = situation.standing(self._start)
        if (
            standing is not None
            and self._generator.body(estimate).obstacle_on_path(standing, joints) is not None
        ):
            return None
        goal = self._goal(situation, Pose(self._arm.forward(joints)), tuple(joints.tolist()))
        return Step(goal, "nudge", {"after": last.number}, estimate)

    def _planned(self, situation: Situation, estimate: Estimate) -> Step | Halt:
        standing = situation.standing(self._start)
        random = np.random.default_rng([self._wish.seed, 4, len(situation.entries)])
        postures = [situation.joints(view) for view in reversed(situation.views)]
        shunned = [
            entry.goal_joints
            for entry in situation.entries
            if entry.failure is not None and entry.failure not in TRANSIENT
        ]
        drawn = self._generator.draw(estimate, postures, random, shunned=shunned)
        options = PlannerOptions(
            policy=self._wish.policy,
            criterion=self._wish.criterion(estimate, situation.measurements),
            stop_rules=() if situation.goes_on else self._wish.rules(),
            sight=drawn.sight,
            seed=self._wish.seed,
            travel=Travel(
                np.array(self._start.joints_rad if standing is None else standing),
                np.minimum(self._arm.velocities, self._wish.speed_rad_s),
            ),
        )
        planner = Planner(situation.measurements, drawn.pool, answering(estimate), options)
        turned_down = dict(drawn.turned_down)
        joints_of = dict(drawn.joints)
        answer = planner.ask()
        climbed: dict[str, dict[str, Any]] = {}
        if self._wish.refine and not isinstance(answer, Stop):
            refined = refine(drawn, planner.gains(), options, random)
            joints_of |= {one.name: one.joints for one in refined}
            climbed = {one.name: {"from": one.seed, "seed_gain": one.seed_gain} for one in refined}
            if refined:
                planner.offer(offered(refined, self._arm))
                answer = planner.ask()
        while not isinstance(answer, Stop):
            name = answer.candidate.name
            # Where a person moves the arm and does not tell its posture, the person sees the way.
            why = (
                None
                if standing is None
                else drawn.constraints.body.obstacle_on_path(standing, joints_of[name])
            )
            if why is None:
                more: dict[str, Any] = {"turned_down": turned_down, "margin_px": drawn.sight.margin_px}
                if name in climbed:
                    more["refined"] = climbed[name]
                pose = answer.candidate.T_base_flange
                goal = self._goal(situation, pose, tuple(joints_of[name].tolist()))
                considered = Considered(planner.pool, planner.gains(), drawn.ruled_out, drawn.reasons)
                # What is in doubt judges no view.
                believed = None if situation.doubtful else estimate
                return Step(
                    goal, "plan", decision_of(answer, estimate, more), believed, considered=considered
                )
            turned_down[f"on the way: {why}"] = turned_down.get(f"on the way: {why}", 0) + 1
            planner.give_up(name)
            answer = planner.ask()
        if answer.reason is StopReason.NO_CANDIDATE:
            # An estimate too young to promise anything: widen it around the start.
            return self._starting(situation)
        return halt_of(answer)

    def _goal(self, situation: Situation, pose: Pose, joints: tuple[float, ...]) -> Goal:
        return Goal(situation.label("view"), pose, joints, self._speed_rad_s)

    @property
    def _speed_rad_s(self) -> float:
        """What was asked for, or what the slowest turning joint can do, if that is less."""
        turning = self._arm.velocities[~np.array(self._arm.sliding)]
        return min([self._wish.speed_rad_s, *turning.tolist()])
