//! Entropy of the hand-eye block: what is learnt of `X`, everything else marginalised.

use nalgebra::DMatrix;

use super::{Criterion, EntropyOf, Gain, Quantity, log_det_update};
use crate::error::Error;
use crate::information::Belief;

/// Decrease of the entropy of `X` alone, nats: `ln |Lambda| - ln |Lambda_nn|` before and after.
#[derive(Clone, Copy, Debug, Default)]
pub struct EntropyHandEye;

struct Prepared<'a> {
    belief: &'a Belief,
    nuisance: DMatrix<f64>,
}

impl Criterion for EntropyHandEye {
    fn name(&self) -> &'static str {
        "entropy_handeye"
    }

    fn prepare<'a>(&'a self, belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error> {
        let (nuisance, _) = belief
            .nuisance()
            .ok_or_else(|| Error::degenerate("the information of the target's pose is singular"))?;
        Ok(Box::new(Prepared { belief, nuisance }))
    }

    fn quantity(&self) -> Option<Quantity> {
        Some(Quantity::Entropy(EntropyOf::HandEye))
    }
}

impl Gain for Prepared<'_> {
    fn gain(&self, factor: &DMatrix<f64>) -> f64 {
        let tail = factor.rows(6, factor.nrows() - 6).into_owned();
        0.5 * (log_det_update(self.belief.covariance(), factor) - log_det_update(&self.nuisance, &tail))
    }
}
