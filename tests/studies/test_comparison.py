"""The engine behind tables and curves: paired starts, all steps, the same for any number of processes."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.estimation import Measurements
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.studies.comparison import (
    POLICIES,
    Comparison,
    Scatter,
    SetResult,
    compare,
    pooled,
)
from handeye.studies.protocol import Protocol, Trial
from handeye.types import Pose, Recording, View
from handeye.types.calibration import ModelName
from handeye.validation.metrics import summary

PAPER = Comparison(Protocol(trials=7, added_views=2, held_out_share=1 / 3), ModelName.PAPER)


def cells(*numbers: int) -> list[Recording]:
    """Cells of 12 views, and a name for each."""
    options = CellOptions(views=(12, 12))
    return [replace(simulate(ErrorKind.WHITE_FLANGE, n, options), name=f"cell {n}") for n in numbers]


def same(first: list[SetResult], second: list[SetResult]) -> bool:
    """Tell whether all values agree to the last bit."""
    return repr(first) == repr(second)


def test_all_policies_start_alike_and_all_steps_are_measured() -> None:
    recording = cells(1)[0]
    (result,) = compare([recording], PAPER)
    assert result.name == "cell 1"
    assert len(result.trials) == 7
    for metric in ("entropy_nats", "rmse_px", "relative_translation_mm", "translation_mm"):
        starts = [result.values(policy, metric)[:, 0] for policy in POLICIES]
        assert result.values("random", metric).shape == (7, 3)
        np.testing.assert_array_equal(starts[0], starts[1])
        np.testing.assert_array_equal(starts[0], starts[2])
    # Of all policies, next-best-view lowers the entropy fastest in its first step: that is what it maximises.
    steps = {p: result.values(p, "entropy_nats")[:, 1].mean() for p in POLICIES}
    assert steps["next_best_view"] <= min(steps["random"], steps["max_distance"])


def test_without_truth_and_without_held_out_views_there_is_nothing_to_say() -> None:
    recording = replace(cells(1)[0], truth=None)
    (result,) = compare([recording], replace(PAPER, protocol=Protocol(trials=1, added_views=1)))
    assert np.isnan(result.final("random", "translation_mm")).all()
    assert np.isnan(result.final("random", "rmse_px")).all()
    assert np.isfinite(result.final("random", "entropy_nats")).all()


@pytest.mark.parametrize("model", ModelName)
def test_results_do_not_depend_on_the_number_of_processes(model: ModelName) -> None:
    comparison = replace(PAPER, model=model, scatter=True, protocol=Protocol(6, 3, 1, 1 / 3))
    alone, together = (compare(cells(1, 2), comparison, workers=workers) for workers in (1, 2))
    assert same(alone, together)
    assert not same(
        alone, compare(cells(1, 2), replace(comparison, protocol=Protocol(6, 3, 1, 1 / 3, seed=1)))
    )


def shift(measurements: Measurements, trial: Trial) -> Measurements:
    error = Pose.exp([0.001 * (trial.number + 1), 0, 0, 0, 0, 0])
    views = [View(v.name, v.T_base_flange @ error, v.point_ids, v.pixels) for v in measurements.views]
    return replace(measurements, views=tuple(views))


def test_what_prepares_a_trial_is_used() -> None:
    """All poses shifted by the same in the flange frame: the hand-eye is off by that, trial by trial."""
    recording = simulate(ErrorKind.PIXEL_ONLY, 1, CellOptions(views=(12, 12), pixel_sigma_px=(1e-6, 1e-6)))
    (result,) = compare([recording], replace(PAPER, protocol=Protocol(3, 3, 1)), prepare=shift)
    np.testing.assert_allclose(result.final("random", "translation_mm"), [1, 2, 3], atol=1e-3)


def test_scatter_and_summary() -> None:
    (result,) = compare(cells(3), replace(PAPER, scatter=True))
    for trial in result.trials:
        assert trial.scatter is not None
        assert len(trial.scatter.predicted_gain_nats) == len(trial.trial.pool)
        assert -1 <= trial.scatter.correlation <= 1
    assert Scatter((1.0, 2.0, 3.0), (2.0, 4.0, 6.0)).correlation == pytest.approx(1)
    assert np.isnan(Scatter((1.0, 1.0, 1.0), (2.0, 4.0, 6.0)).correlation)
    assert summary(np.array([1.0, 2.0, 6.0])) == {"mean": 3.0, "median": 2.0, "trials": 3}
    assert len(pooled([result, result], "random", "rmse_px")) == 14
