//! The paper's criterion: entropy of all parameters (section IV, eq. 12 and 13).

use nalgebra::DMatrix;

use super::{Criterion, EntropyOf, Gain, Quantity, log_det_update};
use crate::error::Error;
use crate::information::Belief;

/// Decrease of the entropy of all parameters, nats.
#[derive(Clone, Copy, Debug, Default)]
pub struct Entropy;

struct Prepared<'a>(&'a Belief);

impl Criterion for Entropy {
    fn name(&self) -> &'static str {
        "entropy"
    }

    fn prepare<'a>(&'a self, belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error> {
        Ok(Box::new(Prepared(belief)))
    }

    fn quantity(&self) -> Option<Quantity> {
        Some(Quantity::Entropy(EntropyOf::Everything))
    }
}

impl Gain for Prepared<'_> {
    fn gain(&self, factor: &DMatrix<f64>) -> f64 {
        0.5 * log_det_update(self.0.covariance(), factor)
    }
}
