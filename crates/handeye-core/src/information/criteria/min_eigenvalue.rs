//! E-optimality: the least known direction of the hand-eye.

use nalgebra::{DMatrix, Matrix6};

use super::{Criterion, Gain, Quantity, Scales, hand_eye_decrease};
use crate::error::Error;
use crate::information::Belief;

/// Half the logarithm by which the largest scaled variance of `X` shrinks.
#[derive(Clone, Copy, Debug, Default)]
pub struct MinEigenvalue {
    /// What counts as equal; the ranking of candidates depends on it.
    pub scales: Scales,
}

struct Prepared<'a> {
    belief: &'a Belief,
    scales: Matrix6<f64>,
    before: f64,
}

impl Criterion for MinEigenvalue {
    fn name(&self) -> &'static str {
        "min_eigenvalue"
    }

    fn prepare<'a>(&'a self, belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error> {
        let scales = Matrix6::from_fn(|i, j| if i == j { 1.0 / self.scales.of(i) } else { 0.0 });
        let before = largest(&(scales * belief.hand_eye_covariance() * scales));
        Ok(Box::new(Prepared { belief, scales, before }))
    }

    fn quantity(&self) -> Option<Quantity> {
        Some(Quantity::HandEyeCovariance)
    }
}

impl Gain for Prepared<'_> {
    fn gain(&self, factor: &DMatrix<f64>) -> f64 {
        hand_eye_decrease(self.belief.covariance(), factor).map_or(f64::NAN, |d| self.gain_of_decrease(&d))
    }

    fn gain_of_decrease(&self, decrease: &Matrix6<f64>) -> f64 {
        let after = self.belief.hand_eye_covariance() - decrease;
        0.5 * (self.before / largest(&(self.scales * after * self.scales))).ln()
    }
}

fn largest(m: &Matrix6<f64>) -> f64 {
    m.symmetric_eigenvalues().max()
}
