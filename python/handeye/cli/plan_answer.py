"""What `handeye plan` says at its end."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from handeye.cli.plan_together import Together, show_together, together_data
from handeye.cli.work import touch_lines
from handeye.estimation import Estimate
from handeye.planning import Prospect, Ranking
from handeye.types.touch import TouchMap
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, eq=False)
class Planned:
    """Everything that is said of a plan."""

    recording: str
    criterion: str
    used: tuple[str, ...]
    warnings: tuple[str, ...]
    estimate: Estimate
    touch: TouchMap | None
    touch_mm: float | None
    ranking: Ranking
    batch: Together | None


def plan_data(found: Planned) -> dict[str, Any]:
    """Return what `--json` prints."""
    estimate = found.estimate
    covariance = estimate.hand_eye_covariance
    return {
        "recording": found.recording,
        "mounting": estimate.mounting.value,
        "model": estimate.model.value,
        "criterion": found.criterion,
        "used": list(found.used),
        "sigma_translation_mm": MM_PER_M * float(np.sqrt(np.trace(covariance[:3, :3]))),
        "sigma_rotation_deg": float(np.rad2deg(np.sqrt(np.trace(covariance[3:, 3:])))),
        "determined": estimate.determined,
        "touch": None if found.touch is None else found.touch.to_dict(),
        "touch_mm": found.touch_mm,
        "touch_met": found.touch_mm is not None
        and found.touch is not None
        and found.touch.worst_m * MM_PER_M <= found.touch_mm,
        "unobservable": [direction.to_dict() for direction in estimate.unobservable],
        "feasible_count": found.ranking.feasible_count,
        "ranking": [_prospect(number, p) for number, p in enumerate(found.ranking.prospects, start=1)],
        "together": None if found.batch is None else together_data(found.batch),
        "infeasible": [{"name": name, "reason": why} for name, why in found.ranking.infeasible.items()],
        "warnings": list(found.warnings),
    }


def _prospect(number: int, prospect: Prospect) -> dict[str, Any]:
    return {
        "rank": number,
        "name": prospect.candidate.name,
        "gain": prospect.gain,
        "sigma_translation_mm": MM_PER_M * prospect.sigma_translation_m,
        "sigma_rotation_deg": float(np.rad2deg(prospect.sigma_rotation_rad)),
        "T_base_flange": prospect.candidate.T_base_flange.to_list(),
    }


def show_plan(console: "Console", found: Planned, shown: int) -> None:
    """Say it in words, of so many candidates."""
    from rich import box  # noqa: PLC0415 - a program reading JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli.wording import (  # noqa: PLC0415
        MOUNTINGS,
        both,
        figures,
        heading,
        notices,
        open_directions,
        pairs,
    )

    data, estimate, ranking = plan_data(found), found.estimate, found.ranking
    heading(
        console,
        found.recording,
        f"{MOUNTINGS[estimate.mounting]}, {len(found.used)} views taken, model {estimate.model}, "
        f"criterion {found.criterion}",
    )
    now = both(data["sigma_translation_mm"] / MM_PER_M, np.deg2rad(data["sigma_rotation_deg"]))
    known = f"{now} (one standard deviation)" if estimate.determined else "not determined yet, see below"
    if found.touch is not None:
        pairs(console, touch_lines(found.touch))
    if found.touch_mm is not None:
        met = "is reached" if data["touch_met"] else "is not reached yet"
        console.print(f"The touch error asked for, {found.touch_mm:g} mm wherever in the box, {met}.")
    console.print(f"Now: {known}. Predicted after one more view:\n")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("rank", justify="right")
    table.add_column("view" if ranking.prospects else "no view can be taken")
    for name in ("gain", "sigma mm", "sigma deg"):
        table.add_column(name, justify="right")
    for number, prospect in enumerate(ranking.prospects[:shown], start=1):
        millimetres = figures(MM_PER_M * prospect.sigma_translation_m)
        degrees = figures(float(np.rad2deg(prospect.sigma_rotation_rad)), 2)
        row = (str(number), prospect.candidate.name, f"{prospect.gain:.3f}", millimetres, degrees)
        table.add_row(*row, style="bold" if number == 1 else "")
    console.print(table)
    beyond = ranking.feasible_count - min(shown, len(ranking.prospects))
    if beyond > 0:
        console.print(f"and {beyond} more (--top shows them)")
    if data["together"] is not None:
        show_together(console, data["together"])
    cannot = [f"{name}: {why}" for name, why in ranking.infeasible.items()]
    more = [f"and {len(cannot) - shown} more (--json lists them)"] if len(cannot) > shown else []
    notices(console, "Cannot be taken", [*cannot[:shown], *more])
    open_directions(console, estimate.unobservable)
    notices(console, "Warnings", found.warnings)
