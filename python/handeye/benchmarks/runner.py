"""Runs the benchmarks that are asked for, one after the other."""

from collections.abc import Callable, Mapping
from typing import Any

from handeye.benchmarks.default import bench_default
from handeye.benchmarks.loop import bench_loop
from handeye.benchmarks.machine import describe_machine, describe_versions, one_core
from handeye.benchmarks.memory import bench_memory
from handeye.benchmarks.options import Options
from handeye.benchmarks.peers.programs import compiler_version
from handeye.benchmarks.scaling import bench_scaling
from handeye.benchmarks.score import bench_score
from handeye.benchmarks.solve import bench_solve
from handeye.benchmarks.step import bench_step
from handeye.compute.parallel import Progress

BENCHMARKS: Mapping[str, Callable[[Options, Progress], dict[str, Any]]] = {
    "solve": bench_solve,
    "default": bench_default,
    "score": bench_score,
    "step": bench_step,
    "loop": bench_loop,
    "memory": bench_memory,
    "scaling": bench_scaling,
}


def run_benchmarks(
    names: "tuple[str, ...]", options: Options, progress: Callable[[str, int, int], None]
) -> dict[str, Any]:
    """Run benchmarks on one core and return plain values for JSON: machine, versions, and a part for each.

    Parameters
    ----------
    names
        Of `BENCHMARKS`.
    progress
        Told the name of the benchmark, how many of its parts are done, of how many.

    Raises
    ------
    HandeyeError
        A benchmark failed.
    """
    document: dict[str, Any] = {
        "machine": describe_machine() | {"compiler": compiler_version()},
        "versions": describe_versions(),
        "seed": options.seed,
        "budget_s": options.budget_s,
        "quick": options.quick,
    }
    with one_core():
        for name in names:
            document[name] = BENCHMARKS[name](
                options, lambda done, total, name=name: progress(name, done, total)
            )
    return document
