//! Levenberg-Marquardt.
//!
//! Damping after Nielsen (1999), "Damping Parameter in Marquardt's Method", IMM-REP-1999-05.

use super::batched::{BatchedEngine, Workspace};
use super::engine::{Engine, Proposal};
use super::model::Model;
use super::options::{Options, Start};
use super::problem::{MIN_VIEWS, Problem};
use super::report::{Ending, Solution};
use super::view_by_view::ViewByView;
use crate::error::Error;
use crate::interrupt;
use crate::simd::VectorUnit;

/// First damping, and the smallest factor by which a step that went as predicted lowers it. More damping than needed
/// slows convergence along poorly determined directions.
const FIRST_DAMPING: f64 = 1e-5;
const LARGEST_RELIEF: f64 = 0.01;
/// Damping at which no further try makes sense.
const LARGEST_DAMPING: f64 = 1e16;
/// Squared whitened residual per sample below which a cost is rounding.
const ROUNDING_COST: f64 = 1e-20;

/// Minimises the cost of `model` from `start`.
///
/// # Errors
/// [`Error::InvalidInput`] where the model does not fit the problem, [`Error::TooFewViews`] below [`MIN_VIEWS`],
/// [`Error::Numerical`] where the start puts a target out of the camera's sight.
/// A solve that ran but found no answer is an [`Ending`], not an error.
pub fn solve(problem: &Problem, model: &Model, start: &Start, options: &Options) -> Result<Solution, Error> {
    model.check(problem.view_count())?;
    if problem.view_count() < MIN_VIEWS {
        return Err(Error::TooFewViews { given: problem.view_count(), needed: MIN_VIEWS });
    }
    let samples = problem.pixels().len();
    let hidden = |k| Error::numerical(format!("the start puts points of view {k} out of the camera's sight"));
    if let Some(measurements) = problem.measurements() {
        let mut workspace = Workspace::new(VectorUnit::widest());
        let mut engine = BatchedEngine::new(problem.camera(), model, measurements, start, &mut workspace)
            .map_err(hidden)?;
        return Ok(iterate(&mut engine, options, samples));
    }
    let mut engine = ViewByView::new(problem, model, start).map_err(hidden)?;
    Ok(iterate(&mut engine, options, samples))
}

/// Runs the iteration to its ending.
pub(super) fn iterate(engine: &mut dyn Engine, options: &Options, samples: usize) -> Solution {
    let initial_cost = engine.cost();
    let mut cost = initial_cost;
    let floor = ROUNDING_COST * samples as f64;
    let mut damping = FIRST_DAMPING;
    let mut growth = 2.0;
    let mut iterations = 0;
    let ending = loop {
        if iterations == options.max_iterations {
            break Ending::OutOfIterations;
        }
        interrupt::check();
        iterations += 1;
        let Some(Proposal { predicted, largest }) = engine.propose(damping) else {
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
        let Some(trial) = engine.attempt().filter(|trial| *trial < cost) else {
            // Rounding: the promised decrease is below what the cost can resolve.
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
        let ratio = decrease / predicted;
        damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).max(LARGEST_RELIEF);
        damping = damping.max(1e-15);
        growth = 2.0;
        if decrease <= options.cost_tolerance * previous {
            break Ending::ConvergedCost;
        }
        if small_step {
            break Ending::ConvergedStep;
        }
    };
    engine.report(initial_cost, iterations, ending)
}
