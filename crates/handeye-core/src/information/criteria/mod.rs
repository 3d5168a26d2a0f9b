//! What a view is worth: one file per criterion over one small base.

mod eigenvalue_sum;
mod entropy;
mod entropy_hand_eye;
mod min_eigenvalue;
mod task;
mod tool_point;
mod trace;

use nalgebra::{DMatrix, Matrix6};

pub use eigenvalue_sum::EigenvalueSum;
pub use entropy::Entropy;
pub use entropy_hand_eye::EntropyHandEye;
pub use min_eigenvalue::MinEigenvalue;
pub use task::Task;
pub use tool_point::{Over, ToolPoint};
pub use trace::Trace;

use super::belief::{Belief, CHAIN};
use crate::error::Error;

/// A criterion: prepared once per belief, then asked for the gain of each candidate.
pub trait Criterion: Sync {
    /// Stable name.
    fn name(&self) -> &'static str;

    /// # Errors
    /// [`Error::Degenerate`] where the belief has no value under this criterion.
    fn prepare<'a>(&'a self, belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error>;

    /// What of a candidate it looks at, where that is one of a few quantities that many candidates are asked for at
    /// once.
    fn quantity(&self) -> Option<Quantity> {
        None
    }
}

/// What of a candidate a criterion may look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// The gain is a decrease of entropy.
    Entropy(EntropyOf),
    /// The gain is the decrease of the trace of the covariance of `X` and `Y`, each row and column times its weight.
    CovarianceTrace([f64; CHAIN]),
    /// The gain is the trace of the candidate's information on `X` and `Y`, each row and column times its weight.
    InformationTrace([f64; CHAIN]),
    /// The gain is [`Gain::gain_of_decrease`] of the decrease of the covariance of `X`.
    HandEyeCovariance,
}

/// Whose entropy a criterion lowers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntropyOf {
    /// All parameters.
    Everything,
    /// `X` alone, everything else marginalised.
    HandEye,
}

/// The gain of candidates over one belief; larger is better, zero is nothing.
pub trait Gain: Sync {
    /// Gain of a candidate with information `factor * factor'`.
    fn gain(&self, factor: &DMatrix<f64>) -> f64;

    /// Gain of a candidate that takes `decrease` off the covariance of `X`; only of criteria that look at nothing else.
    fn gain_of_decrease(&self, _decrease: &Matrix6<f64>) -> f64 {
        f64::NAN
    }
}

/// Length and angle that count as equal, for criteria that depend on units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Metres.
    pub length_m: f64,
    /// Radians.
    pub angle_rad: f64,
}

impl Default for Scales {
    /// A millimetre and a milliradian: equal at a metre's distance.
    fn default() -> Self {
        Self { length_m: 1e-3, angle_rad: 1e-3 }
    }
}

impl Scales {
    /// Scale of parameter `i` of the chain.
    fn of(&self, i: usize) -> f64 {
        if i % 6 < 3 { self.length_m } else { self.angle_rad }
    }

    /// Scales of the chain.
    fn all(&self) -> [f64; CHAIN] {
        std::array::from_fn(|i| self.of(i))
    }
}

/// `ln |I + F' S F|`; NaN if it does not exist.
fn log_det_update(covariance: &DMatrix<f64>, factor: &DMatrix<f64>) -> f64 {
    update_factor(covariance, factor)
        .map_or(f64::NAN, |c| 2.0 * (0..factor.ncols()).map(|i| c.l_dirty()[(i, i)].ln()).sum::<f64>())
}

/// Cholesky of `I + F' S F`.
fn update_factor(
    covariance: &DMatrix<f64>,
    factor: &DMatrix<f64>,
) -> Option<nalgebra::Cholesky<f64, nalgebra::Dyn>> {
    let mut inner = factor.tr_mul(&(covariance * factor));
    for i in 0..factor.ncols() {
        inner[(i, i)] += 1.0;
    }
    inner.cholesky()
}

/// By how much a candidate lowers the covariance of the first `rows` parameters.
fn covariance_decrease(
    covariance: &DMatrix<f64>,
    factor: &DMatrix<f64>,
    rows: usize,
) -> Option<DMatrix<f64>> {
    let update = update_factor(covariance, factor)?;
    let spread = covariance.rows(0, rows) * factor;
    let solved = update.solve(&spread.transpose());
    Some(spread * solved)
}

fn hand_eye_decrease(covariance: &DMatrix<f64>, factor: &DMatrix<f64>) -> Option<Matrix6<f64>> {
    covariance_decrease(covariance, factor, 6).map(|d| Matrix6::from_column_slice(d.as_slice()))
}
