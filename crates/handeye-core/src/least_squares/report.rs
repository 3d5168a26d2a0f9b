//! How a solve ended and what it found.

use nalgebra::DMatrix;

use crate::positive::Factor;
use crate::se3::Se3;

/// Why the iteration stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The relative decrease of the cost fell below its tolerance.
    ConvergedCost,
    /// The scaled step fell below its tolerance.
    ConvergedStep,
    /// The predicted decrease of the cost fell below its tolerance.
    ConvergedGradient,
    /// The normal equations are singular to working precision: some direction is not determined.
    Degenerate,
    /// No step decreased the cost, far from a stationary point.
    Diverged,
    /// The iteration limit came first.
    OutOfIterations,
}

impl Ending {
    /// Whether the answer is a minimum.
    pub fn is_converged(self) -> bool {
        matches!(self, Self::ConvergedCost | Self::ConvergedStep | Self::ConvergedGradient)
    }

    /// Stable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::ConvergedCost => "converged_cost",
            Self::ConvergedStep => "converged_step",
            Self::ConvergedGradient => "converged_gradient",
            Self::Degenerate => "degenerate",
            Self::Diverged => "diverged",
            Self::OutOfIterations => "out_of_iterations",
        }
    }
}

/// The answer of a solve; meaningful if `ending.is_converged()`.
#[derive(Clone, Debug)]
pub struct Solution {
    /// `X` of the chain.
    pub x: Se3,
    /// `Y` of the chain.
    pub y: Se3,
    /// Information of `[xi_x; xi_y]`, the prior included.
    pub information: DMatrix<f64>,
    /// Factorisation of `information` where it is positive definite.
    pub(super) factor: Option<Factor>,
    /// Minus twice the log posterior up to constants: whitened residuals and prior.
    pub cost: f64,
    /// Cost at the start.
    pub initial_cost: f64,
    /// Steps taken.
    pub iterations: usize,
    /// Why it stopped.
    pub ending: Ending,
}

impl Solution {
    /// Covariance of `[xi_x; xi_y]`, the inverse of their information; `None` where that is singular.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let inverse = self.factor.as_ref()?.inverse();
        inverse.as_slice().iter().all(|x| x.is_finite()).then_some(inverse)
    }
}
