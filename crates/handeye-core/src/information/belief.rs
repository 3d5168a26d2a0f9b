//! The current information about all parameters, and its inverse.

use nalgebra::{DMatrix, Matrix6};

use crate::error::Error;
use crate::positive::Factor;

/// Number of parameters of `X` and `Y`.
pub const CHAIN: usize = 12;

/// Information `Lambda` of the global parameters `[xi_x, xi_y, c, q]` with what every gain needs of it.
#[derive(Clone, Debug)]
pub struct Belief {
    information: DMatrix<f64>,
    covariance: DMatrix<f64>,
    log_determinant: f64,
}

impl Belief {
    /// # Errors
    /// [`Error::Degenerate`] if the information is not positive definite: some direction is not determined yet.
    /// [`Error::InvalidInput`] if it is not square with at least twelve rows.
    pub fn new(information: DMatrix<f64>) -> Result<Self, Error> {
        let n = information.nrows();
        if n < CHAIN || information.ncols() != n {
            return Err(Error::invalid(format!("information must be square with at least 12 rows, not {n}")));
        }
        let (covariance, log_determinant) = invert(&information).ok_or_else(|| {
            Error::degenerate("the information is singular: the views do not determine the answer")
        })?;
        Ok(Self { information, covariance, log_determinant })
    }

    /// `Lambda`.
    pub fn information(&self) -> &DMatrix<f64> {
        &self.information
    }

    /// `Lambda^-1`.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// `ln |Lambda|`.
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Number of parameters.
    pub fn len(&self) -> usize {
        self.information.nrows()
    }

    /// Never: a belief has at least twelve parameters.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Covariance of the hand-eye twist `xi_x`.
    pub fn hand_eye_covariance(&self) -> Matrix6<f64> {
        self.covariance.fixed_view::<6, 6>(0, 0).into_owned()
    }

    /// Differential entropy of all parameters, nats: `1/2 ln((2 pi e)^n |Sigma|)` (paper, section IV).
    pub fn entropy(&self) -> f64 {
        entropy(self.len(), -self.log_determinant)
    }

    /// Differential entropy of the hand-eye block alone.
    pub fn hand_eye_entropy(&self) -> f64 {
        let nuisance = self.information.view((6, 6), (self.len() - 6, self.len() - 6)).into_owned();
        match invert(&nuisance) {
            Some((_, log_determinant)) => entropy(6, log_determinant - self.log_determinant),
            None => f64::NAN,
        }
    }

    /// Inverse and log-determinant of the information of everything but the hand-eye.
    pub(crate) fn nuisance(&self) -> Option<(DMatrix<f64>, f64)> {
        let n = self.len() - 6;
        invert(&self.information.view((6, 6), (n, n)).into_owned())
    }
}

/// Entropy of a Gaussian of `n` dimensions with `ln |Sigma|`.
pub fn entropy(n: usize, log_determinant_covariance: f64) -> f64 {
    let two_pi_e = std::f64::consts::TAU * std::f64::consts::E;
    0.5 * (n as f64 * two_pi_e.ln() + log_determinant_covariance)
}

/// Inverse and log-determinant of a positive definite matrix.
pub(super) fn invert(m: &DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    if m.as_slice().iter().any(|x| !x.is_finite()) {
        return None;
    }
    let factor = Factor::new(m)?;
    let inverse = factor.inverse();
    inverse.as_slice().iter().all(|x| x.is_finite()).then(|| (inverse, factor.log_determinant()))
}
