"""A measured height settles what an arm that turns about one axis cannot tell, and nothing else."""

import numpy as np
import pytest

from folders import parallel_recording
from handeye.errors import InputError
from handeye.estimation import Measurements
from handeye.estimation.auto import AutoEstimator, AutoOptions
from handeye.estimation.height import Height, with_height


def test_the_target_is_where_it_was_measured() -> None:
    measurements = Measurements.of_recording(parallel_recording())
    without = AutoEstimator()(measurements)
    known = AutoEstimator(AutoOptions(height=Height(0.123, 1e-3)))(measurements)
    middle = known.Y.act(known.target.points.mean(axis=0)[np.newaxis])[0]
    assert middle[2] == pytest.approx(0.123, abs=1e-3)
    assert len(known.unobservable) < len(without.unobservable)
    assert np.linalg.matrix_rank(known.information - without.information, tol=1.0) == 1
    assert np.all(np.diag(known.covariance) <= np.diag(without.covariance))
    np.testing.assert_allclose(known.covariance, known.covariance.T)


def test_what_the_height_does_not_tell_stays_open() -> None:
    estimate = AutoEstimator()(Measurements.of_recording(parallel_recording()))
    assert len(estimate.unobservable) > 1
    assert not with_height(estimate, Height(0.1, 1e-3)).determined


@pytest.mark.parametrize(
    ("at_m", "sigma_m"), [(np.nan, 1e-3), (0.1, 0.0), (0.1, -1.0), (0.1, 0.2), (0.1, np.nan)]
)
def test_heights_that_say_nothing_are_refused(at_m: float, sigma_m: float) -> None:
    with pytest.raises(InputError, match="height"):
        Height(at_m, sigma_m)
