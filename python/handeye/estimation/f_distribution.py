"""Quantiles of Fisher's F distribution, which regions need whose noise levels are known only roughly.

Written out here because the installed package has no statistics library.
"""

import math
from functools import lru_cache

from handeye.codes import Code
from handeye.errors import InputError

# Beyond this many degrees of freedom F is its limit to all digits that matter.
_MANY = 1e7
_TINY = 1e-300
_PRECISION = 3e-16
_MOST_TERMS = 100_000


def regularised_incomplete_beta(a: float, b: float, x: float) -> float:
    """Return `I_x(a, b)` by its continued fraction (Abramowitz and Stegun 26.5.8, with Lentz's method).

    Raises
    ------
    InputError
        `a` or `b` not above zero, or `x` outside 0 to 1.
    """
    if not (a > 0 and b > 0 and 0 <= x <= 1):
        raise InputError(
            f"incomplete beta at a={a}, b={b}, x={x}: expected a, b > 0 and x in 0 to 1",
            code=Code.OUT_OF_RANGE,
        )
    if x in {0.0, 1.0}:
        return x
    front = math.exp(
        math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    )
    # The fraction converges fast on this side of the mean; the symmetry I_x(a, b) = 1 - I_{1-x}(b, a) serves
    # the other.
    if x < (a + 1) / (a + b + 2):
        return front * _beta_fraction(a, b, x) / a
    return 1 - front * _beta_fraction(b, a, 1 - x) / b


def _beta_fraction(a: float, b: float, x: float) -> float:
    def away_from_zero(value: float) -> float:
        return value if abs(value) > _TINY else _TINY

    c = 1.0
    d = 1 / away_from_zero(1 - (a + b) * x / (a + 1))
    fraction = d
    for m in range(1, _MOST_TERMS):
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        d = 1 / away_from_zero(1 + even * d)
        c = away_from_zero(1 + even / c)
        fraction *= d * c
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        d = 1 / away_from_zero(1 + odd * d)
        c = away_from_zero(1 + odd / c)
        change = d * c
        fraction *= change
        if abs(change - 1) < _PRECISION:
            break
    return fraction


def f_cumulative(value: float, numerator: float, denominator: float) -> float:
    """Return the probability that F with these degrees of freedom is at most `value`.

    The denominator may be infinite: F is then chi-square over its degrees of freedom.
    """
    if value <= 0:
        return 0.0
    denominator = min(denominator, _MANY)
    scaled = numerator * value
    return regularised_incomplete_beta(numerator / 2, denominator / 2, scaled / (scaled + denominator))


@lru_cache(maxsize=256)
def f_quantile(probability: float, numerator: float, denominator: float) -> float:
    """Return the value that F stays below with a probability, by bisection to the last digits.

    Raises
    ------
    InputError
        A probability outside 0 to 1 (both excluded), or degrees of freedom not above zero.
    """
    if not 0 < probability < 1:
        raise InputError(f"probability {probability}, expected above 0 and below 1", code=Code.OUT_OF_RANGE)
    if not (numerator > 0 and denominator > 0):
        raise InputError(
            f"degrees of freedom {numerator} and {denominator}, expected above zero", code=Code.OUT_OF_RANGE
        )
    low, high = 0.0, 1.0
    while f_cumulative(high, numerator, denominator) < probability:
        low, high = high, 2 * high
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        if f_cumulative(middle, numerator, denominator) < probability:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
