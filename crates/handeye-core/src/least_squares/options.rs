//! Where an iteration starts and when it stops.

use crate::se3::Se3;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Most steps, accepted or not.
    pub max_iterations: usize,
    /// Stop when an accepted step decreases the cost by less than this fraction.
    pub cost_tolerance: f64,
    /// Stop when no parameter moves by more than this (metres, radians).
    pub step_tolerance: f64,
    /// Stop when the predicted decrease is below this fraction of the cost (or of the rounding floor).
    pub gradient_tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_iterations: 100, cost_tolerance: 1e-10, step_tolerance: 1e-13, gradient_tolerance: 1e-12 }
    }
}

/// Where to start.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// `X` of the chain.
    pub x: Se3,
    /// `Y` of the chain.
    pub y: Se3,
}
