//! Geometry of many candidates or views side by side: one per lane of a vector.
//!
//! What lies in memory lies as structure of arrays: rows of one value per candidate.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

mod factor;
mod lens;
mod moments;
mod plane_moments;
mod symmetric;
mod transform;

use crate::simd::{Simd, Vector};

pub(crate) use factor::{factorise, log_pivots};
pub(crate) use lens::{DistortedPoint, Window, distort};
pub(crate) use moments::Sums;
pub(crate) use plane_moments::PlaneMoments;
pub(crate) use symmetric::{UPPER, triangle, upper};
pub(crate) use transform::{entries, left_product, right_product};

/// Lanes `at..` of each row.
#[inline(always)]
pub(crate) fn load<S: Simd, const N: usize, const WIDTH: usize>(
    simd: S,
    rows: &[[f64; WIDTH]; N],
    at: usize,
) -> [S::Vector; N] {
    let mut out = [simd.splat(0.0); N];
    for (vector, row) in out.iter_mut().zip(rows) {
        *vector = simd.load(&row[at..]);
    }
    out
}

/// Writes lanes `at..` of each row.
#[inline(always)]
pub(crate) fn store<V: Vector, const N: usize, const WIDTH: usize>(
    vectors: &[V; N],
    rows: &mut [[f64; WIDTH]; N],
    at: usize,
) {
    for (vector, row) in vectors.iter().zip(rows) {
        vector.store(&mut row[at..]);
    }
}
