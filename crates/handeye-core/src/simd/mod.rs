//! Vectors of doubles, and the choice of the widest vector unit at run time.
//!
//! Kernels are written once over [`Simd`] and compiled once per unit; [`dispatch`] runs the one wanted. A [`Simd`]
//! value is proof that the machine has the unit: vectors come only out of such a value, so safe code cannot reach an
//! instruction that the machine lacks. All `unsafe` of the crate is in this room.
//!
//! A kernel must be inlined whole into the entry of its unit, where the unit's instructions are enabled: functions
//! over [`Simd`] are `#[inline(always)]`, and closures are kept out of inner loops.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod logarithm;
mod portable;
#[cfg(test)]
mod tests;
mod trigonometry;
mod twin;

use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

pub(crate) use logarithm::ln;
pub(crate) use trigonometry::{LARGEST_ANGLE, sin_cos};
pub(crate) use twin::Twin;

/// Doubles of the widest vector.
pub(crate) const MAX_LANES: usize = 8;

/// A vector unit that kernels are compiled for, narrowest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum VectorUnit {
    /// Whatever the compiler makes of plain arithmetic; every machine.
    Portable,
    /// x86-64 with AVX2 and FMA: 4 doubles.
    Avx2,
    /// x86-64 with AVX-512 F, DQ and VL: 8 doubles.
    Avx512,
}

impl VectorUnit {
    /// All units, narrowest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// Whether this machine has the unit.
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::Avx2::detect().is_some(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => avx512::Avx512::detect().is_some(),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The widest unit of this machine.
    pub fn widest() -> Self {
        Self::ALL.into_iter().rev().find(|unit| unit.is_available()).unwrap_or(Self::Portable)
    }

    /// Stable name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

/// Work that is compiled for every unit.
pub(crate) trait Kernel {
    /// What it gives.
    type Output;

    /// Does the work; `#[inline(always)]` in every implementation.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs a kernel on a unit, on plain arithmetic if the machine lacks it.
#[inline]
pub(crate) fn dispatch<K: Kernel>(unit: VectorUnit, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if unit == VectorUnit::Avx512
            && let Some(simd) = avx512::Avx512::detect()
        {
            return avx512::run(simd, kernel);
        }
        if unit == VectorUnit::Avx2
            && let Some(simd) = avx2::Avx2::detect()
        {
            return avx2::run(simd, kernel);
        }
    }
    let _ = unit;
    kernel.run(portable::Portable)
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
