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
mod scalar;
#[cfg(test)]
mod tests;
mod trigonometry;
mod twin;
mod vector;

pub(crate) use logarithm::ln;
pub(crate) use scalar::Scalar;
pub(crate) use trigonometry::{LARGEST_ANGLE, sin_cos};
pub(crate) use twin::Twin;
pub(crate) use vector::{Kernel, MAX_LANES, Mask, Simd, Vector};

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
    kernel.run(Twin(Scalar))
}
