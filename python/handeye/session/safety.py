"""What must hold before a goal is sent, judged from where the arm really stands."""

from collections.abc import Sequence

import numpy as np

from handeye.estimation import Estimate, RigEstimate
from handeye.planning.collisions import Body, Workspace
from handeye.planning.constraints import mounted_points
from handeye.planning.rig import mounted_on_flange
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm
from handeye.robots.motion import AGREEMENT_M, AGREEMENT_RAD
from handeye.robots.protocol import Goal
from handeye.robots.replay import is_near
from handeye.types import Pose

# Rounding of degrees and radians is no faster motion.
_SPEED_TOLERANCE = 1e-9
# What is believed of one camera, or of several.
Believed = Estimate | RigEstimate


def body_of(arm: Arm, workspace: Workspace, solids: SolidLinks | None, believed: Believed | None) -> Body:
    """Return the arm with what is mounted on it, as far as is known."""
    if believed is None:
        return Body(arm, workspace, solids=solids)
    if isinstance(believed, RigEstimate):
        return Body(arm, workspace, mounted_on_flange(believed), solids)
    return Body(arm, workspace, mounted_points(believed), solids)


def objection_to_motion(
    body: Body, goal: Goal, standing_rad: Sequence[float] | None, speed_rad_s: float
) -> str | None:
    """Say why a goal must not be sent, None if it may be.

    Parameters
    ----------
    body
        The arm, what is mounted on it, and its workspace.
    goal
        Where it is to go.
    standing_rad
        (n,) joints where it stands; None if a person moves it, who sees the way.
    speed_rad_s
        No joint may move faster.
    """
    if goal.speed_rad_s > speed_rad_s * (1 + _SPEED_TOLERANCE):
        return f"the goal is faster than the {np.rad2deg(speed_rad_s):.1f} deg/s that are allowed"
    if not body.workspace.contains(goal.T_base_flange.translation):
        return "the goal is outside the stated workspace"
    arm = body.arm
    if goal.joints_rad is None:
        return None if standing_rad is None else "the goal has no joints, and its way cannot be checked"
    joints = np.array(goal.joints_rad)
    if joints.shape != (len(arm),) or not np.isfinite(joints).all():
        return f"the goal has {joints.size} joints, expected {len(arm)} finite ones"
    if not is_near(Pose(arm.forward(joints)), goal.T_base_flange, AGREEMENT_M, AGREEMENT_RAD):
        return "the goal's joints and its pose are not the same place"
    if standing_rad is None:
        return None
    return body.obstacle_on_path(standing_rad, joints)
