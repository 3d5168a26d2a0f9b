"""The quantiles against SciPy's."""

import math

import numpy as np
import pytest
from scipy import special, stats

from handeye.errors import InputError
from handeye.estimation.f_distribution import f_cumulative, f_quantile, regularised_incomplete_beta


@pytest.mark.parametrize("numerator", [1, 3, 6, 12])
@pytest.mark.parametrize("denominator", [2.2, 4.5, 12.3, 80, 3000])
@pytest.mark.parametrize("probability", [1e-6, 0.05, 0.5, 0.95, 0.99, 0.99999])
def test_quantiles_agree_with_scipy(numerator: float, denominator: float, probability: float) -> None:
    expected = stats.f.ppf(probability, numerator, denominator)
    assert f_quantile(probability, numerator, denominator) == pytest.approx(expected, rel=1e-9)


def test_without_limit_it_is_chi_square() -> None:
    assert 6 * f_quantile(0.95, 6, math.inf) == pytest.approx(stats.chi2.ppf(0.95, 6), rel=1e-6)


def test_the_incomplete_beta_agrees_with_scipy() -> None:
    random = np.random.default_rng(3)
    for a, b, x in random.uniform([0.1, 0.1, 0], [80, 80, 1], (300, 3)):
        expected = special.betainc(a, b, x)
        assert regularised_incomplete_beta(a, b, x) == pytest.approx(expected, rel=1e-11, abs=1e-14)
    assert regularised_incomplete_beta(2, 3, 0) == 0
    assert regularised_incomplete_beta(2, 3, 1) == 1


def test_quantile_and_probability_are_inverse() -> None:
    assert f_cumulative(f_quantile(0.3, 6, 9), 6, 9) == pytest.approx(0.3, abs=1e-12)
    assert f_cumulative(-1, 6, 9) == 0


@pytest.mark.parametrize(
    ("probability", "degrees"), [(0, 5), (1, 5), (math.nan, 5), (0.5, 0), (0.5, math.nan)]
)
def test_what_cannot_be_asked_is_refused(probability: float, degrees: float) -> None:
    with pytest.raises(InputError):
        f_quantile(probability, 6, degrees)
    with pytest.raises(InputError):
        regularised_incomplete_beta(1, degrees - 5, 2)
