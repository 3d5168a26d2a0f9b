//! What a vector unit offers, and what a kernel is.

use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

/// Doubles of the widest vector.
pub(crate) const MAX_LANES: usize = 8;

/// Work that is compiled for every unit.
pub(crate) trait Kernel {
    /// What it gives.
    type Output;

    /// Does the work; `#[inline(always)]` in every implementation.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// A vector unit at hand: where vectors come from.
pub(crate) trait Simd: Copy {
    /// Its vectors.
    type Vector: Vector;

    /// Doubles in a vector; a power of two, at most [`MAX_LANES`] in one of a unit.
    const LANES: usize;

    /// The same value in all lanes.
    fn splat(self, value: f64) -> Self::Vector;

    /// The first values of a slice that holds at least [`Simd::LANES`].
    fn load(self, values: &[f64]) -> Self::Vector;

    /// Four neighbours per lane, transposed: entry `i` holds `values[lane * stride + i]`.
    fn load_four(self, values: &[f64], stride: usize) -> [Self::Vector; 4];
}

/// One double per lane.
pub(crate) trait Vector:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// One truth value per lane.
    type Mask: Mask;

    /// Writes the lanes to the front of a slice that holds as many.
    fn store(self, values: &mut [f64]);

    /// `self * factor + addend`, fused where the unit can.
    fn mul_add(self, factor: Self, addend: Self) -> Self;

    /// `addend - self * factor`, fused where the unit can.
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self;

    /// Magnitudes.
    fn abs(self) -> Self;

    /// The larger of each pair; `other` where one is not a number.
    fn max(self, other: Self) -> Self;

    /// Square roots.
    fn sqrt(self) -> Self;

    /// Whether `self > other`; false where one is not a number.
    fn greater(self, other: Self) -> Self::Mask;

    /// Whether `self >= other`; false where one is not a number.
    fn at_least(self, other: Self) -> Self::Mask;

    /// The lanes where `mask` holds, zero elsewhere (also in place of infinity and NaN).
    fn keep(self, mask: Self::Mask) -> Self;

    /// The lanes where `mask` holds, those of `other` elsewhere.
    fn keep_or(self, mask: Self::Mask, other: Self) -> Self;

    /// `m` in `[1, 2)` and `k` with `self = m 2^k`; for positive normal numbers.
    fn mantissa_and_exponent(self) -> (Self, Self);

    /// Sum over the lanes, by halves.
    fn sum(self) -> f64;
}

/// One truth value per lane.
pub(crate) trait Mask: Copy + BitAnd<Output = Self> {
    /// Whether it holds in every lane.
    fn all(self) -> bool;
}
