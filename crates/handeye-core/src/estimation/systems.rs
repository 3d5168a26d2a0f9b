//! Symmetric systems whose size is known at run time, one per lane: upper triangles row by row, each row with the
//! right side behind it.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]
#![expect(clippy::needless_range_loop, reason = "indices of matrices: several are read at the same place")]

use crate::simd::{Simd, Vector, ln};

/// Entries of a system of `n` unknowns.
pub(super) const fn entries_of(n: usize) -> usize {
    (n + 1) * (n + 2) / 2 - 1
}

/// Where row `i` begins, with its entry on the diagonal.
#[inline(always)]
pub(super) fn start_of(n: usize, i: usize) -> usize {
    i * (n + 1) - i * i.saturating_sub(1) / 2
}

/// `U' D^-1 U` in place, `D` the diagonal of `U`, the right side along with it, and the inverses of `D`, none of
/// which is smaller than a share of its entry before; the logarithm of the determinant.
#[inline(always)]
pub(super) fn eliminate<S: Simd>(
    simd: S,
    n: usize,
    share: f64,
    system: &mut [S::Vector],
    inverses: &mut [S::Vector],
) -> S::Vector {
    let one = simd.splat(1.0);
    // Before they change: the smallest that each pivot may be.
    for i in 0..n {
        inverses[i] = system[start_of(n, i)] * simd.splat(share);
    }
    let mut log_determinant = simd.splat(0.0);
    let mut rest = system;
    for k in 0..n {
        let (row, below) = rest.split_at_mut(n + 1 - k);
        row[0] = row[0].max(inverses[k]);
        log_determinant = log_determinant + ln(simd, row[0]);
        inverses[k] = one / row[0];
        let mut left = &mut *below;
        for i in 1..n - k {
            let factor = row[i] * inverses[k];
            let (line, next) = left.split_at_mut(n + 1 - k - i);
            for (entry, above) in line.iter_mut().zip(&row[i..]) {
                *entry = factor.neg_mul_add(*above, *entry);
            }
            left = next;
        }
        rest = below;
    }
    log_determinant
}

/// The solution of what [`eliminate`] has left, with the sign of the right side changed.
#[inline(always)]
pub(super) fn substitute<V: Vector>(n: usize, system: &[V], inverses: &[V], solution: &mut [V]) {
    for i in (0..n).rev() {
        let row = start_of(n, i);
        let mut sum = -system[row + n - i];
        for j in i + 1..n {
            sum = system[row + j - i].neg_mul_add(solution[j], sum);
        }
        solution[i] = sum * inverses[i];
    }
}
