//! How well a covariance is known that was averaged over levels.

use nalgebra::{DMatrix, Matrix6};

/// Fewest degrees of freedom: below, regions would have no useful quantile.
const FEWEST_DEGREES_OF_FREEDOM: f64 = 4.5;

/// Degrees of freedom of a covariance that is known only so well.
///
/// A variance of `nu` degrees of freedom spreads by `2 / nu` in its logarithm. How much that of the nodes' covariances
/// does is the mean over all directions, each in units of what is likeliest: of a symmetric matrix `A` the mean of
/// `(u' A u)^2` over unit vectors in `n` dimensions is `(2 |A|^2 + tr(A)^2) / (n (n + 2))`.
pub(super) fn degrees_of_freedom<'a>(
    nodes: impl Iterator<Item = (f64, &'a DMatrix<f64>)>,
    block: impl Fn(&DMatrix<f64>) -> Matrix6<f64>,
) -> f64 {
    let nodes: Vec<(f64, Matrix6<f64>)> = nodes.map(|(weight, all)| (weight, block(all))).collect();
    let total: f64 = nodes.iter().map(|n| n.0).sum();
    let mean = |of: &dyn Fn(usize) -> Matrix6<f64>| -> Matrix6<f64> {
        (0..nodes.len()).map(|i| of(i) * (nodes[i].0 / total)).sum()
    };
    let Some(unit) = mean(&|i| nodes[i].1).cholesky().and_then(|f| f.l().try_inverse()) else {
        return FEWEST_DEGREES_OF_FREEDOM;
    };
    let logarithms: Vec<Matrix6<f64>> = nodes
        .iter()
        .map(|(_, covariance)| {
            let mut eigen = (unit * covariance * unit.transpose()).symmetric_eigen();
            eigen.eigenvalues.apply(|x| *x = x.max(f64::MIN_POSITIVE).ln());
            eigen.recompose()
        })
        .collect();
    let centre = mean(&|i| logarithms[i]);
    let spread: f64 = logarithms
        .iter()
        .zip(nodes)
        .map(|(a, (weight, _))| {
            let away = a - centre;
            weight * (2.0 * away.norm_squared() + away.trace().powi(2)) / 48.0
        })
        .sum();
    (2.0 * total / spread.max(1e-12)).max(FEWEST_DEGREES_OF_FREEDOM)
}
