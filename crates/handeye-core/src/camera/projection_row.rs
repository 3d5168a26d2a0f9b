//! How a pixel moves with the pose of the target: a single one, or one in each lane.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use crate::batched_algebra::{UPPER, upper};
use crate::simd::Vector;

/// A row of `d pi / d eta` in the left perturbation `[rho; phi]` of `T_camera_target`, third and fourth entry with the
/// opposite sign: sums of squares save two negations a point, and [`restore_signs`] puts them right at the end.
///
/// With `(A, B)` a row of the focal lengths times the lens' Jacobian at `(x, y)`, `w` the inverse depth and
/// `s = x A + y B`, the row is `[A w, B w, -s w, -(y s + B), A + x s, B x - A y]`.
#[inline(always)]
pub(crate) fn projection_row<V: Vector>((a, b): (V, V), w: V, x: V, y: V) -> [V; 6] {
    let s = a.mul_add(x, b * y);
    [a * w, b * w, s * w, y.mul_add(s, b), x.mul_add(s, a), b.mul_add(x, -(a * y))]
}

/// Puts the signs of a sum of squares of [`projection_row`] right.
#[inline(always)]
pub(crate) fn restore_signs<V: Vector>(information: &mut [V; UPPER]) {
    for i in [2, 3] {
        for j in [0, 1, 4, 5] {
            information[upper(i, j)] = -information[upper(i, j)];
        }
    }
}
