"""The memory that scoring a million candidates takes, in a process of its own."""

import json
import subprocess
import sys
from typing import Any

from handeye.benchmarks.machine import peak_memory_mb
from handeye.benchmarks.options import Options
from handeye.benchmarks.problems import candidates, make_cell
from handeye.codes import Code
from handeye.compute.parallel import Progress
from handeye.errors import HandeyeError

CANDIDATES = 1_000_000
POINTS = 16


def bench_memory(options: Options, progress: Progress) -> dict[str, Any]:
    """Return the peak memory of a process that makes a million candidates as 4 x 4 poses and scores them.

    Raises
    ------
    HandeyeError
        The process failed, or the system does not tell the peak memory.
    """
    progress(0, 1)
    count = CANDIDATES // 100 if options.quick else CANDIDATES
    command = [sys.executable, "-m", __name__, str(count), str(options.seed)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - this file
    if done.returncode != 0:
        raise HandeyeError(
            f"scoring {count} candidates failed: {done.stderr.strip()}", code=Code.BENCHMARK_FAILED
        )
    progress(1, 1)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def measure(count: int, seed: int) -> dict[str, Any]:
    """Score candidates in this process and return its peak memory."""
    import numpy as np  # noqa: PLC0415 - before: what the interpreter and the package take by themselves

    from handeye import _core  # noqa: PLC0415
    from handeye.benchmarks.score import belief_of, predictor_of  # noqa: PLC0415

    cell = make_cell("pinhole", 8, POINTS, seed)
    belief, _ = belief_of(cell)
    idle = peak_memory_mb()
    motions = candidates(cell, count, seed)
    gains = predictor_of(cell).gains(belief, _core.Criterion("entropy"), motions)
    return {
        "candidates": count,
        "points": POINTS,
        "peak_mb": peak_memory_mb(),
        "before_mb": idle,
        "candidates_mb": motions.nbytes / 2**20,
        "scored": int(np.isfinite(gains).sum()),
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(measure(int(sys.argv[1]), int(sys.argv[2]))))
