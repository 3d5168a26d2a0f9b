//! The engine for `X` and `Y` alone, with or without robot noise: views side by side in vector lanes.
//!
//! Nothing is allocated between the first linearisation and the report.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]
#![expect(clippy::needless_range_loop, reason = "indices of matrices: several are read at the same place")]

mod linearise;
mod measurements;
mod normal;
mod step;
#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3, Vector6};

use self::linearise::{Linearise, LinearisedGroup, Optics};
pub(super) use self::measurements::Measurements;
use self::measurements::Row;
pub(super) use self::normal::Workspace;
pub(crate) use self::normal::through_chain;
use self::normal::{Correct, Errors, Noise, Normal, correction, lane, set_lane};
use self::step::{Equations, Step, Vector12};
use super::engine::{Engine, Proposal, judge};
use super::loss::Loss;
use super::model::{Model, Side};
use super::problem::Problem;
use super::report::{Ending, Solution, ViewReport};
use super::solver::{Options, Start};
use crate::batched_algebra::entries;
use crate::camera::Lens;
use crate::se3::Se3;
use crate::simd::{MAX_LANES, dispatch};

/// What changes from step to step.
struct State {
    x: Se3,
    y: Se3,
    /// Motions of each group with the robot's errors, and these; none for an exact robot.
    motions: Vec<[Row; 12]>,
    errors: Vec<Errors>,
    linearised: Vec<LinearisedGroup>,
    cost: f64,
}

pub(super) struct BatchedEngine<'a> {
    problem: &'a Problem,
    model: &'a Model,
    loss: Loss,
    views: &'a [usize],
    measurements: &'a Measurements,
    optics: Optics,
    /// `1 / sigma^2` of the pixels of each group.
    information: Vec<Row>,
    current: State,
    trial: State,
    equations: Equations,
    step: Vector12,
    workspace: &'a mut Workspace,
}

/// Whether the engine can do it: corners, a lens of the kind that lanes know, and nothing free but `X` and `Y`.
pub(super) fn fits(problem: &Problem, model: &Model) -> bool {
    problem.camera().lens != Lens::KannalaBrandt && model.parameter_count() == 12
}

impl<'a> BatchedEngine<'a> {
    /// At the start; the index of the first view that cannot be seen from there otherwise.
    pub fn new(
        problem: &'a Problem,
        model: &'a Model,
        options: &Options,
        views: &'a [usize],
        measurements: &'a Measurements,
        start: &Start,
        workspace: &'a mut Workspace,
    ) -> Result<Self, usize> {
        const ZERO: Row = [0.0; MAX_LANES];
        let groups = &measurements.groups;
        // Lanes without a view repeat the first of their group, and count for nothing.
        let mut information = vec![ZERO; groups.len()];
        for (k, lanes) in views.iter().zip(information.as_flattened_mut().chunks_mut(measurements.parts)) {
            lanes.fill(1.0 / (model.pixel_sigma[*k] * model.pixel_sigma[*k]));
        }
        let noisy = if model.robot.is_some() { &groups[..] } else { &[] };
        let state = || State {
            x: start.x,
            y: start.y,
            motions: noisy.iter().map(|group| group.motions).collect(),
            errors: noisy.iter().map(|_| Errors::new()).collect(),
            linearised: groups.iter().map(|_| LinearisedGroup::new()).collect(),
            cost: 0.0,
        };
        let camera = problem.camera();
        let mut engine = Self {
            problem,
            model,
            loss: options.loss,
            views,
            measurements,
            optics: Optics { parameters: camera.parameters, max_squared_radius: camera.max_squared_radius() },
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
        self.apply_robot_errors();
        let trial = &mut self.trial;
        let (x, y) = (entries(&trial.x), entries(&trial.y));
        let alike = self.loss == Loss::Squared && self.problem.whitening(0).is_none();
        macro_rules! linearise {
            ($($flag:literal),*) => {
                dispatch(self.workspace.unit, Linearise::<$($flag),*> {
                    x: &x,
                    y: &y,
                    motions: &trial.motions,
                    information: &self.information,
                    optics: &self.optics,
                    loss: self.loss,
                    measurements: self.measurements,
                    out: &mut trial.linearised,
                })
            };
        }
        match (self.problem.camera().lens, alike) {
            (Lens::Pinhole | Lens::KannalaBrandt, true) => linearise!(false, false, true),
            (Lens::Pinhole | Lens::KannalaBrandt, false) => linearise!(false, false, false),
            (Lens::BrownConrady4 | Lens::BrownConrady5, true) => linearise!(true, false, true),
            (Lens::BrownConrady4 | Lens::BrownConrady5, false) => linearise!(true, false, false),
            (Lens::BrownConrady8 | Lens::BrownConrady12, true) => linearise!(true, true, true),
            (Lens::BrownConrady8 | Lens::BrownConrady12, false) => linearise!(true, true, false),
        }
        let parts = self.measurements.parts;
        let mut cost = 0.0;
        for (group, (seen, views)) in
            trial.linearised.iter().zip(self.views.chunks(MAX_LANES / parts)).enumerate()
        {
            for at in 0..views.len() * parts {
                if seen.whole[at] == 0.0 || !seen.cost[at].is_finite() {
                    return Err(views[at / parts]);
                }
                cost += seen.cost[at];
                if let Some(errors) = trial.errors.get(group) {
                    cost += correction(errors, at).norm_squared();
                }
            }
        }
        trial.cost = cost + self.model.chain_prior.as_ref().map_or(0.0, |p| p.cost(&trial.x, &trial.y));
        Ok(())
    }

    /// Puts the robot's errors into the motions of the trial state.
    fn apply_robot_errors(&mut self) {
        let Some(robot) = &self.model.robot else { return };
        let groups = self.trial.motions.iter_mut().zip(&mut self.trial.errors);
        for (group, (motions, errors)) in groups.enumerate() {
            for (at, k) in self.views.iter().skip(group * MAX_LANES).take(MAX_LANES).enumerate() {
                let root = robot.square_root(*k);
                let twist = root * correction(errors, at);
                let motion = self.problem.motion(*k);
                let error = Se3::exp(&twist);
                let moved = match robot.side {
                    Side::Left => error * *motion,
                    Side::Right => *motion * error,
                };
                set_lane(motions, at, &entries(&moved));
                let moved_root: Matrix6<f64> = Se3::left_jacobian(&twist) * root;
                let mut rows = [0.0; 36];
                rows.copy_from_slice(moved_root.transpose().as_slice());
                set_lane(&mut errors.root, at, &rows);
            }
        }
    }

    /// Normal equations at the current state, priors included.
    fn assemble(&mut self, damping: f64) {
        let x = entries(&self.current.x);
        let noise = self.model.robot.as_ref().map(|robot| Noise {
            side: robot.side,
            x: &x,
            groups: &self.measurements.groups,
            errors: &mut self.current.errors,
            damping,
        });
        let (unit, workspace, equations) = (self.workspace.unit, &mut *self.workspace, &mut self.equations);
        dispatch(unit, Normal { linearised: &self.current.linearised, noise, workspace, equations });
        if let Some(prior) = &self.model.chain_prior {
            let (x, y) = (&self.current.x, &self.current.y);
            for (at, (information, gradient)) in [(0, prior.normal(true, x)), (6, prior.normal(false, y))] {
                self.equations.add(at, &information, &gradient);
            }
        }
    }
}

impl Engine for BatchedEngine<'_> {
    fn cost(&self) -> f64 {
        self.current.cost
    }

    fn propose(&mut self, damping: f64) -> Option<Proposal> {
        self.assemble(damping);
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
        if self.model.robot.is_some() {
            dispatch(
                self.workspace.unit,
                Correct {
                    step: &self.step,
                    linearised: &self.current.linearised,
                    errors: &self.current.errors,
                    out: &mut self.trial.errors,
                },
            );
        }
        self.linearise().ok().map(|()| self.trial.cost)
    }

    fn accept(&mut self) {
        std::mem::swap(&mut self.current, &mut self.trial);
    }

    fn report(&mut self, initial_cost: f64, iterations: usize, ending: Ending) -> Solution {
        self.assemble(0.0);
        let mut prior_information = DMatrix::zeros(12, 12);
        if let Some(prior) = &self.model.chain_prior {
            prior_information.view_mut((0, 0), (6, 6)).copy_from(&prior.normal(true, &self.current.x).0);
            prior_information.view_mut((6, 6), (6, 6)).copy_from(&prior.normal(false, &self.current.y).0);
        }
        let information = self.equations.information();
        let (factor, ending) = judge(&information, ending);
        let mut correction_log_determinant = 0.0;
        let parts = self.measurements.parts;
        let views = self.views.iter().enumerate().map(|(i, k)| {
            let (group, at) = (i * parts / MAX_LANES, i * parts % MAX_LANES);
            let sum = |row: fn(&LinearisedGroup) -> &Row| -> f64 {
                (i * parts..(i + 1) * parts)
                    .map(|lane| row(&self.current.linearised[lane / MAX_LANES])[lane % MAX_LANES])
                    .sum()
            };
            let seen = &self.current.linearised[group];
            let pose = lane(&seen.pose, at);
            let (mut twist, mut correction_cost) = (Vector6::zeros(), 0.0);
            if let Some(robot) = &self.model.robot {
                let errors = &self.current.errors[group];
                let w = correction(errors, at);
                twist = robot.square_root(*k) * w;
                correction_cost = w.norm_squared();
                correction_log_determinant += errors.log_determinant[at];
            }
            ViewReport {
                view: *k,
                rmse_px: (sum(|seen| &seen.squared_px) / self.problem.point_count(*k) as f64).sqrt(),
                cost: sum(|seen| &seen.cost),
                correction: twist,
                correction_cost,
                pose: Se3::new(Matrix3::from_row_slice(&pose[..9]), Vector3::from_column_slice(&pose[9..])),
            }
        });
        let views = views.collect();
        Solution {
            x: self.current.x,
            y: self.current.y,
            camera: *self.problem.camera(),
            board_scale: 0.0,
            kinematic: DVector::zeros(0),
            ending,
            information,
            factor,
            prior_information,
            cost: self.current.cost,
            initial_cost,
            iterations,
            views,
            correction_log_determinant,
        }
    }
}
