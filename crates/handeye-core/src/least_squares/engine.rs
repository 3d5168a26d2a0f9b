//! The interface between the iteration and the two engines that linearise views.

use nalgebra::DMatrix;

use super::report::{Ending, Solution};
use crate::positive::Factor;

/// Smallest pivot of the equilibrated information that counts as determined. A pivot is one minus the squared
/// multiple correlation of a parameter with those before it; rounding alone leaves about 1e-15.
const PIVOT_LIMIT: f64 = 1e-13;

/// The step that solves the normal equations.
pub(super) struct Proposal {
    /// Decrease of the (doubled) quadratic model.
    pub predicted: f64,
    /// Largest move of a parameter.
    pub largest: f64,
}

/// A linearised problem at a state, with another state to try.
pub(super) trait Engine {
    /// Cost at the state.
    fn cost(&self) -> f64;

    /// The step of the normal equations with a damping; None if they are not positive definite.
    fn propose(&mut self, damping: f64) -> Option<Proposal>;

    /// Linearises at the state that the last proposed step leads to; its cost, or None if something is out of sight
    /// there.
    fn attempt(&mut self) -> Option<f64>;

    /// Moves to the attempted state.
    fn accept(&mut self);

    /// The solution at the state.
    fn report(&mut self, initial_cost: f64, iterations: usize, ending: Ending) -> Solution;
}

/// The factorisation of the final information, and the ending: degenerate where a direction is left open.
pub(super) fn judge(information: &DMatrix<f64>, ending: Ending) -> (Option<Factor>, Ending) {
    let finite = information.as_slice().iter().fold(true, |fine, x| fine & x.is_finite());
    let factor = if finite { Factor::new(information) } else { None };
    let open = factor.as_ref().is_none_or(|factor| smallest_pivot(information, factor) < PIVOT_LIMIT);
    (factor, if open { Ending::Degenerate } else { ending })
}

/// Smallest pivot of the factorisation of `h` as a share of its diagonal.
pub(super) fn smallest_pivot(h: &DMatrix<f64>, factor: &Factor) -> f64 {
    let shares = factor.pivots().enumerate().map(|(i, pivot)| pivot / h[(i, i)]);
    shares.fold(f64::INFINITY, f64::min)
}
