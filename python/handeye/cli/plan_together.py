"""`handeye plan --together`: several views chosen at once, in the order in which the arm travels least."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from handeye.cli.failures import UsageError
from handeye.estimation import Estimate
from handeye.planning import Candidate, Pool
from handeye.planning.batch import OBJECTIVES, BatchPlan, plan_batch
from handeye.planning.ordering import METRES_PER_RADIAN, Measure, Route, travel_order
from handeye.planning.prediction import Sight
from handeye.robots import ArmKinematics
from handeye.types import View
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, eq=False)
class Together:
    """Views chosen at once, and the way through them."""

    plan: BatchPlan
    route: Route
    present: str
    speed_rad_s: float


def check_together(count: int | None, criterion: str) -> None:
    """Refuse what cannot be chosen together.

    Raises
    ------
    UsageError
        A number below one, or a criterion for single views only.
    """
    if count is None:
        return
    if count < 1:
        raise UsageError(f"--together {count}, expected at least 1")
    if criterion not in OBJECTIVES:
        raise UsageError(f"--together chooses by {', '.join(OBJECTIVES)}, not by {criterion}")


def choose_together(
    count: int,
    estimate: Estimate,
    pool: Pool,
    sight: Sight,
    present: View,
    *,
    criterion: str,
    tool_point_m: Sequence[float] | None,
    kinematics: ArmKinematics | None,
    speed_rad_s: float,
) -> Together:
    """Choose views together, and order them from where the last view was taken.

    Raises
    ------
    InputError
        Fewer candidates than that can be taken.
    DegenerateError
        No choice determines the answer.
    """
    points = None if tool_point_m is None else [tool_point_m]
    plan = plan_batch(estimate, pool, count, objective=criterion, tool_points_m=points, sight=sight)
    here = Candidate(present.name, present.T_base_flange, present.joints_rad)
    velocities = None if kinematics is None else kinematics.arm.velocities
    route = travel_order(plan.candidates, here, velocities=velocities, speed_rad_s=speed_rad_s)
    return Together(plan, route, present.name, speed_rad_s)


def together_data(found: Together) -> dict[str, Any]:
    """Return it as plain values."""
    plan, route = found.plan, found.route
    timed = route.measure is Measure.MOTION_TIME
    return {
        "efficiency": plan.efficiency,
        "sentence": plan.sentence,
        "sigma_translation_mm": MM_PER_M * float(np.sqrt(np.trace(plan.covariance[:3, :3]))),
        "sigma_rotation_deg": float(np.rad2deg(np.sqrt(np.trace(plan.covariance[3:, 3:])))),
        "from": found.present,
        "measure": route.measure.value,
        "unit": "s" if timed else "m",
        "speed_deg_s": float(np.rad2deg(found.speed_rad_s)) if timed else None,
        "total": route.total,
        "total_as_chosen": route.as_given,
        "shortest": route.exact,
        "views": [
            {"name": view.name, "leg": float(leg), "T_base_flange": view.T_base_flange.to_list()}
            for view, leg in zip(route.candidates, route.legs, strict=True)
        ],
    }


def show_together(console: "Console", data: Mapping[str, Any]) -> None:
    """Print it."""
    from handeye.cli.wording import both  # noqa: PLC0415 - a program reading JSON need not wait for it

    views, unit = data["views"], data["unit"]
    after = both(data["sigma_translation_mm"] / MM_PER_M, np.deg2rad(data["sigma_rotation_deg"]))
    console.print(f"\nTogether, {len(views)} views: {after} predicted; {data['sentence']}.")
    if unit == "s":
        how = f"time of motion, no joint faster than {data['speed_deg_s']:.0f} deg/s"
    else:
        how = f"distance of poses, a radian as {METRES_PER_RADIAN} m, as the joints of some are not known"
    least = "the shortest way" if data["shortest"] else "a short way"
    console.print(
        f"In this order, {least} from {data['from']} by {how}: {data['total']:.2f} {unit} (as chosen "
        f"{data['total_as_chosen']:.2f} {unit}; what is in the way is not looked at)\n"
    )
    for number, view in enumerate(views, start=1):
        console.print(f"  {number:>2}  {view['name']}  {view['leg']:.2f} {unit}", markup=False)
