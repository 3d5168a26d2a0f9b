//! T-optimality: the sum of the eigenvalues of the scaled information of `X` and `Y`.

use nalgebra::DMatrix;

use super::{Criterion, Gain, Quantity, Scales};
use crate::error::Error;
use crate::information::Belief;
use crate::information::belief::CHAIN;

/// Increase of the sum of eigenvalues of the information, each parameter in units of its scale.
///
/// It is blind to what is known already: a candidate's value does not depend on the views before it.
#[derive(Clone, Copy, Debug, Default)]
pub struct EigenvalueSum {
    /// What counts as equal.
    pub scales: Scales,
}

impl Criterion for EigenvalueSum {
    fn name(&self) -> &'static str {
        "eigenvalue_sum"
    }

    fn prepare<'a>(&'a self, _belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error> {
        Ok(Box::new(*self))
    }

    fn quantity(&self) -> Option<Quantity> {
        Some(Quantity::InformationTrace(self.scales.all()))
    }
}

impl Gain for EigenvalueSum {
    fn gain(&self, factor: &DMatrix<f64>) -> f64 {
        (0..CHAIN).map(|i| factor.row(i).norm_squared() * self.scales.of(i).powi(2)).sum()
    }
}
