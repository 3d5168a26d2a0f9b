//! The step of the damped normal equations of twelve parameters.

use super::normal::{Matrix12, Vector12};
use crate::simd::{Kernel, Simd, Vector};

/// Twelve entries and a right side, up to a multiple of every unit's lanes.
const WIDTH: usize = 16;
const RIGHT: usize = 12;

/// `-h^-1 g` with `diagonal` added to that of `h`; `None` if the sum is not positive definite.
pub(super) struct Step<'a> {
    pub h: &'a Matrix12,
    pub g: &'a Vector12,
    pub diagonal: &'a Vector12,
}

#[repr(C, align(64))]
struct Equations([[f64; WIDTH]; 12]);

impl Kernel for Step<'_> {
    type Output = Option<Vector12>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let mut equations = Equations([[0.0; WIDTH]; 12]);
        let rows = &mut equations.0;
        for (i, row) in rows.iter_mut().enumerate() {
            row[..12].copy_from_slice(&self.h.as_slice()[12 * i..12 * (i + 1)]);
            row[i] += self.diagonal[i];
            row[RIGHT] = -self.g[i];
        }
        let mut inverses = [0.0; 12];
        for k in 0..12 {
            let (done, rest) = rows.split_at_mut(k + 1);
            let row = &done[k];
            if row[k].is_nan() || row[k] <= 0.0 {
                return None;
            }
            inverses[k] = 1.0 / row[k];
            for (line, i) in rest.iter_mut().zip(k + 1..) {
                let factor = simd.splat(row[i] * inverses[k]);
                for at in (0..WIDTH).step_by(S::LANES) {
                    let entry = simd.load(&line[at..]);
                    factor.neg_mul_add(simd.load(&row[at..]), entry).store(&mut line[at..]);
                }
            }
        }
        let mut step = Vector12::zeros();
        for k in (0..12).rev() {
            step[k] = rows[k][RIGHT] * inverses[k];
            for row in &mut rows[..k] {
                row[RIGHT] -= row[k] * step[k];
            }
        }
        Some(step)
    }
}
