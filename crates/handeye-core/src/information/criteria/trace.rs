//! A-optimality: the trace of the scaled covariance of `X` and `Y`.

use nalgebra::DMatrix;

use super::{Criterion, Gain, Quantity, Scales, covariance_decrease};
use crate::error::Error;
use crate::information::Belief;
use crate::information::belief::CHAIN;

/// Decrease of the trace of the covariance, each parameter in units of its scale.
#[derive(Clone, Copy, Debug, Default)]
pub struct Trace {
    /// What counts as equal.
    pub scales: Scales,
}

struct Prepared<'a>(&'a Trace, &'a Belief);

impl Criterion for Trace {
    fn name(&self) -> &'static str {
        "trace"
    }

    fn prepare<'a>(&'a self, belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error> {
        Ok(Box::new(Prepared(self, belief)))
    }

    fn quantity(&self) -> Option<Quantity> {
        Some(Quantity::CovarianceTrace(self.scales.all().map(|scale| 1.0 / scale)))
    }
}

impl Gain for Prepared<'_> {
    fn gain(&self, factor: &DMatrix<f64>) -> f64 {
        covariance_decrease(self.1.covariance(), factor, CHAIN)
            .map_or(f64::NAN, |d| (0..CHAIN).map(|i| d[(i, i)] / self.0.scales.of(i).powi(2)).sum())
    }
}
