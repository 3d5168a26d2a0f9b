//! Products of rigid transforms in lanes: rotation row by row, then translation.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use super::Se3;
use crate::simd::{Simd, Vector};

/// Rotation row by row, then translation.
pub(crate) fn entries(t: &Se3) -> [f64; 12] {
    let mut out = [0.0; 12];
    for i in 0..3 {
        for j in 0..3 {
            out[3 * i + j] = t.rotation[(i, j)];
        }
        out[9 + i] = t.translation[i];
    }
    out
}

/// `L A`, `L` the same for all lanes.
#[inline(always)]
pub(crate) fn left_product<S: Simd>(simd: S, left: &[f64; 12], a: &[S::Vector; 12]) -> [S::Vector; 12] {
    let mut out = *a;
    for i in 0..3 {
        let (p, q, r) = (simd.splat(left[3 * i]), simd.splat(left[3 * i + 1]), simd.splat(left[3 * i + 2]));
        for j in 0..3 {
            out[3 * i + j] = p.mul_add(a[j], q.mul_add(a[3 + j], r * a[6 + j]));
        }
        out[9 + i] = p.mul_add(a[9], q.mul_add(a[10], r.mul_add(a[11], simd.splat(left[9 + i]))));
    }
    out
}

/// `A R`, `R` the same for all lanes.
#[inline(always)]
pub(crate) fn right_product<S: Simd>(simd: S, a: &[S::Vector; 12], right: &[f64; 12]) -> [S::Vector; 12] {
    let mut out = *a;
    for i in 0..3 {
        let (p, q, r) = (a[3 * i], a[3 * i + 1], a[3 * i + 2]);
        for j in 0..4 {
            let (to, from) = if j < 3 { (3 * i + j, [j, 3 + j, 6 + j]) } else { (9 + i, [9, 10, 11]) };
            let first = r * simd.splat(right[from[2]]);
            let sum = p.mul_add(simd.splat(right[from[0]]), q.mul_add(simd.splat(right[from[1]]), first));
            out[to] = if j < 3 { sum } else { sum + a[9 + i] };
        }
    }
    out
}
