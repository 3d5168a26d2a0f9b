"""`handeye plan` for several cameras: which station teaches all of them most."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.output import write_json
from handeye.cli.source import mindful_of
from handeye.cli.work import touch_lines
from handeye.codes import Code
from handeye.datasets import PoseTable
from handeye.errors import InputError
from handeye.estimation import RigMeasurements, estimate_rig
from handeye.estimation.work import Work
from handeye.importing import OpenedRig
from handeye.planning import Pool
from handeye.planning.candidates import Candidate
from handeye.planning.prediction import Sight
from handeye.planning.rig import rig_gains
from handeye.planning.rig_request import FEWEST_STATIONS, Aim, rig_touch_map
from handeye.types.kinematics import Kinematics
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    from rich.console import Console

SHOWN = 10


def plan_rig(
    opened: OpenedRig,
    table: PoseTable | None,
    output: Path | None,
    *,
    used: tuple[str, ...] | None,
    first: int | None,
    top: int | None,
    sight: Sight,
    kinematics: Kinematics | None,
    work: Work | None,
    touch_mm: float | None,
) -> Answer:
    """Rank stations by what all cameras learn there, or by what that takes off the touch error.

    See `handeye.planning.rig`; `work` is what is seen and touched, None where poses are asked for.

    Raises
    ------
    UsageError
        Stations that are not there.
    InputError, DegenerateError
        As for `handeye.estimation.estimate_rig`.
    """
    recording = opened.recording
    stations = [station.name for station in recording.stations]
    if used is not None and not set(used) <= set(stations):
        raise UsageError(f"--used: no station {', '.join(sorted(set(used) - set(stations)))[:100]}")
    usual = len(stations) if table is not None else min(FEWEST_STATIONS, len(stations))
    taken = list(used) if used is not None else stations[: usual if first is None else first]
    left = [station for station in recording.stations if station.name not in taken]
    if table is None:
        pool = Pool.of_views(station.views[0].view for station in left)
    else:
        named = zip(table.names, table.poses, strict=True)
        pool = Pool(tuple(Candidate(name, pose) for name, pose in named))
    if len(pool) == 0:
        raise InputError(
            "no candidate: every station is taken",
            code=Code.NO_CANDIDATE,
            hint="give --candidates, or let fewer stations count as taken with --first or --used",
        )
    with mindful_of(opened.warnings):
        start = recording.with_stations(s for s in recording.stations if s.name in taken)
        estimate = estimate_rig(RigMeasurements.of(start), kinematics)
        names = list(estimate.fit.measurements.cameras)
        found = rig_gains(estimate, pool, [Aim((name,), work) for name in names], sight)
        errors = {} if work is None else {name: rig_touch_map(estimate, name, work) for name in names}
    best_first = np.argsort(-np.nan_to_num(found.gains, nan=-np.inf), kind="stable")
    order = [int(i) for i in best_first if np.isfinite(found.gains[i])]
    ranked = [
        {
            "name": pool.candidates[i].name,
            "gain": float(found.gains[i]),
            "seen": [{"camera": camera, "target": target} for camera, target in found.seen[i]],
        }
        for i in order[:top]
    ]
    now = {name: estimate.of_camera(name).within_95.to_dict() for name in names}
    worst_mm = max((one.worst_m * MM_PER_M for one in errors.values()), default=float("inf"))
    data = {
        "recording": recording.name,
        "used": taken,
        "within_95": now,
        "touch": {name: one.to_dict() for name, one in errors.items()},
        "touch_mm": touch_mm,
        "touch_met": touch_mm is not None and worst_mm <= touch_mm,
        "candidates": ranked,
        "warnings": [str(warning) for warning in opened.warnings],
    }
    if output is not None:
        write_json(output, data)

    def show(console: "Console") -> None:
        from handeye.cli.wording import figures, heading, pairs  # noqa: PLC0415

        heading(console, recording.name, f"{len(taken)} stations taken, {len(pool)} candidates")
        rows = [
            (name, f"within {figures(one['translation_mm'])} mm and {figures(one['rotation_deg'])} deg")
            for name, one in now.items()
        ]
        pairs(console, rows, indent=2)
        for name, one in errors.items():
            pairs(console, [(name, ""), *touch_lines(one)], indent=2)
        if touch_mm is not None:
            met = "is reached" if data["touch_met"] else "is not reached yet"
            console.print(f"The touch error asked for of every camera, {touch_mm:g} mm, {met}.")
        console.print("\nstations that teach most of all cameras (nats)")
        for i in order[: top or SHOWN]:
            seen = ", ".join(f"{camera} {target}" for camera, target in found.seen[i])
            pairs(console, [(pool.candidates[i].name, f"{figures(float(found.gains[i]))}  {seen}")], indent=2)

    return Answer(data, show)
