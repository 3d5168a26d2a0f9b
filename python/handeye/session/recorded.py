"""Choosing among views that were recorded: the loop without an arm, on any recording."""

from collections.abc import Sequence

import numpy as np

from handeye.estimation import Estimate
from handeye.estimation.estimate import answering
from handeye.planning import Planner, PlannerOptions, Pool, Stop
from handeye.planning.prediction import Sight
from handeye.planning.travel import Travel
from handeye.robots import Arm, ArmKinematics, arm_kinematics
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
from handeye.session.wish import Wish
from handeye.types import View
from handeye.types.arrays import FloatArray


class RecordedChooser:
    """Chooses goals among recorded views; each is tried once.

    First the first view, then those that turn most from the ones taken, until something is known; from then
    on the view that teaches most. A goal bears the name of the view that it means.

    Parameters
    ----------
    views
        All that were recorded. What they show is not looked at.
    wish
        What is asked for.
    arm
        The arm that they were taken with, if it is known; every view must then have its joints.

    Raises
    ------
    InputError
        The poses are not those of the arm.
    """

    def __init__(self, views: Sequence[View], wish: Wish, arm: Arm | None = None) -> None:
        self._views = tuple(views)
        self._wish = wish
        self._kinematics = None if arm is None else arm_kinematics(arm, views)

    @property
    def kinematics(self) -> ArmKinematics | None:
        """The arm, in the frames of the recorded poses."""
        return self._kinematics

    def choose(self, situation: Situation) -> Step | Halt:
        """Return the next step, or why there is none."""
        tried = {entry.label.rpartition(".")[0] for entry in situation.entries}
        left = [view for view in self._views if view.name not in tried]
        estimate = situation.estimate
        if estimate is not None:
            return self._planned(situation, left, estimate)
        if not left:
            return Halt(
                EndReason.NO_START,
                f"of {len(self._views)} recorded views {len(situation.views)} could be used: too few",
            )
        return Step(self._goal(_most_turned(left, situation.views)), "start", {}, None)

    def _planned(self, situation: Situation, left: list[View], estimate: Estimate) -> Step | Halt:
        pool = Pool.of_views(left)
        options = PlannerOptions(
            policy=self._wish.policy,
            criterion=self._wish.criterion(estimate, situation.measurements),
            stop_rules=() if situation.goes_on else self._wish.rules(),
            sight=Sight(known=True),
            seed=self._wish.seed,
            travel=self._travel(situation, pool),
        )
        planner = Planner(situation.measurements, pool, answering(estimate), options)
        answer = planner.ask()
        if isinstance(answer, Stop):
            halt = halt_of(answer)
            if halt.reason is not EndReason.NO_CANDIDATE:
                return halt
            return Halt(halt.reason, f"none of the {len(self._views)} recorded views is left")
        view = next(view for view in left if view.name == answer.candidate.name)
        considered = Considered(planner.pool, planner.gains())
        return Step(
            self._goal(view), "plan", decision_of(answer, estimate, {}), estimate, considered=considered
        )

    def _goal(self, view: View) -> Goal:
        return Goal(f"{view.name}.1", view.T_base_flange, view.joints_rad, self._wish.speed_rad_s)

    def _travel(self, situation: Situation, pool: Pool) -> Travel | None:
        """Return how the arm moved, where the joints tell."""
        start, joints = situation.views[-1].joints_rad, pool.joints
        if start is None or joints is None:
            return None
        speeds: FloatArray = np.full(len(start), self._wish.speed_rad_s)
        if self._kinematics is not None:
            speeds = np.minimum(speeds, self._kinematics.arm.velocities)
        return Travel(np.array(start), speeds)


def _most_turned(left: Sequence[View], taken: Sequence[View]) -> View:
    """Return the view whose least turn from those taken is largest; without any the first."""
    if not taken:
        return left[0]
    least = [
        min((view.T_base_flange.inverse() @ other.T_base_flange).rotation_angle_rad for other in taken)
        for view in left
    ]
    return left[int(np.argmax(least))]
