//! What the views say where every joint is displaced on its link, and by how much it then is.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::hypotheses::Hypothesis;
use super::links::LinkErrors;
use super::weigh::{Equations, View};

/// The views summed up under one level of displacement, the displacements integrated out.
pub(super) struct LinkSums {
    /// Of the parameters and the error.
    products: DMatrix<f64>,
    /// `sum ln |Sigma_k|`, and that of the displacements.
    log_determinant: f64,
    /// Factor of the information of the displacements in units of their deviations.
    factor: Cholesky<f64, Dyn>,
    /// Their products with the parameters and the error.
    across: DMatrix<f64>,
    deviations: DVector<f64>,
}

impl LinkSums {
    /// `None` where a covariance is not positive definite.
    pub fn new(views: &[View], noise: &Hypothesis, links: &LinkErrors) -> Option<Self> {
        let size = views.first()?.rows().ncols();
        let levels = (noise.translation_m, noise.rotation_rad);
        let m = links.coefficients();
        // Displacements come first: eliminating them is then the start of a factorisation.
        let mut whitened = DMatrix::zeros(6, m + size);
        let mut sums = DMatrix::zeros(m + size, m + size);
        let mut log_determinant = 0.0;
        for (k, view) in views.iter().enumerate() {
            let own = links.fill(k, view.left(), levels, noise.own_share, &mut whitened);
            let factor = (view.pixel_covariance() + own).cholesky()?;
            let lower = factor.l();
            log_determinant += 2.0 * (0..6).map(|i| lower[(i, i)].ln()).sum::<f64>();
            whitened.columns_mut(m, size).copy_from(view.rows());
            if !lower.solve_lower_triangular_mut(&mut whitened) {
                return None;
            }
            sums.gemm_tr(1.0, &whitened, &whitened, 1.0);
        }
        // Each displacement has variance one beforehand.
        let own = sums.view((0, 0), (m, m)) + DMatrix::identity(m, m);
        let factor = own.cholesky()?;
        log_determinant += 2.0 * (0..m).map(|i| factor.l_dirty()[(i, i)].ln()).sum::<f64>();
        let across = sums.view((0, m), (m, size)).into_owned();
        let explained = factor.l().solve_lower_triangular(&across)?;
        let mut products = sums.view((m, m), (size, size)).into_owned();
        products.gemm_tr(-1.0, &explained, &explained, 1.0);
        let deviations = DVector::from_fn(m, |i, _| links.deviation(i, levels.0, levels.1));
        Some(Self { products, log_determinant, factor, across, deviations })
    }

    /// Writes the equations of the hypothesis at a place, and the constant of its likelihood.
    pub fn fill(&self, place: usize, equations: &mut Equations, constants: &mut [f64]) {
        let n = self.products.ncols() - 1;
        for i in 0..n {
            for j in i..n {
                equations.information_row(i, j)[place] = self.products[(i, j)];
            }
            equations.right_row(i)[place] = -self.products[(i, n)];
        }
        constants[place] = self.products[(n, n)] + self.log_determinant;
    }

    /// By how much the joints are most likely displaced, where the parameters are `theta`; metres and radians.
    pub fn displacements(&self, theta: &DVector<f64>) -> DVector<f64> {
        let n = theta.len();
        let pull = self.across.columns(0, n) * theta + self.across.column(n);
        -self.factor.solve(&pull).component_mul(&self.deviations)
    }
}
