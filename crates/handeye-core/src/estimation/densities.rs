//! Densities of twists under many covariances that differ in their diagonals, lanes = covariances.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::{Matrix6, Vector6};

use crate::batched_algebra::{factorise, log_pivots};
use crate::error::Error;
use crate::simd::{Kernel, MAX_LANES, Mask, Simd, Vector, VectorUnit, dispatch};

/// Logarithms of the densities of a twist under `covariance` with each of some variances beside it.
///
/// # Errors
/// [`Error::Numerical`] where a covariance is not positive.
pub fn log_densities(
    deviation: &Vector6<f64>,
    covariance: &Matrix6<f64>,
    variances: &[Vector6<f64>],
) -> Result<Vec<f64>, Error> {
    let mut out = vec![0.0; variances.len().next_multiple_of(MAX_LANES)];
    let kernel = Densities { deviation, covariance, variances, out: &mut out };
    if !dispatch(VectorUnit::widest(), kernel) {
        return Err(Error::numerical("the covariance of a twist is not positive"));
    }
    out.truncate(variances.len());
    Ok(out)
}

/// Rows of the covariance, and one of the twist: once the others are eliminated its last entry is minus the squared
/// distance.
const ROWS: usize = 7;

struct Densities<'a> {
    deviation: &'a Vector6<f64>,
    covariance: &'a Matrix6<f64>,
    variances: &'a [Vector6<f64>],
    out: &'a mut [f64],
}

impl Kernel for Densities<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let Self { deviation, covariance, variances, out } = self;
        let zero = simd.splat(0.0);
        let half = simd.splat(0.5);
        let constant = simd.splat(3.0 * std::f64::consts::TAU.ln());
        let mut regular = true;
        for (chunk, out) in variances.chunks(S::LANES).zip(out.chunks_exact_mut(S::LANES)) {
            let mut triangle = [zero; ROWS * (ROWS + 1) / 2];
            let mut at = 0;
            for i in 0..6 {
                let mut own = [0.0; MAX_LANES];
                for (lane, entry) in own.iter_mut().enumerate() {
                    // Lanes without variances repeat the first.
                    *entry = chunk.get(lane).unwrap_or(&chunk[0])[i];
                }
                triangle[at] = simd.splat(covariance[(i, i)]) + simd.load(&own);
                for j in i + 1..6 {
                    triangle[at + j - i] = simd.splat(covariance[(i, j)]);
                }
                triangle[at + 6 - i] = simd.splat(deviation[i]);
                at += ROWS - i;
            }
            let mut inverses = [zero; 6];
            regular &= factorise(simd, ROWS, &mut triangle, &mut inverses).all();
            let log_determinant = log_pivots(simd, ROWS, (0, 6), &triangle);
            ((triangle[at] - log_determinant) * half - constant).store(out);
        }
        regular
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn densities_are_gaussian() {
        let random = &mut Random::new(4);
        let mut vector = || Vector6::from_fn(|_, _| random.normal());
        let (root, deviation) = (Matrix6::from_fn(|_, _| vector()[0]), vector());
        let covariance = root * root.transpose() * 1e-4 + Matrix6::identity() * 1e-6;
        let variances: Vec<_> = (0..11).map(|_| vector().map(|v| v * v)).collect();
        let found = log_densities(&deviation, &covariance, &variances).unwrap();
        assert_eq!(found.len(), variances.len());
        for (found, variances) in found.into_iter().zip(&variances) {
            let factor = (covariance + Matrix6::from_diagonal(variances)).cholesky().unwrap();
            let distance = deviation.dot(&factor.solve(&deviation));
            let expected = -0.5 * (distance + factor.determinant().ln() + 6.0 * std::f64::consts::TAU.ln());
            assert!((found - expected).abs() < 1e-9 * expected.abs(), "{found} {expected}");
        }
        assert!(log_densities(&deviation, &-covariance, &[Vector6::zeros()]).is_err());
    }
}
