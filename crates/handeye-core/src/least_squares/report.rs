//! How a solve ended and what it found.

use nalgebra::{DMatrix, DVector, Vector6};

use crate::camera::Camera;
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

/// One view at the solution.
#[derive(Clone, Debug)]
pub struct ViewReport {
    /// Index of the view in the problem.
    pub view: usize,
    /// Root mean square over its points of the residual's norm, px.
    pub rmse_px: f64,
    /// Sum of its squared whitened residuals (after the loss).
    pub cost: f64,
    /// Estimated robot error as a twist on the model's side (zero without robot noise).
    pub correction: Vector6<f64>,
    /// Sum of squares of the whitened correction.
    pub correction_cost: f64,
    /// `T_camera_target` at the solution.
    pub pose: Se3,
}

/// The answer of a solve; meaningful if `ending.is_converged()`.
#[derive(Clone, Debug)]
pub struct Solution {
    /// `X` of the chain.
    pub x: Se3,
    /// `Y` of the chain.
    pub y: Se3,
    /// The camera with its free parameters updated.
    pub camera: Camera,
    /// Board scale minus one (zero if not free).
    pub board_scale: f64,
    /// Kinematic parameters (empty if none).
    pub kinematic: DVector<f64>,
    /// Information of the global parameters, pose corrections marginalised, priors included.
    pub information: DMatrix<f64>,
    /// Factorisation of `information` where it is positive definite.
    pub(super) factor: Option<Factor>,
    /// The part of `information` that came from priors.
    pub prior_information: DMatrix<f64>,
    /// Minus twice the log posterior up to constants: whitened residuals, corrections and priors.
    pub cost: f64,
    /// Cost at the start.
    pub initial_cost: f64,
    /// Steps taken.
    pub iterations: usize,
    /// Why it stopped.
    pub ending: Ending,
    /// Views used, in the order given.
    pub views: Vec<ViewReport>,
    /// Sum over views of `ln |I + L' M L|`: the determinant that marginal likelihood needs.
    pub correction_log_determinant: f64,
}

impl Solution {
    /// Covariance of the global parameters, the inverse of their information; `None` where that is singular.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let inverse = self.factor.as_ref()?.inverse();
        inverse.as_slice().iter().all(|x| x.is_finite()).then_some(inverse)
    }
}
