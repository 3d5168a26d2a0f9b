"""Predictions leave out what they predict, and their probabilities are true."""

import numpy as np
import pytest

from handeye.estimation import Measurements
from handeye.estimation.mistakes.noise_grid import noise_grid
from handeye.estimation.mistakes.sightings import Sightings
from handeye.estimation.mistakes.weighing import Prediction, Weighing
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types.arrays import FloatArray


def weighing(seed: int, kind: ErrorKind = ErrorKind.WHITE_FLANGE, views: int = 10) -> Weighing:
    recording = simulate(kind, seed, CellOptions(views=(views, views)))
    assert recording.truth is not None
    assert recording.truth.X is not None
    assert recording.truth.Y is not None
    sightings = Sightings.of(Measurements.of_recording(recording))
    return Weighing(sightings, recording.truth.X.matrix, recording.truth.Y.matrix, noise_grid())


def predicted(weighed: Weighing, members: list[bool]) -> Prediction:
    return weighed.predict(weighed.fit(np.array(members)))


def test_a_member_is_predicted_by_the_others() -> None:
    weighed = weighing(1)
    everyone = predicted(weighed, [True] * 10)
    without = predicted(weighed, [False] + [True] * 9)
    assert everyone.log_density[0] == pytest.approx(without.log_density[0], abs=1e-4)
    assert everyone.p_value[0] == pytest.approx(without.p_value[0], rel=1e-4)
    np.testing.assert_allclose(everyone.deviation[0], without.deviation[0], atol=1e-8)


def test_evidence_is_the_product_of_predictions() -> None:
    weighed = weighing(2)
    everyone = weighed.fit(np.ones(10, dtype=bool))
    fewer = np.ones(10, dtype=bool)
    fewer[4] = False
    gained = everyone.log_evidence - weighed.fit(fewer).log_evidence
    assert gained == pytest.approx(weighed.predict(weighed.fit(fewer)).log_density[4], abs=1e-4)


@pytest.mark.parametrize("kind", [ErrorKind.WHITE_FLANGE, ErrorKind.WHITE_BASE])
def test_p_values_are_no_smaller_than_they_say(kind: ErrorKind) -> None:
    # The points of an image are taken to err together, so small values are rarer than with white pixels.
    values: FloatArray = np.concatenate(
        [predicted(weighing(seed, kind), [True] * 10).p_value for seed in range(15)]
    )
    assert np.mean(values < 0.05) < 0.08
    assert np.mean(values < 0.001) < 0.01
    assert np.median(values) < 0.9


def test_narrowing_the_levels_changes_nothing() -> None:
    weighed = weighing(3)
    everyone = np.ones(10, dtype=bool)
    fit = weighed.fit(everyone)
    narrow = weighed.narrowed([fit])
    assert len(narrow.grid) < len(weighed.grid)
    assert narrow.fit(everyone).log_evidence == pytest.approx(fit.log_evidence, abs=1e-3)
