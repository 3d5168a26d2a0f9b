"""The ellipsoid of the position holds the truth as often as it says."""

from dataclasses import replace

import numpy as np
import pytest

from folders import made_recording
from handeye.estimation import solve
from handeye.estimation.confidence import position_region
from handeye.types.calibration import Calibration


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return solve(made_recording(6))


@pytest.mark.parametrize("probability", [0.5, 0.95])
def test_share_of_draws_inside(calibration: Calibration, probability: float) -> None:
    sharp = replace(calibration, degrees_of_freedom=float("inf"))
    region = position_region(sharp, probability)
    draws = np.random.default_rng(0).multivariate_normal(np.zeros(3), sharp.covariance[:3, :3], 20_000)
    inside = np.sum(np.square(draws @ region.directions.T / region.semi_axes_m), axis=1) <= 1
    assert inside.mean() == pytest.approx(probability, abs=0.012)


def test_fewer_degrees_of_freedom_widen_it(calibration: Calibration) -> None:
    narrow = position_region(replace(calibration, degrees_of_freedom=float("inf")))
    wide = position_region(replace(calibration, degrees_of_freedom=5.0))
    assert (wide.semi_axes_m > 1.3 * narrow.semi_axes_m).all()


def test_longest_first(calibration: Calibration) -> None:
    region = position_region(calibration)
    assert (np.diff(region.semi_axes_m) <= 0).all()
    np.testing.assert_allclose(region.directions @ region.directions.T, np.eye(3), atol=1e-12)
    data = region.to_dict()
    assert data["probability"] == 0.95
    np.testing.assert_allclose(data["semi_axes_mm"], 1e3 * region.semi_axes_m)
