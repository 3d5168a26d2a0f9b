//! Errors of the robot that change smoothly with its posture: alike where postures are alike.
//!
//! Links and joints that are not as the controller believes them err the same way in the same posture. Such an error
//! is a Gaussian process over postures with correlation `C` between views; with `C ~ F F'` it is a sum of a few
//! functions of the posture whose coefficients are twists of their own (Rasmussen and Williams, "Gaussian Processes
//! for Machine Learning", 2006, section 2.2). The coefficients are integrated out like any other parameter.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::error::Error;

/// Share of the variance that is each view's own however alike the postures.
const OWN_SHARE: f64 = 0.1;
/// Functions that carry less of a view's variance than this are left to the views' own share.
const SMALLEST_FUNCTION: f64 = 0.01;

/// The functions of which a smooth error is made, at the postures of the views.
#[derive(Clone, Debug)]
pub struct SmoothError {
    /// Value of each function (rows) at each view (columns).
    functions: DMatrix<f64>,
    /// Share of the variance that is each view's own.
    own: Vec<f64>,
}

impl SmoothError {
    /// From the correlation of the error between the views: symmetric, positive semi-definite, ones on the diagonal.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a matrix that is not such.
    pub fn new(correlation: &DMatrix<f64>) -> Result<Self, Error> {
        let n = correlation.nrows();
        let unlike = |i: usize, j: usize| (correlation[(i, j)] - correlation[(j, i)]).abs() > 1e-9;
        if correlation.ncols() != n
            || (0..n).any(|i| (correlation[(i, i)] - 1.0).abs() > 1e-9)
            || (0..n).any(|i| (0..n).any(|j| !correlation[(i, j)].is_finite() || unlike(i, j)))
        {
            return Err(Error::invalid("a correlation is symmetric with ones on its diagonal"));
        }
        let eigen = SymmetricEigen::new(correlation.clone());
        if eigen.eigenvalues.iter().any(|v| *v < -1e-6 * n as f64) {
            return Err(Error::invalid("a correlation has no negative eigenvalues"));
        }
        let kept: Vec<usize> = (0..n).filter(|i| eigen.eigenvalues[*i] > SMALLEST_FUNCTION).collect();
        let functions = DMatrix::from_fn(kept.len(), n, |j, k| {
            eigen.eigenvectors[(k, kept[j])] * (eigen.eigenvalues[kept[j]] * (1.0 - OWN_SHARE)).sqrt()
        });
        let own = (0..n).map(|k| (1.0 - functions.column(k).norm_squared()).max(OWN_SHARE)).collect();
        Ok(Self { functions, own })
    }

    /// Refuses another number of views than it was made for.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] if the number differs.
    pub(super) fn check(&self, views: usize) -> Result<(), Error> {
        if self.own.len() != views {
            return Err(Error::invalid(format!("{views} views, and a smooth error for {}", self.own.len())));
        }
        Ok(())
    }

    /// Share of the variance that is view `k`'s own.
    pub(super) fn own(&self, k: usize) -> f64 {
        self.own[k]
    }

    /// Number of coefficients: a twist for each function.
    pub(super) fn coefficients(&self) -> usize {
        6 * self.functions.nrows()
    }

    /// Values of the functions at view `k`.
    pub(super) fn functions(&self, k: usize) -> &[f64] {
        let count = self.functions.nrows();
        &self.functions.as_slice()[k * count..(k + 1) * count]
    }
}
