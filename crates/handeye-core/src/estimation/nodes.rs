//! Where the levels are averaged over: deterministic points around their mode, in pairs.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Least curvature that is believed: no level is looked for further than two units of its logarithm away.
const LEAST_CURVATURE: f64 = 0.25;
/// How much wider than the Gaussian at the mode the points lie.
const WIDENING: f64 = 1.1;

/// Points, each with the logarithm of the density by which they were drawn.
pub(super) fn around(
    mode: &DVector<f64>,
    curvature: &DMatrix<f64>,
    pairs: usize,
) -> Vec<(DVector<f64>, f64)> {
    let d = mode.len();
    let eigen = SymmetricEigen::new((curvature + curvature.transpose()) * 0.5);
    let mut root = eigen.eigenvectors;
    for (mut column, value) in root.column_iter_mut().zip(eigen.eigenvalues.iter()) {
        column /= value.max(LEAST_CURVATURE).sqrt();
    }
    let mut points = Vec::with_capacity(2 * pairs + 1);
    points.push((mode.clone(), 0.0));
    for i in 0..pairs {
        let z = DVector::from_fn(d, |j, _| normal_quantile(spread(i, j, d)));
        let density = -0.5 * z.norm_squared();
        let step = &root * &z * WIDENING;
        points.push((mode + &step, density));
        points.push((mode - step, density));
    }
    points
}

/// Coordinate `j` of point `i` of a sequence that fills the cube evenly: the roots of `x^(d+1) = x + 1` as in Roberts's
/// generalisation of the golden ratio (2018).
fn spread(i: usize, j: usize, d: usize) -> f64 {
    let mut ratio = 2.0_f64;
    for _ in 0..40 {
        ratio = (1.0 + ratio).powf(1.0 / (d as f64 + 1.0));
    }
    let value = (0.5 + (i + 1) as f64 * ratio.powi(-(i32::try_from(j).unwrap_or(0) + 1))).fract();
    value.clamp(1e-4, 1.0 - 1e-4)
}

/// Quantile of the standard normal distribution, to 5e-4 (Abramowitz and Stegun, 26.2.23).
fn normal_quantile(p: f64) -> f64 {
    let tail = p.min(1.0 - p);
    let t = (-2.0 * tail.ln()).sqrt();
    let value = t
        - (2.515_517 + 0.802_853 * t + 0.010_328 * t * t)
            / (1.0 + 1.432_788 * t + 0.189_269 * t * t + 0.001_308 * t * t * t);
    if p < 0.5 { -value } else { value }
}
