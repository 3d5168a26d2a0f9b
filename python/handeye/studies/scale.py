"""What many trials cost: on one process, on several, on a Dask cluster of this machine, and after a break.

A trial is a simulated calibration of the coverage study. Several processes do all trials, broken off in the
middle, and so does a cluster; one process does the first of them, as many as show how cost grows. All answers
are compared to the last bit.
"""

import importlib
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.compute.checkpoint import Checkpoint
from handeye.compute.cluster import Cluster
from handeye.compute.parallel import Workers
from handeye.errors import InputError
from handeye.simulation.cells import ErrorKind
from handeye.studies.coverage import Case, Coverage, study_coverage

CASE = Case("pixel_only", ErrorKind.PIXEL_ONLY)
MILLION = 1_000_000
# One process does a tenth of the trials, and no fewer than these.
SHARE_ALONE, FEWEST = 10, 40
SECONDS_PER_HOUR = 3600.0


@dataclass(frozen=True)
class Way:
    """One way to do trials: what it took, and whether its answers are those of the others."""

    name: str
    processes: int
    trials: int
    seconds: float
    same: bool

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "processes": self.processes,
            "trials": self.trials,
            "seconds": self.seconds,
            "same_to_the_bit": self.same,
            "million_hours_extrapolated": MILLION * self.seconds / self.trials / SECONDS_PER_HOUR,
        }


@dataclass(frozen=True)
class Scale:
    """All ways, the growth with the number of trials, and what a break costs."""

    seed: int
    ways: tuple[Way, ...]
    growth: tuple[tuple[int, float], ...]
    resumed_seconds: float
    kept_seconds: float
    kept_bytes: int
    resumed_same: bool

    @property
    def exponent(self) -> float:
        """Slope of the logarithm of the time over that of the number of trials: one where cost is linear."""
        counts, seconds = np.log(np.array(self.growth, dtype=np.float64)).T
        away = counts - counts.mean()
        return float(away @ seconds / (away @ away))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        trials = max(way.trials for way in self.ways)
        return {
            "study": "scale",
            "seed": self.seed,
            "ways": {way.name: way.to_dict() for way in self.ways},
            "growth": [{"trials": count, "seconds": seconds} for count, seconds in self.growth],
            "growth_exponent": self.exponent,
            "resume": {
                "second_half_seconds": self.resumed_seconds,
                "all_kept_seconds": self.kept_seconds,
                "bytes_per_trial": self.kept_bytes / trials,
                "same_to_the_bit": self.resumed_same,
            },
        }


def study_scale(*, trials: int = 400, processes: int = 2, cluster: bool = True, seed: int = 0) -> Scale:
    """Do trials in every way.

    Parameters
    ----------
    trials
        Number of trials; one process does the first tenth, at least 40, and growth is measured at a quarter,
        half and all of these.
    processes
        Processes of this machine, and workers of the cluster.
    cluster
        Whether to start a Dask cluster on loopback; needs the extra `cluster`.

    Raises
    ------
    InputError
        Fewer than 40 trials, or no package `distributed`.
    """
    if trials < FEWEST:
        raise InputError(f"{trials} trials, expected at least {FEWEST}", code=Code.OUT_OF_RANGE)
    few = max(trials // SHARE_ALONE, FEWEST)
    growth = [(count, _timed(count, 1, seed)[1]) for count in (few // 4, few // 2)]
    alone, seconds = _timed(few, 1, seed)
    growth.append((few, seconds))
    ways = [Way("one_process", 1, few, seconds, same=True)]
    with tempfile.TemporaryDirectory() as folder:
        kept = Checkpoint(Path(folder), processes)
        _, first_seconds = _timed(trials // 2, kept, seed)
        found, resumed_seconds = _timed(trials, kept, seed)
        again, kept_seconds = _timed(trials, kept, seed)
        size = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
    seconds = first_seconds + resumed_seconds
    ways.append(Way("processes", processes, trials, seconds, same=_begins(found, alone)))
    if cluster:
        elsewhere, seconds = _on_cluster(trials, processes, seed)
        ways.append(Way("dask", processes, trials, seconds, same=_begins(elsewhere, found)))
    return Scale(seed, tuple(ways), tuple(growth), resumed_seconds, kept_seconds, size, _begins(again, found))


def _timed(trials: int, workers: Workers, seed: int) -> tuple[Coverage, float]:
    began = time.perf_counter()
    found = study_coverage(cases=[CASE], trials=trials, seed=seed, workers=workers)
    return found, time.perf_counter() - began


def _on_cluster(trials: int, workers: int, seed: int) -> tuple[Coverage, float]:
    try:
        distributed: Any = importlib.import_module("distributed")
    except ImportError as error:
        raise InputError(
            "the package distributed is not installed",
            code=Code.MISSING_PACKAGE,
            hint="pip install 'handeye[cluster]', or leave the cluster out with --no-cluster",
        ) from error
    made = distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    )
    try:
        return _timed(trials, Cluster(made.scheduler_address), seed)
    finally:
        made.close()


def _begins(one: Coverage, other: Coverage) -> bool:
    """Tell whether one begins with the answers of the other, to the bit."""
    first = _runs(other)
    return repr(_runs(one)[: len(first)]) == repr(first)


def _runs(coverage: Coverage) -> Sequence[object]:
    return [run for runs in coverage.kinds.values() for run in runs]
