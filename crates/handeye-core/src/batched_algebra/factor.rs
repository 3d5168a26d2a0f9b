//! Factorisation of symmetric matrices of a size known at run time, by their upper triangles row by row.

use crate::simd::{Simd, Vector, ln};

/// Pivots that are multiplied before a logarithm is taken: their product stays a number.
const FACTORS: usize = 4;

/// `U' D^-1 U` in place, `D` the diagonal of `U`, and the inverses of `D`; whether all of `D` is positive.
///
/// With fewer `inverses` than rows only so many parameters are eliminated; below them stands what they leave of the
/// others.
#[inline(always)]
pub(crate) fn factorise<S: Simd>(
    simd: S,
    size: usize,
    triangle: &mut [S::Vector],
    inverses: &mut [S::Vector],
) -> <S::Vector as Vector>::Mask {
    let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
    let mut regular = one.greater(zero);
    let mut rest = triangle;
    for (k, inverse) in inverses.iter_mut().enumerate() {
        let (row, below) = rest.split_at_mut(size - k);
        regular = regular & row[0].greater(zero);
        *inverse = one / row[0];
        let mut left = &mut *below;
        for i in 1..row.len() {
            let factor = row[i] * *inverse;
            let (line, next) = left.split_at_mut(size - k - i);
            for (entry, above) in line.iter_mut().zip(&row[i..]) {
                *entry = factor.neg_mul_add(*above, *entry);
            }
            left = next;
        }
        rest = below;
    }
    regular
}

/// `ln` of the product of pivots `first..last` of what [`factorise`] has made of a matrix.
#[inline(always)]
pub(crate) fn log_pivots<S: Simd>(
    simd: S,
    size: usize,
    (first, last): (usize, usize),
    triangle: &[S::Vector],
) -> S::Vector {
    let mut sum = simd.splat(0.0);
    let mut product = simd.splat(1.0);
    for k in first..last {
        product = product * triangle[k * size - k * (k + 1) / 2 + k];
        if (k - first) % FACTORS == FACTORS - 1 || k + 1 == last {
            sum = sum + ln(simd, product);
            product = simd.splat(1.0);
        }
    }
    sum
}
