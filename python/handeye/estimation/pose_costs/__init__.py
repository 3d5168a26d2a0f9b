"""Methods that minimise a cost on poses: one file each, all in `POSE_COSTS`.

They are the field's, for comparison: the estimate of `handeye solve` is not among them.
"""

from handeye.estimation.pose_costs.ali import ALI_1, ALI_2
from handeye.estimation.pose_costs.base import PoseCost, PoseViews, optimise
from handeye.estimation.pose_costs.remy import REMY
from handeye.estimation.pose_costs.soft_l1 import SOFT_L1
from handeye.estimation.pose_costs.strobl_hirzinger import STROBL_HIRZINGER
from handeye.estimation.pose_costs.tabb_ahmad_yousef import TABB_AHMAD_YOUSEF_1, TABB_AHMAD_YOUSEF_2

POSE_COSTS: dict[str, PoseCost] = {
    cost.name: cost
    for cost in (REMY, STROBL_HIRZINGER, TABB_AHMAD_YOUSEF_1, TABB_AHMAD_YOUSEF_2, ALI_1, ALI_2, SOFT_L1)
}

__all__ = ["POSE_COSTS", "PoseCost", "PoseViews", "optimise"]
