"""One calibration with its covariance, from Python, against its peers: poses and pixels in, X and Y out."""

from collections.abc import Callable, Mapping
from typing import Any

from handeye.benchmarks.options import Options
from handeye.benchmarks.peers.availability import MissingPeerError
from handeye.benchmarks.peers.solvers import PEERS
from handeye.benchmarks.problems import Cell, make_cell
from handeye.benchmarks.stopping import COST_TOLERANCE
from handeye.benchmarks.timing import Timing, interleave
from handeye.compute.parallel import Progress
from handeye.types.arrays import FloatArray

SIZES = tuple((views, points) for points in (16, 88) for views in (3, 8, 30, 100))
# Costs closer than this, relatively, are of the same optimum.
SAME_OPTIMUM = 1e-6


def bench_solve(options: Options, progress: Progress) -> dict[str, Any]:
    """Return times, ratios and costs of every method at every size."""
    skipped: dict[str, str] = {}
    sizes: dict[str, Any] = {}
    chosen = SIZES[:: len(SIZES) - 1] if options.quick else SIZES
    for done, (views, points) in enumerate(chosen):
        progress(done, len(chosen))
        cell = make_cell("pinhole", views, points, options.seed)
        sizes[f"{views}x{points}"] = {
            "views": views,
            "points": points,
            "methods": _compare(cell, options, skipped),
        }
    progress(len(chosen), len(chosen))
    what = {"handeye": "this package: solve and covariance"} | {
        name: peer.what for name, peer in PEERS.items() if options.peers
    }
    return {"what": what, "sizes": sizes, "skipped": skipped}


def ours(cell: Cell) -> Callable[[], tuple[FloatArray, FloatArray]]:
    """Return what solves a cell with its covariance by this package, from the cell's start."""

    def solve() -> tuple[FloatArray, FloatArray]:
        found = cell.problem().solve(cell.X_start, cell.Y_start, cell.model(), cost_tolerance=COST_TOLERANCE)
        _ = found.covariance
        return found.x, found.y

    return solve


def _compare(cell: Cell, options: Options, skipped: dict[str, str]) -> dict[str, Any]:
    methods: dict[str, Callable[[], tuple[FloatArray, FloatArray]]] = {"handeye": ours(cell)}
    for name, peer in PEERS.items() if options.peers else ():
        try:
            methods[name] = peer.prepare(cell)
        except MissingPeerError as missing:
            skipped[name] = str(missing)
    problem = cell.problem()
    exact = problem.solve(cell.X_start, cell.Y_start, cell.model())
    least = problem.squared_error(exact.x, exact.y)
    excess = {name: problem.squared_error(*method()) / least - 1 for name, method in methods.items()}
    timings = interleave(methods, options.budget_s)
    return {name: _row(name, timings, excess[name]) for name in methods}


def _row(name: str, timings: Mapping[str, Timing], excess: float) -> dict[str, Any]:
    return timings[name].to_dict() | {
        "times_handeye": timings[name].median_s / timings["handeye"].median_s,
        "excess_cost": excess,
        "same_optimum": abs(excess) < SAME_OPTIMUM,
    }
