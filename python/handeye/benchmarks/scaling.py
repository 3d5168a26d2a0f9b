"""How cost grows with views and points of a solve, and with candidates, points and views of the scorer.

The exponent is the slope of the logarithm of the fastest time over that of the size, by least squares: one
where cost is linear, zero where it is constant. Sizes begin where what a call costs by itself is small.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from handeye import _core
from handeye.benchmarks.machine import all_cores
from handeye.benchmarks.options import Options
from handeye.benchmarks.problems import candidates, make_cell
from handeye.benchmarks.score import belief_of, predictor_of
from handeye.benchmarks.timing import interleave
from handeye.compute.parallel import Progress

MADE_OF = 16_000


def bench_scaling(options: Options, progress: Progress) -> dict[str, Any]:
    """Return times against sizes with fitted exponents, and against the number of threads."""
    laws: dict[str, tuple[str, Sequence[int], Callable[[int], Callable[[], object]]]] = {
        "solve_views": ("one iteration, 88 points", (200, 400, 800, 1600), lambda n: _solve(n, 88, options)),
        "solve_points": (
            "one iteration, 16 views",
            (1000, 2000, 4000, 8000),
            lambda n: _solve(16, n, options),
        ),
        "score_candidates": (
            "88 points",
            (2000, 4000, 8000, 16000),
            lambda n: _score(8, 88, n, options),
        ),
        "score_points": (
            "1,000 candidates",
            (1000, 2000, 4000, 8000),
            lambda n: _score(8, n, 1000, options),
        ),
        "score_views_taken": (
            "1,000 candidates, 88 points",
            (5, 20, 80, 320),
            lambda n: _score(n, 88, 1000, options),
        ),
    }
    found: dict[str, Any] = {}
    for done, (name, (what, sizes, make)) in enumerate(laws.items()):
        progress(done, len(laws) + 1)
        chosen = (12, 24) if options.quick else sizes
        found[name] = {"what": what} | _law(chosen, make, options)
    progress(len(laws), len(laws) + 1)
    threads = _threads(options)
    progress(len(laws) + 1, len(laws) + 1)
    return {"laws": found, "threads": threads}


def _law(
    sizes: Sequence[int], make: Callable[[int], Callable[[], object]], options: Options
) -> dict[str, Any]:
    timings = interleave({str(size): make(size) for size in sizes}, options.budget_s)
    times = [timings[str(size)].fastest_s for size in sizes]
    exponent = float(np.polyfit(np.log(sizes), np.log(times), 1)[0])
    return {"sizes": list(sizes), "times_us": [1e6 * time for time in times], "exponent": exponent}


def _solve(views: int, points: int, options: Options) -> Callable[[], object]:
    cell = make_cell("pinhole", views, points, options.seed)
    problem, model = cell.problem(), cell.model()
    return lambda: problem.solve(cell.X_start, cell.Y_start, model, max_iterations=1)


def _score(views: int, points: int, count: int, options: Options) -> Callable[[], object]:
    cell = make_cell("pinhole", views, points, options.seed)
    belief, _ = belief_of(cell)
    predictor, criterion = predictor_of(cell), _core.Criterion("entropy")
    motions = candidates(cell, count, options.seed)
    return lambda: predictor.gains(belief, criterion, motions, threads=1)


def _threads(options: Options) -> dict[str, Any]:
    """Times by the clock of one call by the number of threads, on all cores."""
    cell = make_cell("pinhole", 8, 88, options.seed)
    belief, _ = belief_of(cell)
    predictor, criterion = predictor_of(cell), _core.Criterion("entropy")
    motions = np.tile(candidates(cell, 2000 if options.quick else MADE_OF, options.seed), (10, 1, 1))

    def score(threads: int) -> Callable[[], object]:
        return lambda: predictor.gains(belief, criterion, motions, threads=threads)

    with all_cores() as cores:
        counts = [count for count in (1, 2, 4, 8, 16, 32) if count <= cores]
        timings = interleave(
            {str(count): score(count) for count in counts}, options.budget_s, time.perf_counter
        )
    once = timings["1"].fastest_s
    return {
        "candidates": len(motions),
        "points": 88,
        "speed_up": {name: once / timing.fastest_s for name, timing in timings.items()},
    }
