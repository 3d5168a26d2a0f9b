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
ONLY_POSES = (
    "the set holds poses of the target instead of pictures: what the camera or the target's size are off by "
    "all the time shows in none of them, and is not in the accuracy stated"
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
    levels = solved.levels
    return {
        "recording": pairs.name,
        "layout": pairs.layout,
        "source": pairs.source,
        "mounting": pairs.mounting.value,
        **{name: pose.to_list() for name, pose in solved.results.items()},
        "within_95": solved.within_95.to_dict(),
        "covariance": solved.covariance.tolist(),
        "model": MODEL,
        "detector": {
            "across_mm": 1e3 * levels["detector_across_m"],
            "along_mm": 1e3 * levels["detector_along_m"],
            "rotation_deg": float(np.rad2deg(levels["detector_rad"])),
        },
        "rms_mm": 1e3 * solved.rms_m,
        "rms_deg": float(np.rad2deg(solved.rms_rad)),
        "views": {
            "used": [pair.name for pair in pairs.pairs if pair.name not in solved.left_out],
            "rejected": [{"name": name, "reason": why} for name, why in solved.left_out.items()],
            "off_mm": {p.name: float(d) for p, d in zip(pairs.pairs, distances, strict=True)},
            "off_deg": {p.name: float(a) for p, a in zip(pairs.pairs, angles, strict=True)},
        },
        "warnings": [*map(str, pairs.warnings), ONLY_POSES],
    }


def _show(console: "Console", solved: PosesSolved, output: Path | None) -> None:
    from handeye.cli.wording import MOUNTINGS, both, figures, heading, notices, pairs, pose_lines  # noqa: PLC0415

    found = solved.pairs
    used = len(found) - len(solved.left_out)
    heading(
        console, found.name, f"{MOUNTINGS[found.mounting]}, {used} of {len(found)} samples used, poses alone"
    )
    for name, pose in solved.results.items():
        console.print()
        heading(console, name)
        pairs(console, pose_lines(pose), indent=2)
    console.print()
    known, levels = solved.within_95, solved.levels
    worst = int(np.argmax(np.where(solved.used, solved.distances_m, -1)))
    across, along = (figures(1e3 * levels[f"detector_{way}_m"], 2) for way in ("across", "along"))
    stated = (
        f"within {figures(known.translation_mm)} mm and {figures(known.rotation_deg)} deg with 95 % "
        "probability (centre of the camera, rotation)"
    )
    turned = figures(float(np.rad2deg(levels["detector_rad"])), 2)
    off = both(float(solved.distances_m[worst]), float(solved.angles_rad[worst]))
    rows = [
        (
            "accuracy",
            stated,
        ),
        ("detector", f"{across} mm across and {along} mm along its line of sight, {turned} deg"),
        ("misfit", f"{both(solved.rms_m, solved.rms_rad)} RMS between the chain and the target's poses"),
        ("worst", f"{found.pairs[worst].name}: {off}"),
    ]
    pairs(console, rows)
    notices(console, "Left out", (f"{name}: {why}" for name, why in solved.left_out.items()))
    notices(console, "Warnings", [*map(str, found.warnings), ONLY_POSES])
    if output is not None:
        console.print(f"written: {output}")
