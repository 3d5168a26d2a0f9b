"""Which view to take next, and when to stop; the robot and the camera stay outside."""

from handeye.planning.candidates import Candidate, Pool
from handeye.planning.next_views import plan
from handeye.planning.planner import Planner, PlannerOptions, Proposal, Verdict, replay
from handeye.planning.policies import POLICIES, Policy, make_policy
from handeye.planning.prediction import Prediction, Sight
from handeye.planning.ranking import Prospect, Ranking, rank
from handeye.planning.stopping import (
    Accuracy,
    GainThreshold,
    NumberOfViews,
    Stop,
    StopReason,
    StopRule,
    ToolAccuracy,
)

__all__ = [
    "POLICIES",
    "Accuracy",
    "Candidate",
    "GainThreshold",
    "NumberOfViews",
    "Planner",
    "PlannerOptions",
    "Policy",
    "Pool",
    "Prediction",
    "Proposal",
    "Prospect",
    "Ranking",
    "Sight",
    "Stop",
    "StopReason",
    "StopRule",
    "ToolAccuracy",
    "Verdict",
    "make_policy",
    "plan",
    "rank",
    "replay",
]
