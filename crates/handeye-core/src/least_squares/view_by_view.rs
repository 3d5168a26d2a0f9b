//! The engine for circles and fisheyes, which have no batched one: view by view.

use nalgebra::{DMatrix, Matrix6, SMatrix, SVector, Vector6};

use super::accumulate::{ViewBlock, view_block};
use super::engine::{Engine, Proposal, judge};
use super::model::Model;
use super::options::Start;
use super::problem::Problem;
use super::report::{Ending, Solution};
use crate::se3::Se3;

type Matrix12 = SMatrix<f64, 12, 12>;
type Vector12 = SVector<f64, 12>;

/// `X` and `Y`, and the views linearised there.
struct State {
    x: Se3,
    y: Se3,
    /// The quadratic of each view in its twist, and `d eta / d xi_y`.
    views: Vec<(ViewBlock, Matrix6<f64>)>,
    cost: f64,
}

pub(super) struct ViewByView<'a> {
    problem: &'a Problem,
    model: &'a Model,
    current: State,
    step: Vector12,
    trial: Option<State>,
}

impl<'a> ViewByView<'a> {
    /// At the start; the index of the first view that cannot be seen from there otherwise.
    pub fn new(problem: &'a Problem, model: &'a Model, start: &Start) -> Result<Self, usize> {
        let current = linearise(problem, model, start.x, start.y)?;
        Ok(Self { problem, model, current, step: Vector12::zeros(), trial: None })
    }

    /// Normal equations at the current state, priors included.
    fn assemble(&self) -> (Matrix12, Vector12) {
        let (mut h, mut g) = (Matrix12::zeros(), Vector12::zeros());
        for (block, to_y) in &self.current.views {
            let cross = block.m * to_y;
            for (at, part) in [
                ((0, 0), block.m),
                ((0, 6), cross),
                ((6, 0), cross.transpose()),
                ((6, 6), to_y.transpose() * cross),
            ] {
                let mut sum = h.fixed_view_mut::<6, 6>(at.0, at.1);
                sum += part;
            }
            for (at, part) in [(0, block.g), (6, to_y.transpose() * block.g)] {
                let mut sum = g.fixed_rows_mut::<6>(at);
                sum += part;
            }
        }
        for (at, (information, gradient)) in self.model.prior_terms(&self.current.x, &self.current.y) {
            let mut sum = h.fixed_view_mut::<6, 6>(at, at);
            sum += information;
            let mut sum = g.fixed_rows_mut::<6>(at);
            sum += gradient;
        }
        (h, g)
    }
}

/// Linearises every view; the index of the first view that cannot be seen otherwise.
fn linearise(problem: &Problem, model: &Model, x: Se3, y: Se3) -> Result<State, usize> {
    let mut cost = model.prior_cost(&x, &y);
    let mut views = Vec::with_capacity(problem.view_count());
    for (k, sigma) in model.pixel_sigma.iter().enumerate() {
        let before_y = x * *problem.motion(k);
        let block = view_block(problem, k, problem.camera(), &(before_y * y), *sigma).ok_or(k)?;
        cost += block.squared_px / (sigma * sigma);
        views.push((block, before_y.adjoint()));
    }
    Ok(State { x, y, views, cost })
}

impl Engine for ViewByView<'_> {
    fn cost(&self) -> f64 {
        self.current.cost
    }

    fn propose(&mut self, damping: f64) -> Option<Proposal> {
        let (mut h, g) = self.assemble();
        let damping = h.diagonal().map(|entry| damping * entry.max(1e-12));
        h += Matrix12::from_diagonal(&damping);
        self.step = h.cholesky()?.solve(&-g);
        if !self.step.iter().all(|x| x.is_finite()) {
            return None;
        }
        let penalty = damping.dot(&self.step.component_mul(&self.step));
        Some(Proposal { predicted: penalty - g.dot(&self.step), largest: self.step.amax() })
    }

    fn attempt(&mut self) -> Option<f64> {
        let xi_x: Vector6<f64> = self.step.fixed_rows::<6>(0).into_owned();
        let xi_y: Vector6<f64> = self.step.fixed_rows::<6>(6).into_owned();
        let (x, y) = (Se3::exp(&xi_x) * self.current.x, Se3::exp(&xi_y) * self.current.y);
        self.trial = linearise(self.problem, self.model, x, y).ok();
        self.trial.as_ref().map(|trial| trial.cost)
    }

    fn accept(&mut self) {
        if let Some(trial) = self.trial.take() {
            self.current = trial;
        }
    }

    fn report(&mut self, initial_cost: f64, iterations: usize, ending: Ending) -> Solution {
        let (h, _) = self.assemble();
        let information = DMatrix::from_column_slice(12, 12, h.as_slice());
        let (factor, ending) = judge(&information, ending);
        let State { x, y, cost, .. } = self.current;
        Solution { x, y, information, factor, cost, initial_cost, iterations, ending }
    }
}
