"""The paper's table I: absolute errors on simulated sets, three policies from the same random starts."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from handeye.compute.parallel import Progress, Workers
from handeye.studies.comparison import (
    POLICIES,
    Comparison,
    SetResult,
    compare,
    pooled,
)
from handeye.studies.protocol import Protocol, true_hand_eye
from handeye.types import Recording
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.validation.metrics import summary

METRICS = ("translation_mm", "rotation_deg")


@dataclass(frozen=True)
class Table1:
    """Errors against the truth after the last view, per policy: all sets together, and each."""

    model: ModelName
    protocol: Protocol
    sets: tuple[SetResult, ...]

    def values(self, policy: str, metric: str) -> FloatArray:
        """(N,) errors of all trials of all sets."""
        return pooled(self.sets, policy, metric)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "study": "table1",
            "model": self.model.value,
            "seed": self.protocol.seed,
            "trials_per_set": self.protocol.trials,
            "start_views": self.protocol.start_views,
            "added_views": self.protocol.added_views,
            "policies": _policies(self.sets),
            "sets": {result.name: {"policies": _policies([result])} for result in self.sets},
        }


def _policies(sets: Sequence[SetResult]) -> dict[str, Any]:
    return {
        policy: {
            **{metric: summary(pooled(sets, policy, metric)) for metric in METRICS},
            "trials": sum(len(result.trials) for result in sets),
        }
        for policy in POLICIES
    }


def study_table1(
    recordings: Sequence[Recording],
    *,
    model: ModelName = ModelName.AUTO,
    trials: int = 50,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Table1:
    """Run the protocol of the paper's table I: 3 random views, then 5 chosen by each policy.

    Candidates are the other recorded views; nothing is held out, as the truth is known.

    Raises
    ------
    InputError
        A recording without truth, or with too few views.
    """
    for recording in recordings:
        true_hand_eye(recording)
    comparison = Comparison(Protocol(trials=trials, seed=seed), ModelName(model))
    results = compare(recordings, comparison, workers=workers, progress=progress)
    return Table1(comparison.model, comparison.protocol, tuple(results))
