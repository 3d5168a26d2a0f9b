//! The engine for corners: views side by side in vector lanes.
//!
//! Nothing is allocated between the first linearisation and the report.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]
#![expect(clippy::needless_range_loop, reason = "indices of matrices: several are read at the same place")]

mod normal;
mod step;
#[cfg(test)]
mod tests;

use nalgebra::Vector6;

use self::normal::Normal;
pub(super) use self::normal::Workspace;
pub(crate) use self::normal::through_chain;
use self::step::{Equations, Step, Vector12};
use super::engine::{Engine, Proposal, judge};
use super::model::Model;
use super::options::Start;
use super::report::{Ending, Solution};
use crate::camera::Camera;
use crate::pose::{LinearisedGroup, Measurements, Row, linearise};
use crate::se3::Se3;
use crate::simd::{MAX_LANES, dispatch};

/// What changes from step to step.
struct State {
    x: Se3,
    y: Se3,
    linearised: Vec<LinearisedGroup>,
    cost: f64,
}

pub(super) struct BatchedEngine<'a> {
    model: &'a Model,
    camera: &'a Camera,
    measurements: &'a Measurements,
    /// `1 / sigma^2` of the pixels of each group.
    information: Vec<Row>,
    current: State,
    trial: State,
    equations: Equations,
    step: Vector12,
    workspace: &'a mut Workspace,
}

impl<'a> BatchedEngine<'a> {
    /// At the start; the index of the first view that cannot be seen from there otherwise.
    pub fn new(
        camera: &'a Camera,
        model: &'a Model,
        measurements: &'a Measurements,
        start: &Start,
        workspace: &'a mut Workspace,
    ) -> Result<Self, usize> {
        const ZERO: Row = [0.0; MAX_LANES];
        let groups = &measurements.groups;
        // Lanes without a view repeat the first of their group, and count for nothing.
        let mut information = vec![ZERO; groups.len()];
        let lanes = information.as_flattened_mut().chunks_mut(measurements.parts);
        for (sigma, lanes) in model.pixel_sigma.iter().zip(lanes) {
            lanes.fill(1.0 / (sigma * sigma));
        }
        let state = || State {
            x: start.x,
            y: start.y,
            linearised: groups.iter().map(|_| LinearisedGroup::new()).collect(),
            cost: 0.0,
        };
        let mut engine = Self {
            model,
            camera,
            measurements,
            information,
            current: state(),
            trial: state(),
            equations: Equations::new(),
            step: Vector12::zeros(),
            workspace,
        };
        engine.linearise()?;
        std::mem::swap(&mut engine.current, &mut engine.trial);
        Ok(engine)
    }

    /// Linearises every view at the trial state; the index of the first that cannot be seen otherwise.
    fn linearise(&mut self) -> Result<(), usize> {
        let trial = &mut self.trial;
        linearise(
            self.workspace.unit,
            self.camera,
            (&trial.x, &trial.y),
            &self.information,
            self.measurements,
            &mut trial.linearised,
        );
        let parts = self.measurements.parts;
        let mut cost = 0.0;
        for lane in 0..self.measurements.views * parts {
            let (seen, at) = (&trial.linearised[lane / MAX_LANES], lane % MAX_LANES);
            if seen.whole[at] == 0.0 || !seen.cost[at].is_finite() {
                return Err(lane / parts);
            }
            cost += seen.cost[at];
        }
        trial.cost = cost + self.model.prior_cost(&trial.x, &trial.y);
        Ok(())
    }

    /// Normal equations at the current state, priors included.
    fn assemble(&mut self) {
        let (unit, workspace, equations) = (self.workspace.unit, &mut *self.workspace, &mut self.equations);
        dispatch(unit, Normal { linearised: &self.current.linearised, workspace, equations });
        for (at, (information, gradient)) in self.model.prior_terms(&self.current.x, &self.current.y) {
            self.equations.add(at, &information, &gradient);
        }
    }
}

impl Engine for BatchedEngine<'_> {
    fn cost(&self) -> f64 {
        self.current.cost
    }

    fn propose(&mut self, damping: f64) -> Option<Proposal> {
        self.assemble();
        let equations = &self.equations;
        let damping = equations.diagonal().map(|entry| damping * entry.max(1e-12));
        self.step = dispatch(self.workspace.unit, Step { equations, damping: &damping })?;
        if !self.step.iter().all(|x| x.is_finite()) {
            return None;
        }
        let penalty = damping.dot(&self.step.component_mul(&self.step));
        Some(Proposal {
            predicted: penalty - equations.gradient().dot(&self.step),
            largest: self.step.amax(),
        })
    }

    fn attempt(&mut self) -> Option<f64> {
        let xi_x: Vector6<f64> = self.step.fixed_rows::<6>(0).into_owned();
        let xi_y: Vector6<f64> = self.step.fixed_rows::<6>(6).into_owned();
        self.trial.x = Se3::exp(&xi_x) * self.current.x;
        self.trial.y = Se3::exp(&xi_y) * self.current.y;
        self.linearise().ok().map(|()| self.trial.cost)
    }

    fn accept(&mut self) {
        std::mem::swap(&mut self.current, &mut self.trial);
    }

    fn report(&mut self, initial_cost: f64, iterations: usize, ending: Ending) -> Solution {
        self.assemble();
        let information = self.equations.information();
        let (factor, ending) = judge(&information, ending);
        let State { x, y, cost, .. } = self.current;
        Solution { x, y, information, factor, cost, initial_cost, iterations, ending }
    }
}
