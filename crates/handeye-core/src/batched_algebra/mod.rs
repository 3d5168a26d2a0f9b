//! Linear algebra of many candidates or views side by side: one per lane of a vector.
//!
//! Memory holds structures of arrays: rows with one value per candidate.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

mod factor;
mod moments;
mod plane_moments;
mod symmetric;

use crate::simd::{Simd, Vector};

pub(crate) use factor::{factorise, log_pivots};
pub(crate) use moments::Sums;
pub(crate) use plane_moments::PlaneMoments;
pub(crate) use symmetric::{UPPER, upper};

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

/// Writes the column of a lane into rows.
pub(crate) fn set_lane<const N: usize, const WIDTH: usize>(
    rows: &mut [[f64; WIDTH]; N],
    lane: usize,
    values: &[f64; N],
) {
    for (row, value) in rows.iter_mut().zip(values) {
        row[lane] = *value;
    }
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
