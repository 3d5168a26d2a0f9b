"""The answer of `handeye solve` where there are poses of the target but no pictures."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from handeye.cli.answer import Answer
from handeye.cli.output import write_json
from handeye.cli.source import mindful_of
from handeye.datasets import PosePairs
from handeye.importing import PosesSolved, solve_poses

if TYPE_CHECKING:
    from rich.console import Console

MODEL = "poses_alone"
NO_ACCURACY = (
    "the set holds poses of the target instead of pictures: this is a closed form and a fit to all poses "
    "alike; no accuracy can be stated"
)


def answer_for_poses(pairs: PosePairs, output: Path | None) -> Answer:
    """Solve poses alone.

    Raises
    ------
    InputError, DegenerateError, SolveError
        As `handeye.importing.solve_poses`.
    """
    with mindful_of(pairs.warnings):
        solved = solve_poses(pairs)
    data = _data(solved)
    if output is not None:
        write_json(output, data)
    return Answer(data, lambda console: _show(console, solved, output))


def _data(solved: PosesSolved) -> dict[str, Any]:
    pairs = solved.pairs
    distances, angles = 1e3 * solved.distances_m, np.rad2deg(solved.angles_rad)
    return {
        "recording": pairs.name,
        "layout": pairs.layout,
        "source": pairs.source,
        "mounting": pairs.mounting.value,
        **{name: pose.to_list() for name, pose in solved.results.items()},
        "model": MODEL,
        "rms_mm": 1e3 * solved.rms_m,
        "rms_deg": float(np.rad2deg(solved.rms_rad)),
        "views": {
            "used": [pair.name for pair in pairs.pairs],
            "rejected": [],
            "off_mm": {p.name: float(d) for p, d in zip(pairs.pairs, distances, strict=True)},
            "off_deg": {p.name: float(a) for p, a in zip(pairs.pairs, angles, strict=True)},
        },
        "warnings": [*map(str, pairs.warnings), NO_ACCURACY],
    }


def _show(console: "Console", solved: PosesSolved, output: Path | None) -> None:
    from handeye.cli.wording import MOUNTINGS, both, heading, notices, pairs, pose_lines  # noqa: PLC0415

    found = solved.pairs
    heading(console, found.name, f"{MOUNTINGS[found.mounting]}, {len(found)} samples used, poses alone")
    for name, pose in solved.results.items():
        console.print()
        heading(console, name)
        pairs(console, pose_lines(pose), indent=2)
    console.print()
    worst = int(np.argmax(solved.distances_m))
    off = both(float(solved.distances_m[worst]), float(solved.angles_rad[worst]))
    rows = [
        ("misfit", f"{both(solved.rms_m, solved.rms_rad)} RMS between the chain and the target's poses"),
        ("worst", f"{found.pairs[worst].name}: {off}"),
    ]
    pairs(console, rows)
    notices(console, "Warnings", [*map(str, found.warnings), NO_ACCURACY])
    if output is not None:
        console.print(f"written: {output}")
