"""Choosing where an arm goes next with several cameras: small turns first, then where all of them learn most.

The chance in a decision follows from the seed and the attempts so far.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye.estimation import RigEstimate
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.collisions import Body, Workspace
from handeye.planning.constraints import ViewLimits
from handeye.planning.prediction import Sight
from handeye.planning.rig import rig_gains
from handeye.planning.rig_request import FEWEST_STATIONS, RigRequest, rig_touch_map
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm, ArmKinematics
from handeye.robots.protocol import Goal
from handeye.session.deciding import Attempts, Considered, EndReason, Halt, Step
from handeye.session.safety import body_of
from handeye.session.starting import LARGEST_TILT_RAD, Start, largest_tilt_rad, once_more, starting_goal
from handeye.session.wish import Wish
from handeye.types import Pose, RigRecording, Station
from handeye.types.arrays import FloatArray
from handeye.types.units import MM_PER_M

# The phase of a step back.
BACK = "back"
# Postures are drawn about those of the stations, some near and some far.
SPREADS_RAD = (0.1, 0.8)
# Candidates whose straight path is looked at.
MOST_PATHS = 24
# What a belief may be off in the image.
SAFETY_PX = 5.0


@dataclass(frozen=True, eq=False)
class RigSituation(Attempts):
    """Everything that a decision follows from with several cameras, besides what was asked for.

    Parameters
    ----------
    stations
        What the attempts brought, without what was withdrawn.
    believed
        What is believed; None while the stations do not determine every camera.
    """

    stations: tuple[Station, ...]
    believed: RigEstimate | None

    @property
    def taken(self) -> int:
        """Return how many stations count."""
        return len(self.stations)

    @property
    def is_open(self) -> bool:
        """Tell whether the stations are in doubt or do not determine every camera."""
        return self.doubtful or self.believed is None


class RigChooser:
    """Chooses goals for an arm that is described, and several cameras.

    Parameters
    ----------
    arm, workspace
        The arm, and what no motion may leave.
    recording
        Whose cameras and targets these are.
    start
        Where the arm stood when the session began.
    wish
        What is asked for.
    solids
        The shapes of the links; None to judge them by capsules.
    candidates
        Postures drawn at every step.
    limits
        What makes a view usable.
    """

    def __init__(
        self,
        arm: Arm,
        workspace: Workspace,
        recording: RigRecording,
        start: Start,
        wish: Wish,
        solids: SolidLinks | None = None,
        *,
        candidates: int,
        limits: ViewLimits,
    ) -> None:
        self._arm, self._workspace, self._solids = arm, workspace, solids
        self._recording, self._start, self._wish = recording, start, wish
        self._request = request_of(wish)
        self._candidates = candidates
        self._limits = limits
        self._sight = Sight(margin_px=limits.margin_px + SAFETY_PX, fewest=limits.fewest)

    @property
    def kinematics(self) -> ArmKinematics | None:
        """The arm; None if nobody tells joints, or it shall not take part in the estimate."""
        known = self._start.posture_known and self._wish.joints_err
        return ArmKinematics(self._arm) if known else None

    def choose(self, situation: RigSituation) -> Step | Halt:
        """Return the next step, or why there is none."""
        count, believed = len(situation.stations), situation.believed
        if believed is not None and not situation.doubtful and self._met(believed, count):
            reached = f"with 95 % probability {_reached(believed, self._wish)}, as asked"
            return Halt(EndReason.ACCURACY_REACHED, reached)
        if not situation.is_open and count >= self._wish.most_views:
            return Halt(EndReason.VIEWS_TAKEN, f"{count} stations taken, as asked")
        halt = situation.too_many(self._wish.failures_in_a_row) or situation.full(
            self._wish.most_views, "stations"
        )
        if halt is not None:
            return halt
        last = situation.to_repeat(self._wish.tries_at_a_place)
        if last is not None:
            goal = Goal(situation.label("station"), last.goal, last.goal_joints, self._wish.speed_rad_s)
            return Step(goal, "retry", {"after": last.number}, None, believed=believed)
        if believed is None:
            return self._starting(situation)
        return self._planned(situation, believed)

    def _met(self, believed: RigEstimate, count: int) -> bool:
        return self._request is not None and count >= FEWEST_STATIONS and not self._request.missing(believed)

    def _random(self, situation: RigSituation) -> np.random.Generator:
        return np.random.default_rng([self._wish.seed, 4, len(situation.entries)])

    def _starting(self, situation: RigSituation) -> Step | Halt:
        """Turn a little about the start; the other way, and then less, after a turn that lost a target."""
        seen = [self._moving(station) for station in situation.stations]
        tilts = [
            largest_tilt_rad(one.view, self._recording.cameras[one.camera].camera)
            for station in situation.stations[:1]
            for one in station.views
            if (one.camera, one.target) in seen[0]
        ]
        number, failures = _turns(seen)
        cameras = self._recording.cameras
        blind = [name for name in cameras if all(name != c for pairs in seen for c, _ in pairs)]
        if not blind:
            number, failures = once_more(number, failures)
        found = starting_goal(
            self._start,
            number,
            failures + len(situation.counted),
            min(tilts, default=LARGEST_TILT_RAD),
            body_of(self._arm, self._workspace, self._solids, situation.believed),
            situation.standing(self._start),
        )
        if found is None:
            return Halt(
                EndReason.NO_START,
                f"not tied to the arm by turns about where it stands: {', '.join(blind or cameras)}; "
                "drive it to where every camera sees a target, away from the ends of the workspace and of "
                "the joints, and begin again",
            )
        pose, joints = found
        goal = Goal(situation.label("station"), pose, tuple(joints.tolist()), self._wish.speed_rad_s)
        return Step(goal, "start", {}, None, believed=situation.believed)

    def _moving(self, station: Station) -> set[tuple[str, str]]:
        """Return the cameras and targets of a station that the arm moves against each other."""
        cameras, targets = self._recording.cameras, self._recording.targets
        return {
            (one.camera, one.target)
            for one in station.views
            if cameras[one.camera].body is not targets[one.target].body
        }

    def _planned(self, situation: RigSituation, believed: RigEstimate) -> Step | Halt:
        random = self._random(situation)
        known = np.array([situation.joints(station) for station in situation.stations])
        around = known[random.integers(0, len(known), self._candidates)]
        spread = random.uniform(*SPREADS_RAD, (len(around), 1))
        joints = around + spread * random.standard_normal(around.shape)
        body = body_of(self._arm, self._workspace, self._solids, believed)
        joints = joints[[self._arm.within_limits(q) for q in joints]]
        joints = joints[np.array([why is None for why in body.obstacles(joints)], dtype=bool)]
        poses = self._arm.forward(joints)
        pool = Pool(
            tuple(
                Candidate(f"candidate_{k}", Pose(pose), tuple(q))
                for k, (pose, q) in enumerate(zip(poses, joints.tolist(), strict=True))
            )
        )
        missing = {} if self._request is None else self._request.missing(believed)
        found = rig_gains(believed, pool, missing, self._sight, self._limits)
        reached = self._reached(situation, joints, -np.nan_to_num(found.gains, nan=-np.inf))
        reached = [i for i in reached if np.isfinite(found.gains[i])]
        if not reached:
            return self._without_candidate(situation, body)
        # After a failure the next best: the same place would most likely fail alike.
        best = reached[min(len(situation.counted), len(reached) - 1)]
        decision = {
            "predicted_gain": float(found.gains[best]),
            "expected": [{"camera": camera, "target": target} for camera, target in found.seen[best]],
            "missing": {str(aim): factor for aim, factor in missing.items()},
            "reach_before": {
                name: believed.of_camera(name).within_95.to_dict()
                for name in believed.fit.measurements.cameras
            },
        }
        step = self._step(situation, joints[best], "plan", decision)
        return replace(step, considered=Considered(pool, found.gains))

    def _without_candidate(self, situation: RigSituation, body: Body) -> Step | Halt:
        """Go back the way the arm came where it stands too near to something; else turn about the start.

        What is mounted on the flange is not known at first, so that a turn may end where it has no room.
        """
        standing = situation.standing(self._start)
        if standing is not None and body.obstacles(np.array(standing)[np.newaxis])[0] is not None:
            joints = self._came_from(situation)
            if joints is not None:
                # Judged as the way there was, by the arm alone.
                return replace(self._step(situation, np.array(joints), BACK, {}), believed=None)
        step = self._starting(situation)
        if isinstance(step, Step):
            return step
        return Halt(EndReason.NO_CANDIDATE, "no posture left from which a camera should see a target")

    def _came_from(self, situation: RigSituation) -> tuple[float, ...] | None:
        """Return the joints from which the arm came where it stands, on a way that it has not gone back."""
        entries = situation.entries
        backs = next((k for k, entry in enumerate(reversed(entries)) if entry.phase != BACK), len(entries))
        before = entries[: max(len(entries) - 1 - 2 * backs, 0)]
        if not before or not all(entry.moved for entry in entries[len(before) :]):
            return None
        return replace(situation, entries=before).standing(self._start)

    def _reached(self, situation: RigSituation, joints: FloatArray, order: FloatArray) -> list[int]:
        """Return the first in order of these postures (N, n) to which the way is free."""
        body = body_of(self._arm, self._workspace, self._solids, situation.believed)
        standing = situation.standing(self._start)
        ranked = np.argsort(order, kind="stable")[:MOST_PATHS]
        if standing is None:  # a person moves it, and sees the way
            return [int(i) for i in ranked]
        return [int(i) for i in ranked if body.obstacle_on_path(standing, joints[i]) is None]

    def _step(
        self, situation: RigSituation, joints: FloatArray, phase: str, decision: dict[str, Any]
    ) -> Step:
        pose, speed = Pose(self._arm.forward(joints)), self._wish.speed_rad_s
        goal = Goal(situation.label("station"), pose, tuple(joints.tolist()), speed)
        return Step(goal, phase, decision, None, believed=situation.believed)


def _turns(seen: Sequence[set[tuple[str, str]]]) -> tuple[int, int]:
    """Return the number of the next turn, and how many tries at a turn count as failed.

    A turn that lost some of what the first station saw is tried the other way, no more: the stations are
    kept, and several turns about one axis determine nothing. All turns after it are smaller.

    Parameters
    ----------
    seen
        Cameras and targets of each station.
    """
    number, tries, smaller = min(len(seen), 1), 0, 0
    for pairs in seen[1:]:
        whole = pairs >= seen[0]
        tries = 0 if whole else tries + 1
        if whole or tries == 2:
            number, smaller, tries = number + 1, smaller + tries, 0
    return number, smaller + tries


def request_of(wish: Wish) -> RigRequest | None:
    """Return what is asked for of all cameras; None to take all stations."""
    if wish.touch_mm is not None:
        return RigRequest(camera_to_camera=wish.camera_to_camera, touch_mm=wish.touch_mm, work=wish.work)
    if wish.accuracy_mm is None or wish.accuracy_deg is None:
        return None
    return RigRequest(wish.accuracy_mm, wish.accuracy_deg, camera_to_camera=wish.camera_to_camera)


def _reached(believed: RigEstimate, wish: Wish) -> str:
    """Return the largest radii of all cameras, in words."""
    names = believed.fit.measurements.cameras
    if wish.touch_mm is not None:
        worst = max(rig_touch_map(believed, name, wish.work).worst_m for name in names) * MM_PER_M
        return f"a touch by what any camera sees within {worst:.2g} mm"
    radii = [believed.of_camera(name).within_95 for name in names]
    mm, deg = max(r.translation_mm for r in radii), max(r.rotation_deg for r in radii)
    return f"every camera within {mm:.2g} mm and {deg:.2g} deg"
