//! Levenberg-Marquardt and Gauss-Newton with the per-view pose corrections eliminated (Schur complement).
//!
//! Damping after Nielsen (1999), "Damping Parameter in Marquardt's Method", IMM-REP-1999-05.

use super::batched::{BatchedEngine, Measurements, Workspace, fits};
use super::engine::{Engine, Proposal};
use super::general::General;
use super::loss::Loss;
use super::model::Model;
use super::problem::{MIN_VIEWS, Problem};
use super::report::{Ending, Solution};
use crate::error::Error;
use crate::se3::Se3;
use crate::simd::VectorUnit;

/// Which iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Damped; each accepted step decreases the cost.
    LevenbergMarquardt,
    /// Undamped full steps.
    GaussNewton,
}

/// How to iterate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Which iteration.
    pub method: Method,
    /// Most steps, accepted or not.
    pub max_iterations: usize,
    /// Stop when an accepted step decreases the cost by less than this fraction.
    pub cost_tolerance: f64,
    /// Stop when no parameter moves by more than this (metres, radians).
    pub step_tolerance: f64,
    /// Stop when the predicted decrease is below this fraction of the cost (or of the rounding floor).
    pub gradient_tolerance: f64,
    /// Robust loss on points.
    pub loss: Loss,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::LevenbergMarquardt,
            max_iterations: 100,
            cost_tolerance: 1e-10,
            step_tolerance: 1e-13,
            gradient_tolerance: 1e-12,
            loss: Loss::Squared,
        }
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

/// Damping to begin with, and by how much a step that the model foresaw lowers it at most: what is damped beyond need
/// keeps poorly determined directions from converging as fast as Newton's method would.
const FIRST_DAMPING: f64 = 1e-5;
const LARGEST_RELIEF: f64 = 0.01;
/// Damping at which no further try makes sense.
const LARGEST_DAMPING: f64 = 1e16;
/// Squared whitened residual per sample below which a cost is rounding.
const ROUNDING_COST: f64 = 1e-20;

/// Minimises the cost of `model` over the given views from `start`.
///
/// # Errors
/// [`Error::InvalidInput`] where model or views do not fit the problem, [`Error::TooFewViews`] below
/// [`MIN_VIEWS`], [`Error::Numerical`] where the start puts a target out of the camera's sight.
/// A solve that ran but found no answer is an [`Ending`], not an error.
pub fn solve(
    problem: &Problem,
    model: &Model,
    start: &Start,
    views: &[usize],
    options: &Options,
) -> Result<Solution, Error> {
    model.check(problem.view_count(), problem.camera())?;
    if let Some(k) = views.iter().find(|k| **k >= problem.view_count()) {
        return Err(Error::invalid(format!("view {k} of {}", problem.view_count())));
    }
    if views.len() < MIN_VIEWS {
        return Err(Error::TooFewViews { given: views.len(), needed: MIN_VIEWS });
    }
    let samples: usize = views.iter().map(|k| problem.point_count(*k)).sum();
    let hidden = |k| Error::numerical(format!("the start puts points of view {k} out of the camera's sight"));
    let in_order = views.iter().copied().eq(0..problem.view_count());
    // An error of the robot is that of a whole view.
    let whole = model.robot.is_some();
    let ready = problem.measurements().filter(|m| in_order && (!whole || m.parts == 1));
    let packed;
    let measurements = if !fits(problem, model) {
        None
    } else if ready.is_some() {
        ready
    } else {
        packed = Measurements::new(problem, views, whole);
        packed.as_ref()
    };
    if let Some(measurements) = measurements {
        let mut workspace = Workspace::new(VectorUnit::widest());
        let mut engine =
            BatchedEngine::new(problem, model, options, views, measurements, start, &mut workspace)
                .map_err(hidden)?;
        return Ok(iterate(&mut engine, options, samples));
    }
    let mut engine = General::new(problem, model, options.loss, views, start).map_err(hidden)?;
    Ok(iterate(&mut engine, options, samples))
}

/// Runs the iteration to its ending.
pub(super) fn iterate(engine: &mut dyn Engine, options: &Options, samples: usize) -> Solution {
    let initial_cost = engine.cost();
    let mut cost = initial_cost;
    let floor = ROUNDING_COST * samples as f64;
    let damped = options.method == Method::LevenbergMarquardt;
    let mut damping = if damped { FIRST_DAMPING } else { 0.0 };
    let mut growth = 2.0;
    let mut rises = 0;
    let mut iterations = 0;
    let ending = loop {
        if iterations == options.max_iterations {
            break Ending::OutOfIterations;
        }
        iterations += 1;
        let Some(Proposal { predicted, largest }) = engine.propose(damping) else {
            if !damped {
                break Ending::Degenerate;
            }
            damping = (damping * growth).max(1e-12);
            growth *= 2.0;
            if damping > LARGEST_DAMPING {
                break Ending::Degenerate;
            }
            continue;
        };
        if predicted <= options.gradient_tolerance * cost.max(floor) {
            break Ending::ConvergedGradient;
        }
        let small_step = largest < options.step_tolerance;
        // Linearising costs little more than the cost alone, and most trials are accepted.
        let Some(trial) = engine.attempt().filter(|trial| !damped || *trial < cost) else {
            if !damped {
                break Ending::Diverged;
            }
            // Rounding: nothing left to gain although the model promises a trace.
            if small_step || predicted <= 1e-9 * cost.max(floor) {
                break Ending::ConvergedStep;
            }
            damping *= growth;
            growth *= 2.0;
            if damping > LARGEST_DAMPING {
                break Ending::Diverged;
            }
            continue;
        };
        let decrease = cost - trial;
        let previous = cost;
        engine.accept();
        cost = trial;
        if damped {
            let ratio = decrease / predicted;
            damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).max(LARGEST_RELIEF);
            damping = damping.max(1e-15);
            growth = 2.0;
        } else if decrease < 0.0 {
            rises += 1;
            if rises == 5 {
                break Ending::Diverged;
            }
        }
        if decrease.abs() <= options.cost_tolerance * previous {
            break Ending::ConvergedCost;
        }
        if small_step {
            break Ending::ConvergedStep;
        }
    };
    engine.report(initial_cost, iterations, ending)
}
