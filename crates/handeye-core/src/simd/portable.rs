//! Plain arithmetic: two doubles side by side, which the compiler may put into one register.
//!
//! A fused product would be a library call on a machine without the instruction, so products round here.

use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use super::{Mask, Simd, Vector};

const LANES: usize = 2;

/// Always there.
#[derive(Clone, Copy)]
pub(super) struct Portable;

#[derive(Clone, Copy)]
pub(super) struct Doubles([f64; LANES]);

#[derive(Clone, Copy)]
pub(super) struct Truths([bool; LANES]);

impl Simd for Portable {
    type Vector = Doubles;

    const LANES: usize = LANES;

    #[inline(always)]
    fn splat(self, value: f64) -> Doubles {
        Doubles([value; LANES])
    }

    #[inline(always)]
    fn load(self, values: &[f64]) -> Doubles {
        Doubles([values[0], values[1]])
    }

    #[inline(always)]
    fn load_four(self, values: &[f64], stride: usize) -> [Doubles; 4] {
        let (a, b) = (&values[..4], &values[stride..stride + 4]);
        [Doubles([a[0], b[0]]), Doubles([a[1], b[1]]), Doubles([a[2], b[2]]), Doubles([a[3], b[3]])]
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Doubles {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self([self.0[0] $operator other.0[0], self.0[1] $operator other.0[1]])
            }
        }
    };
}

lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);
lanewise!(Div, div, /);

impl Neg for Doubles {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1]])
    }
}

impl Vector for Doubles {
    type Mask = Truths;

    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        values[..LANES].copy_from_slice(&self.0);
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
        Self([self.0[0].abs(), self.0[1].abs()])
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.keep_or(self.greater(other), other)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self([self.0[0].sqrt(), self.0[1].sqrt()])
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Truths {
        Truths([self.0[0] > other.0[0], self.0[1] > other.0[1]])
    }

    #[inline(always)]
    fn at_least(self, other: Self) -> Truths {
        Truths([self.0[0] >= other.0[0], self.0[1] >= other.0[1]])
    }

    #[inline(always)]
    fn keep(self, mask: Truths) -> Self {
        self.keep_or(mask, Self([0.0; LANES]))
    }

    #[inline(always)]
    fn keep_or(self, mask: Truths, other: Self) -> Self {
        Self([if mask.0[0] { self.0[0] } else { other.0[0] }, if mask.0[1] { self.0[1] } else { other.0[1] }])
    }

    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        let (a, b) = (split(self.0[0]), split(self.0[1]));
        (Self([a.0, b.0]), Self([a.1, b.1]))
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        self.0[0] + self.0[1]
    }
}

#[inline(always)]
fn split(value: f64) -> (f64, f64) {
    const FRACTION: u64 = (1 << 52) - 1;
    let bits = value.to_bits();
    let exponent = i32::try_from(bits >> 52).unwrap_or(0) - 1023;
    (f64::from_bits(bits & FRACTION | 1.0_f64.to_bits()), f64::from(exponent))
}

impl BitAnd for Truths {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self([self.0[0] & other.0[0], self.0[1] & other.0[1]])
    }
}

impl Mask for Truths {
    #[inline(always)]
    fn all(self) -> bool {
        self.0[0] & self.0[1]
    }
}
