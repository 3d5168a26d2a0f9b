//! What the views say where every joint is displaced on its link, and by how much it then is.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::hypotheses::Hypothesis;
use super::links::LinkErrors;
use super::weigh::{Equations, View};
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

/// The views summed up under one level of displacement, the displacements integrated out.
pub(super) struct LinkSums {
    /// Of the parameters and the error.
    products: Products,
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
        let mut sums = Products::new(m + size);
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
            sums.add(1.0, &whitened);
        }
        // Each displacement has variance one beforehand.
        let own = sums.block(0, 0, m, m) + DMatrix::identity(m, m);
        let factor = own.cholesky()?;
        log_determinant += 2.0 * (0..m).map(|i| factor.l_dirty()[(i, i)].ln()).sum::<f64>();
        let across = sums.block(0, m, m, size);
        let explained = factor.l().solve_lower_triangular(&across)?;
        let mut products = sums.from(m);
        products.add(-1.0, &explained);
        let deviations = DVector::from_fn(m, |i, _| links.deviation(i, levels.0, levels.1));
        Some(Self { products, log_determinant, factor, across, deviations })
    }

    /// Writes the equations of the hypothesis at a place, and the constant of its likelihood.
    pub fn fill(&self, place: usize, equations: &mut Equations, constants: &mut [f64]) {
        let n = self.products.size - 1;
        for i in 0..n {
            for j in i..n {
                equations.information_row(i, j)[place] = self.products.entry(i, j);
            }
            equations.right_row(i)[place] = -self.products.entry(i, n);
        }
        constants[place] = self.products.entry(n, n) + self.log_determinant;
    }

    /// By how much the joints are most likely displaced, where the parameters are `theta`; metres and radians.
    pub fn displacements(&self, theta: &DVector<f64>) -> DVector<f64> {
        let n = theta.len();
        let pull = self.across.columns(0, n) * theta + self.across.column(n);
        -self.factor.solve(&pull).component_mul(&self.deviations)
    }
}

/// A sum of `A' A`: upper triangle, row by row, each padded to whole vectors.
struct Products {
    size: usize,
    width: usize,
    rows: Vec<f64>,
}

impl Products {
    fn new(size: usize) -> Self {
        let width = size.next_multiple_of(MAX_LANES);
        Self { size, width, rows: vec![0.0; size * width] }
    }

    fn entry(&self, i: usize, j: usize) -> f64 {
        self.rows[i.min(j) * self.width + i.max(j)]
    }

    fn block(&self, row: usize, column: usize, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| self.entry(row + i, column + j))
    }

    /// What stands from a row and column on.
    fn from(&self, first: usize) -> Self {
        let mut rest = Self::new(self.size - first);
        for (i, row) in rest.rows.chunks_exact_mut(rest.width).enumerate() {
            let line = &self.rows[(first + i) * self.width..];
            row[..self.size - first].copy_from_slice(&line[first..self.size]);
        }
        rest
    }

    /// Adds `factor A' A`.
    fn add(&mut self, factor: f64, a: &DMatrix<f64>) {
        let mut rows = vec![0.0; a.nrows() * self.width];
        for (i, row) in rows.chunks_exact_mut(self.width).enumerate() {
            for (j, entry) in row[..self.size].iter_mut().enumerate() {
                *entry = a[(i, j)];
            }
        }
        dispatch(VectorUnit::widest(), AddProducts { factor, rows: &rows, sums: self });
    }
}

struct AddProducts<'a> {
    factor: f64,
    rows: &'a [f64],
    sums: &'a mut Products,
}

impl Kernel for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let width = self.sums.width;
        for (i, sums) in self.sums.rows.chunks_exact_mut(width).enumerate() {
            for at in (i / S::LANES * S::LANES..width).step_by(S::LANES) {
                let mut sum = simd.load(&sums[at..]);
                for row in self.rows.chunks_exact(width) {
                    sum = simd.splat(self.factor * row[i]).mul_add(simd.load(&row[at..]), sum);
                }
                sum.store(&mut sums[at..]);
            }
        }
    }
}
