"""What 10,000 candidate views given as 4 x 4 poses would tell, from Python on one core, against its peers."""

from collections.abc import Callable
from typing import Any

import numpy as np

from handeye import _core
from handeye.benchmarks.options import Options
from handeye.benchmarks.peers.availability import MissingPeerError
from handeye.benchmarks.peers.scorers import PEERS
from handeye.benchmarks.problems import LENSES, SIGMA_PX, SIZE_PX, Cell, candidates, make_cell
from handeye.benchmarks.timing import interleave
from handeye.compute.parallel import Progress
from handeye.types.arrays import FloatArray

VIEWS = 8
POINTS = (16, 88)
CANDIDATES = 10_000
# Prior deviations of the free camera parameters: pixels, then distortion.
CAMERA_SIGMA = (2.0, 2.0, 2.0, 2.0, 0.02, 0.02, 0.002, 0.002, 0.02)
ROBOT_ROOT = np.diag([5e-4] * 6)

WHAT = {
    "handeye": "this package, no test of what is in sight",
    "sight": "and with the test of what is in sight",
    "noise_aware": "and with an error of the robot at the flange, averaged out",
    "camera": "and with all parameters of the camera free, the robot exact",
    "camera_noise_aware": "and with both",
}


def bench_score(options: Options, progress: Progress) -> dict[str, Any]:
    """Return times per candidate, ratios and differences of every method for every lens and board."""
    skipped: dict[str, str] = {}
    cases: dict[str, Any] = {}
    wanted = [(lens, points) for lens in LENSES for points in POINTS]
    for done, (lens, points) in enumerate(wanted):
        progress(done, len(wanted))
        cell = make_cell(lens, VIEWS, points, options.seed)
        motions = candidates(cell, 500 if options.quick else CANDIDATES, options.seed)
        cases[f"{lens}_{points}"] = {
            "lens": lens,
            "points": points,
            "candidates": len(motions),
            "methods": _compare(cell, motions, options, skipped),
        }
    progress(len(wanted), len(wanted))
    what = WHAT | {name: peer.what for name, peer in PEERS.items() if options.peers}
    return {"what": what, "cases": cases, "skipped": skipped}


def belief_of(cell: Cell, *, free: int = 0, noise_aware: bool = False) -> tuple[_core.Belief, FloatArray]:
    """Return what is believed after the views of a cell, and its information, at the true X and Y."""
    predictor = predictor_of(cell, sight=False, free=free, noise_aware=noise_aware)
    information: FloatArray = predictor.informations(cell.motions).sum(axis=0)
    if free:
        information[12:, 12:] += np.diag(1 / np.square(CAMERA_SIGMA[:free]))
    return _core.Belief(information), information


def predictor_of(
    cell: Cell, *, sight: bool = True, free: int = 0, noise_aware: bool = False
) -> _core.Predictor:
    """Return what predicts candidates of a cell at the true X and Y."""
    return _core.Predictor(
        cell.lens,
        cell.parameters,
        cell.points,
        np.zeros(len(cell.points)),
        cell.X,
        cell.Y,
        pixel_sigma=SIGMA_PX,
        robot_left=ROBOT_ROOT if noise_aware else None,
        free_camera=list(range(free)) or None,
        image_size=SIZE_PX if sight else None,
    )


def _ours(cell: Cell, motions: FloatArray) -> dict[str, Callable[[], FloatArray]]:
    criterion = _core.Criterion("entropy")
    every = len(cell.parameters)

    def method(*, sight: bool = True, free: int = 0, noise_aware: bool = False) -> Callable[[], FloatArray]:
        belief, _ = belief_of(cell, free=free, noise_aware=noise_aware)
        predictor = predictor_of(cell, sight=sight, free=free, noise_aware=noise_aware)
        return lambda: predictor.gains(belief, criterion, motions, threads=1)

    return {
        "handeye": method(sight=False),
        "sight": method(),
        "noise_aware": method(noise_aware=True),
        "camera": method(free=every),
        "camera_noise_aware": method(free=every, noise_aware=True),
    }


def _compare(cell: Cell, motions: FloatArray, options: Options, skipped: dict[str, str]) -> dict[str, Any]:
    methods = _ours(cell, motions)
    counts = dict.fromkeys(methods, len(motions))
    _, information = belief_of(cell)
    # The peers know no distortion.
    for name, peer in PEERS.items() if options.peers and cell.lens == "pinhole" else ():
        try:
            methods[name] = peer.prepare(cell, information, motions[: peer.most])
        except MissingPeerError as missing:
            skipped[name] = str(missing)
        else:
            counts[name] = min(peer.most, len(motions))
    expected = methods["handeye"]()
    alike = {"handeye", "sight", *PEERS}
    found = {name: method() for name, method in methods.items()}
    timings = interleave(methods, options.budget_s)
    once = timings["handeye"].median_s / counts["handeye"]
    return {
        name: timings[name].to_dict(counts[name])
        | {
            "times_handeye": timings[name].median_s / counts[name] / once,
            "largest_difference": (
                float(np.max(np.abs(found[name] - expected[: counts[name]]))) if name in alike else None
            ),
        }
        for name in methods
    }
