//! One double: formulas written over [`Simd`] serve single values too.
//!
//! A fused product would be a library call on a machine without the instruction, so products round here.

use super::vector::{Mask, Simd, Vector};

/// Always there.
#[derive(Clone, Copy)]
pub(crate) struct Scalar;

impl Simd for Scalar {
    type Vector = f64;

    const LANES: usize = 1;

    #[inline(always)]
    fn splat(self, value: f64) -> f64 {
        value
    }

    #[inline(always)]
    fn load(self, values: &[f64]) -> f64 {
        values[0]
    }

    #[inline(always)]
    fn load_four(self, values: &[f64], _stride: usize) -> [f64; 4] {
        [values[0], values[1], values[2], values[3]]
    }
}

impl Vector for f64 {
    type Mask = bool;

    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        values[0] = self;
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        self * factor + addend
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        addend - self * factor
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn greater(self, other: Self) -> bool {
        self > other
    }

    #[inline(always)]
    fn at_least(self, other: Self) -> bool {
        self >= other
    }

    #[inline(always)]
    fn keep(self, mask: bool) -> Self {
        if mask { self } else { 0.0 }
    }

    #[inline(always)]
    fn keep_or(self, mask: bool, other: Self) -> Self {
        if mask { self } else { other }
    }

    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        const FRACTION: u64 = (1 << 52) - 1;
        let bits = self.to_bits();
        let exponent = i32::try_from(bits >> 52).unwrap_or(0) - 1023;
        (f64::from_bits(bits & FRACTION | 1.0_f64.to_bits()), f64::from(exponent))
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        self
    }
}

impl Mask for bool {
    #[inline(always)]
    fn all(self) -> bool {
        self
    }
}
