//! What is asked of a calibration: how far off its position and its rotation may be, both alike.

use nalgebra::{DMatrix, Matrix6};

use super::{Criterion, Gain, Quantity, hand_eye_decrease};
use crate::error::Error;
use crate::information::Belief;

/// By how much the logarithm of the expected error of `X` falls, mean of its position and its rotation:
/// `1/4 ln (tr S_t / tr S_t') + 1/4 ln (tr S_r / tr S_r')`.
///
/// A-optimality (Kiefer, "Optimum experimental designs", 1959) of either part; the product of the two needs no scale
/// that says how many millimetres a degree is worth. Entropy also pays for correlations between position and rotation,
/// and shrinks what is small already as gladly as what is large; the length of an error does not.
#[derive(Clone, Copy, Debug, Default)]
pub struct Accuracy;

struct Prepared<'a>(&'a Belief);

impl Criterion for Accuracy {
    fn name(&self) -> &'static str {
        "accuracy"
    }

    fn prepare<'a>(&'a self, belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error> {
        Ok(Box::new(Prepared(belief)))
    }

    fn quantity(&self) -> Option<Quantity> {
        Some(Quantity::HandEyeCovariance)
    }
}

impl Gain for Prepared<'_> {
    fn gain(&self, factor: &DMatrix<f64>) -> f64 {
        hand_eye_decrease(self.0.covariance(), factor).map_or(f64::NAN, |d| self.gain_of_decrease(&d))
    }

    fn gain_of_decrease(&self, decrease: &Matrix6<f64>) -> f64 {
        let before = self.0.covariance();
        let part = |first: usize| {
            let sum = |of: &dyn Fn(usize) -> f64| (first..first + 3).map(of).sum::<f64>();
            -0.25 * (-sum(&|i| decrease[(i, i)]) / sum(&|i| before[(i, i)])).ln_1p()
        };
        part(0) + part(3)
    }
}
