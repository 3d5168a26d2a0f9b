"""The paper's curves against the number of added views, and predicted gain against reduction of RMSE."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers
from handeye.studies.comparison import (
    METRIC_NAMES,
    POLICIES,
    Comparison,
    Scatter,
    SetResult,
    compare,
)
from handeye.studies.protocol import Protocol
from handeye.types import Recording
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName

HELD_OUT_SHARE = 1 / 3
# The band around a mean: quartiles over the trials.
BAND_PERCENTILES = (25.0, 75.0)


@dataclass(frozen=True)
class Curves:
    """Metrics after each added view, and the scatter of gains, per set."""

    model: ModelName
    protocol: Protocol
    sets: tuple[SetResult, ...]

    def mean(self, result: SetResult, policy: str, metric: str) -> FloatArray:
        """(added views + 1,) mean over the trials of a set."""
        return result.values(policy, metric).mean(axis=0)

    def band(self, result: SetResult, policy: str, metric: str) -> FloatArray:
        """(2, added views + 1) quartiles over the trials of a set."""
        return np.percentile(result.values(policy, metric), BAND_PERCENTILES, axis=0)

    @property
    def median_correlation(self) -> float:
        """Median over all trials of all sets of the correlation of predicted gain and realised reduction."""
        return _median([c for result in self.sets for c in correlations(result)])

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "study": "curves",
            "model": self.model.value,
            "seed": self.protocol.seed,
            "trials_per_set": self.protocol.trials,
            "start_views": self.protocol.start_views,
            "added_views": list(range(self.protocol.added_views + 1)),
            "held_out_share": self.protocol.held_out_share,
            "sets": {result.name: self._set(result) for result in self.sets},
            "correlation": {
                "median": self.median_correlation,
                "trials": sum(len(correlations(result)) for result in self.sets),
            },
        }

    def _set(self, result: SetResult) -> dict[str, Any]:
        names = measured(result)
        found = correlations(result)
        return {
            "policies": {
                policy: {name: self.mean(result, policy, name).tolist() for name in names}
                for policy in POLICIES
            },
            "median": {
                policy: {name: np.median(result.values(policy, name), axis=0).tolist() for name in names}
                for policy in POLICIES
            },
            "quartiles": {
                policy: {name: self.band(result, policy, name).tolist() for name in names}
                for policy in POLICIES
            },
            "correlation": {"median": _median(found), "trials": len(found)},
        }


def study_curves(
    recordings: Sequence[Recording],
    *,
    model: ModelName = ModelName.AUTO,
    trials: int = 50,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Curves:
    """Run 3 + 5 views with a third held out, and try every candidate of the first step.

    Raises
    ------
    InputError
        A recording with too few views.
    """
    protocol = Protocol(trials=trials, seed=seed, held_out_share=HELD_OUT_SHARE)
    comparison = Comparison(protocol, ModelName(model), scatter=True)
    results = compare(recordings, comparison, workers=workers, progress=progress)
    return Curves(comparison.model, protocol, tuple(results))


def measured(result: SetResult) -> tuple[str, ...]:
    """Return the metrics that a set has values of: without truth there are no absolute errors."""
    first = result.trials[0].steps[POLICIES[0]][0]
    return tuple(name for name in METRIC_NAMES if not np.isnan(getattr(first, name)))


def scatters(result: SetResult) -> list[Scatter]:
    """Return the scatters of a set's trials."""
    return [trial.scatter for trial in result.trials if trial.scatter is not None]


def correlations(result: SetResult) -> list[float]:
    """Return Pearson's correlation of each trial that has one."""
    return [c for c in (scatter.correlation for scatter in scatters(result)) if not np.isnan(c)]


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else float("nan")
