//! The natural logarithm, lane by lane.

use super::vector::{Simd, Vector};

/// Terms of the series in `s^2`; at most 0.0295, so that the first one left out is below rounding.
const TERMS: u8 = 9;

/// `ln 2` in two parts; the first has 21 trailing zeros, so that its product with an exponent is exact.
const LN_2: (f64, f64) = (f64::from_bits(0x3FE6_2E42_FEE0_0000), 1.908_214_929_270_587_7e-10);

/// Natural logarithm of positive normal numbers, to about one unit in the last place.
///
/// With `x = 2^k (1 + f)`, `1 + f` within a factor `sqrt 2` of one and `s = f / (2 + f)`:
/// `ln (1 + f) = 2 artanh s = 2 s + 2 s^3 / 3 + 2 s^5 / 5 + ...` (Abramowitz and Stegun, 4.1.27), where
/// `2 s = f - f^2/2 + s f^2/2` keeps the leading term exact.
#[inline(always)]
pub(crate) fn ln<S: Simd>(simd: S, x: S::Vector) -> S::Vector {
    let (mantissa, exponent) = x.mantissa_and_exponent();
    let (half, one) = (simd.splat(0.5), simd.splat(1.0));
    let large = mantissa.greater(simd.splat(std::f64::consts::SQRT_2));
    let mantissa = (mantissa * half).keep_or(large, mantissa);
    let exponent = exponent + one.keep(large);
    let f = mantissa - one;
    let s = f / (f + simd.splat(2.0));
    let z = s * s;
    let mut series = simd.splat(2.0 / (2.0 * f64::from(TERMS) + 1.0));
    for i in (1..TERMS).rev() {
        series = series.mul_add(z, simd.splat(2.0 / (2.0 * f64::from(i) + 1.0)));
    }
    let series = series * z;
    let half_square = half * f * f;
    let small = s.mul_add(half_square + series, exponent * simd.splat(LN_2.1));
    exponent.mul_add(simd.splat(LN_2.0), f - (half_square - small))
}
