//! The normal equations of twelve parameters, and the step of the damped ones.

use nalgebra::{DMatrix, Matrix6, SVector, Vector6};

use crate::simd::{Kernel, Simd, Vector};

pub(super) type Vector12 = SVector<f64, 12>;

/// Twelve entries and the gradient, up to a multiple of every unit's lanes.
const WIDTH: usize = 16;
const GRADIENT: usize = 12;

/// Upper triangle of the information of `[xi_x; xi_y]`, and the gradient; the rest means nothing.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Equations([[f64; WIDTH]; 12]);

impl Equations {
    pub fn new() -> Self {
        Self([[0.0; WIDTH]; 12])
    }

    /// Entry of the information with `i <= j`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, j: usize, value: f64) {
        self.0[i][j] = value;
    }

    #[inline(always)]
    pub fn set_gradient(&mut self, i: usize, value: f64) {
        self.0[i][GRADIENT] = value;
    }

    /// Adds to a block on the diagonal, and to its part of the gradient.
    pub fn add(&mut self, at: usize, information: &Matrix6<f64>, gradient: &Vector6<f64>) {
        for i in 0..6 {
            for j in i..6 {
                self.0[at + i][at + j] += information[(i, j)];
            }
            self.0[at + i][GRADIENT] += gradient[i];
        }
    }

    pub fn gradient(&self) -> Vector12 {
        Vector12::from_fn(|i, _| self.0[i][GRADIENT])
    }

    pub fn diagonal(&self) -> Vector12 {
        Vector12::from_fn(|i, _| self.0[i][i])
    }

    pub fn information(&self) -> DMatrix<f64> {
        DMatrix::from_fn(12, 12, |i, j| self.0[i.min(j)][i.max(j)])
    }
}

/// The solution of the equations with `damping` added to the diagonal and the gradient's sign changed; `None` if they
/// are not positive definite.
///
/// The elimination is that of [`crate::positive`] with the size known: sharing it costs a small solve a tenth more
/// instructions.
pub(super) struct Step<'a> {
    pub equations: &'a Equations,
    pub damping: &'a Vector12,
}

impl Kernel for Step<'_> {
    type Output = Option<Vector12>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let mut equations = self.equations.clone();
        let rows = &mut equations.0;
        let mut inverses = [0.0; 12];
        for k in 0..12 {
            let (done, rest) = rows.split_at_mut(k + 1);
            let row = &done[k];
            // No row below reads the diagonal of this one.
            let pivot = row[k] + self.damping[k];
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            inverses[k] = 1.0 / pivot;
            for (line, i) in rest.iter_mut().zip(k + 1..) {
                let factor = simd.splat(row[i] * inverses[k]);
                // What lies left of the diagonal is not read.
                for at in (i / S::LANES * S::LANES..WIDTH).step_by(S::LANES) {
                    let entry = simd.load(&line[at..]);
                    factor.neg_mul_add(simd.load(&row[at..]), entry).store(&mut line[at..]);
                }
            }
        }
        let mut step = [0.0; 12];
        for k in 0..12 {
            step[k] = -rows[k][GRADIENT];
        }
        for k in (0..12).rev() {
            step[k] *= inverses[k];
            for i in 0..k {
                step[i] -= rows[i][k] * step[k];
            }
        }
        Some(step.into())
    }
}
