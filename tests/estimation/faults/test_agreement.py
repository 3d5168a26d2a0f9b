"""Predictions leave out what they predict, their probabilities are true, and evidence is their product."""

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.estimation import Measurements
from handeye.estimation.faults.agreement import Agreement, SetFit
from handeye.estimation.faults.stations import Stations
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types.arrays import FloatArray


def agreement(seed: int, kind: ErrorKind = ErrorKind.WHITE_FLANGE, views: int = 10) -> Agreement:
    recording = simulate(kind, seed, CellOptions(views=(views, views)))
    assert recording.truth is not None
    assert recording.truth.X is not None
    assert recording.truth.Y is not None
    stations = Stations.of(Measurements.of_recording(recording))
    return Agreement(stations, recording.truth.X.matrix, recording.truth.Y.matrix)


def fitted(views: Agreement, members: list[bool]) -> SetFit:
    return views.fit(np.array(members))


def test_a_member_is_predicted_by_the_others() -> None:
    views = agreement(1)
    everyone, without = fitted(views, [True] * 10), fitted(views, [False] + [True] * 9)
    # The levels differ a little: those of everyone were found with the view.
    assert everyone.log_density[0] == pytest.approx(without.log_density[0], abs=0.3)
    assert everyone.p_value[0] == pytest.approx(without.p_value[0], abs=0.1)
    scale = np.sqrt(np.diag(without.covariance[0]))
    np.testing.assert_allclose(everyone.deviation[0] / scale, without.deviation[0] / scale, atol=0.1)


def test_few_members_are_predicted_too() -> None:
    views = agreement(1)
    few = fitted(views, [True] * 3 + [False] * 7)
    assert np.isfinite(few.log_density).all()
    # Two views leave X and Y open: what they say of the third is next to nothing.
    assert np.trace(few.covariance[0]) > 10 * np.trace(fitted(views, [True] * 10).covariance[0])


def test_evidence_is_the_product_of_predictions() -> None:
    views = agreement(2)
    members = [True] * 10
    members[4] = False
    fewer = fitted(views, members)
    gained = fitted(views, [True] * 10).log_evidence - fewer.log_evidence
    assert gained == pytest.approx(fewer.log_density[4], abs=0.5)


@pytest.mark.parametrize("kind", [ErrorKind.WHITE_FLANGE, ErrorKind.WHITE_BASE])
def test_p_values_are_as_rare_as_they_say(kind: ErrorKind) -> None:
    values: FloatArray = np.concatenate(
        [fitted(agreement(seed, kind), [True] * 10).p_value for seed in range(15)]
    )
    assert 0.01 < np.mean(values < 0.05) < 0.1
    assert np.mean(values < 0.001) < 0.015
    assert 0.35 < np.median(values) < 0.65


def test_a_wrong_pose_is_improbable() -> None:
    views = agreement(3)
    views.stations.robot[4, 0, 3] += 0.02
    moved = Agreement(views.stations, views.X, views.Y)
    fit = fitted(moved, [k != 4 for k in range(10)])
    assert fit.p_value[4] < 1e-9
    assert fit.p_value.argmin() == 4


def test_a_view_that_is_not_there_is_refused() -> None:
    views = agreement(1)
    with pytest.raises(InputError, match="station 10 of 10"):
        views.fit(np.ones(11, dtype=bool))
