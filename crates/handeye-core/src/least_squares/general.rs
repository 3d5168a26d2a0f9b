//! The engine for whatever is free: camera, board scale, kinematics, circles and fisheyes; view by view.

use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, SMatrix, Vector6};

use super::accumulate::{ViewBlock, view_block};
use super::engine::{Engine, Proposal, judge};
use super::loss::Loss;
use super::marginal::{Eliminated, eliminate};
use super::model::{Model, Side};
use super::problem::Problem;
use super::report::{Ending, Solution, ViewReport};
use super::solver::Start;
use crate::camera::Camera;
use crate::se3::Se3;

#[derive(Clone)]
struct State {
    x: Se3,
    y: Se3,
    camera: Camera,
    board_scale: f64,
    kinematic: DVector<f64>,
    /// Whitened pose corrections, one per used view; empty without robot noise.
    corrections: Vec<Vector6<f64>>,
}

/// A view's linearisation: its pose, its quadratic, and how parameters move its twist.
struct Linearised {
    pose: Se3,
    block: ViewBlock,
    /// `d eta / d xi_y`.
    to_y: Matrix6<f64>,
    /// `d eta / d q`.
    to_kinematic: Option<Matrix6xX<f64>>,
    /// `d eta / d w`.
    to_correction: Option<Matrix6<f64>>,
}

struct Evaluation {
    views: Vec<Linearised>,
    /// Residuals, corrections and priors.
    cost: f64,
}

struct System {
    h: DMatrix<f64>,
    g: DVector<f64>,
    eliminated: Vec<Eliminated>,
    log_determinant: f64,
}

struct Parts<'a> {
    problem: &'a Problem,
    model: &'a Model,
    loss: Loss,
    views: &'a [usize],
}

pub(super) struct General<'a> {
    parts: Parts<'a>,
    state: State,
    current: Evaluation,
    system: Option<System>,
    step: DVector<f64>,
    trial: Option<(State, Evaluation)>,
}

impl<'a> General<'a> {
    /// At the start; the index of the first view that cannot be seen from there otherwise.
    pub fn new(
        problem: &'a Problem,
        model: &'a Model,
        loss: Loss,
        views: &'a [usize],
        start: &Start,
    ) -> Result<Self, usize> {
        let parts = Parts { problem, model, loss, views };
        let corrections = if model.robot.is_some() { views.len() } else { 0 };
        let state = State {
            x: start.x,
            y: start.y,
            camera: *problem.camera(),
            board_scale: 0.0,
            kinematic: DVector::zeros(model.kinematic_count()),
            corrections: vec![Vector6::zeros(); corrections],
        };
        let current = parts.evaluate(&state)?;
        Ok(Self { parts, state, current, system: None, step: DVector::zeros(0), trial: None })
    }
}

impl Engine for General<'_> {
    fn cost(&self) -> f64 {
        self.current.cost
    }

    fn propose(&mut self, damping: f64) -> Option<Proposal> {
        let system = self.system.insert(self.parts.assemble(&self.state, &self.current, damping));
        self.step = solve_damped(system, damping)?;
        let predicted = predicted_decrease(system, &self.step, damping);
        Some(Proposal { predicted, largest: self.step.amax() })
    }

    fn attempt(&mut self) -> Option<f64> {
        self.trial = None;
        let state = self.parts.step(&self.state, &self.current, self.system.as_ref()?, &self.step)?;
        let evaluation = self.parts.evaluate(&state).ok()?;
        let cost = evaluation.cost;
        self.trial = Some((state, evaluation));
        Some(cost)
    }

    fn accept(&mut self) {
        if let Some((state, evaluation)) = self.trial.take() {
            (self.state, self.current) = (state, evaluation);
        }
    }

    fn report(&mut self, initial_cost: f64, iterations: usize, ending: Ending) -> Solution {
        self.parts.report(&self.state, &self.current, initial_cost, iterations, ending)
    }
}

impl Parts<'_> {
    /// Motion `exp(D q) A`, and the correction `exp(L w)`.
    fn pose(&self, state: &State, i: usize) -> (Se3, Se3, Se3) {
        let k = self.views[i];
        let mut motion = *self.problem.motion(k);
        if let Some(kinematic) = &self.model.kinematic {
            let twist: DVector<f64> = &kinematic.jacobians[k] * &state.kinematic;
            motion = Se3::exp(&Vector6::from_column_slice(twist.as_slice())) * motion;
        }
        match &self.model.robot {
            None => (state.x * motion * state.y, motion, Se3::identity()),
            Some(robot) => {
                let error = Se3::exp(&(robot.square_root(k) * state.corrections[i]));
                let pose = match robot.side {
                    Side::Left => state.x * error * motion * state.y,
                    Side::Right => state.x * motion * error * state.y,
                };
                (pose, motion, error)
            }
        }
    }

    fn prior_cost(&self, state: &State) -> f64 {
        let mut cost: f64 = state.corrections.iter().map(Vector6::norm_squared).sum();
        if let Some(prior) = &self.model.chain_prior {
            cost += prior.cost(&state.x, &state.y);
        }
        if let Some(pixel) = &self.model.pixel_parameters {
            let d = self.pixel_deviation(state);
            cost += d.dot(&(&pixel.prior_information * &d));
        }
        if let Some(kinematic) = &self.model.kinematic {
            cost += state.kinematic.dot(&(&kinematic.prior_information * &state.kinematic));
        }
        cost
    }

    /// Pixel parameters relative to their prior mean.
    fn pixel_deviation(&self, state: &State) -> DVector<f64> {
        let Some(pixel) = &self.model.pixel_parameters else { return DVector::zeros(0) };
        let before = self.problem.camera();
        let mut values: Vec<f64> =
            pixel.camera.iter().map(|i| state.camera.parameters[*i] - before.parameters[*i]).collect();
        if pixel.board_scale {
            values.push(state.board_scale);
        }
        DVector::from_vec(values)
    }

    /// Linearises every view; the index of the first view that cannot be seen otherwise.
    fn evaluate(&self, state: &State) -> Result<Evaluation, usize> {
        let mut cost = self.prior_cost(state);
        let mut views = Vec::with_capacity(self.views.len());
        for (i, k) in self.views.iter().enumerate() {
            let (pose, motion, error) = self.pose(state, i);
            let block = view_block(
                self.problem,
                *k,
                &state.camera,
                state.board_scale,
                &pose,
                self.model.pixel_sigma[*k],
                self.model.pixel_parameters.as_ref(),
                self.loss,
            )
            .ok_or(*k)?;
            cost += block.cost;
            let before_y = pose * state.y.inverse();
            let before_motion = match self.model.robot.as_ref().map(|r| r.side) {
                Some(Side::Left) => state.x * error,
                _ => state.x,
            };
            let to_kinematic = self.model.kinematic.as_ref().map(|kinematic| {
                let d = &kinematic.jacobians[*k];
                let twist: DVector<f64> = d * &state.kinematic;
                let left = Se3::left_jacobian(&Vector6::from_column_slice(twist.as_slice()));
                (before_motion.adjoint() * left) * d
            });
            let to_correction = self.model.robot.as_ref().map(|robot| {
                let root = robot.square_root(*k);
                let left = Se3::left_jacobian(&(root * state.corrections[i]));
                let before = match robot.side {
                    Side::Left => state.x,
                    Side::Right => state.x * motion,
                };
                before.adjoint() * left * root
            });
            views.push(Linearised { pose, block, to_y: before_y.adjoint(), to_kinematic, to_correction });
        }
        Ok(Evaluation { views, cost })
    }

    /// Normal equations in the global parameters, corrections eliminated with their own damping.
    fn assemble(&self, state: &State, evaluation: &Evaluation, damping: f64) -> System {
        let n = self.model.parameter_count();
        let extra = self.model.pixel_parameter_count();
        let mut h = SMatrix::<f64, 12, 12>::zeros();
        let mut g = SMatrix::<f64, 12, 1>::zeros();
        let mut full = (n > 12).then(|| (DMatrix::zeros(n, n), DVector::zeros(n)));
        let mut eliminated = Vec::with_capacity(state.corrections.len());
        let mut log_determinant = 0.0;
        for (i, view) in evaluation.views.iter().enumerate() {
            let reduced;
            let block = match &view.to_correction {
                None => &view.block,
                Some(to_correction) => {
                    let w = &state.corrections[i];
                    let (block, rule, determinant) = eliminate(&view.block, to_correction, w, damping);
                    log_determinant += determinant;
                    eliminated.push(rule);
                    reduced = block;
                    &reduced
                }
            };
            match &mut full {
                None => add_chain(&mut h, &mut g, block, &view.to_y),
                Some((h, g)) => add_general(h, g, block, view, extra),
            }
        }
        let (mut h, mut g) = full.unwrap_or_else(|| {
            (DMatrix::from_column_slice(12, 12, h.as_slice()), DVector::from_column_slice(g.as_slice()))
        });
        self.add_priors(state, &mut h, &mut g);
        System { h, g, eliminated, log_determinant }
    }

    fn add_priors(&self, state: &State, h: &mut DMatrix<f64>, g: &mut DVector<f64>) {
        let extra = self.model.pixel_parameter_count();
        if let Some(prior) = &self.model.chain_prior {
            for (of_x, value, at) in [(true, &state.x, 0), (false, &state.y, 6)] {
                let (information, gradient) = prior.normal(of_x, value);
                let mut block = h.view_mut((at, at), (6, 6));
                block += information;
                let mut rows = g.rows_mut(at, 6);
                rows += gradient;
            }
        }
        if let Some(pixel) = &self.model.pixel_parameters {
            let mut block = h.view_mut((12, 12), (extra, extra));
            block += &pixel.prior_information;
            let mut rows = g.rows_mut(12, extra);
            rows += &pixel.prior_information * self.pixel_deviation(state);
        }
        if let Some(kinematic) = &self.model.kinematic {
            let (at, q) = (12 + extra, kinematic.count());
            let mut block = h.view_mut((at, at), (q, q));
            block += &kinematic.prior_information;
            let mut rows = g.rows_mut(at, q);
            rows += &kinematic.prior_information * &state.kinematic;
        }
    }

    /// The state after a step; `None` if the camera's parameters would leave their range.
    fn step(&self, state: &State, at: &Evaluation, system: &System, step: &DVector<f64>) -> Option<State> {
        let extra = self.model.pixel_parameter_count();
        let xi_x = Vector6::from_column_slice(&step.as_slice()[0..6]);
        let xi_y = Vector6::from_column_slice(&step.as_slice()[6..12]);
        let mut next = State { x: Se3::exp(&xi_x) * state.x, y: Se3::exp(&xi_y) * state.y, ..state.clone() };
        if let Some(pixel) = &self.model.pixel_parameters {
            let mut parameters = state.camera.parameters;
            for (column, i) in pixel.camera.iter().enumerate() {
                parameters[*i] += step[12 + column];
            }
            let count = state.camera.lens.parameter_count();
            next.camera = Camera::new(state.camera.lens, &parameters[..count]).ok()?;
            if pixel.board_scale {
                next.board_scale += step[12 + pixel.camera.len()];
            }
        }
        next.kinematic += step.rows(12 + extra, self.model.kinematic_count());
        for (i, rule) in system.eliminated.iter().enumerate() {
            let view = &at.views[i];
            let mut moved = DVector::zeros(6 + extra);
            let mut eta = xi_x + view.to_y * xi_y;
            if let Some(to_kinematic) = &view.to_kinematic {
                eta += to_kinematic * step.rows(12 + extra, self.model.kinematic_count());
            }
            moved.rows_mut(0, 6).copy_from(&eta);
            moved.rows_mut(6, extra).copy_from(&step.rows(12, extra));
            next.corrections[i] -= rule.offset + &rule.slope * moved;
        }
        Some(next)
    }

    fn report(
        &self,
        state: &State,
        at: &Evaluation,
        initial_cost: f64,
        iterations: usize,
        ending: Ending,
    ) -> Solution {
        let system = self.assemble(state, at, 0.0);
        let n = self.model.parameter_count();
        let mut prior_information = DMatrix::zeros(n, n);
        self.add_priors(state, &mut prior_information, &mut DVector::zeros(n));
        let (factor, ending) = judge(&system.h, ending);
        let views = at
            .views
            .iter()
            .zip(self.views)
            .enumerate()
            .map(|(i, (view, k))| {
                let correction = match &self.model.robot {
                    Some(robot) => robot.square_root(*k) * state.corrections[i],
                    None => Vector6::zeros(),
                };
                ViewReport {
                    view: *k,
                    rmse_px: (view.block.squared_px / self.problem.point_count(*k) as f64).sqrt(),
                    cost: view.block.cost,
                    correction,
                    correction_cost: state.corrections.get(i).map_or(0.0, Vector6::norm_squared),
                    pose: view.pose,
                }
            })
            .collect();
        Solution {
            x: state.x,
            y: state.y,
            camera: state.camera,
            board_scale: state.board_scale,
            kinematic: state.kinematic.clone(),
            information: system.h,
            factor,
            prior_information,
            cost: at.cost,
            initial_cost,
            iterations,
            ending,
            views,
            correction_log_determinant: system.log_determinant,
        }
    }
}

/// Adds a view to the normal equations of `[xi_x; xi_y]` alone.
#[inline]
fn add_chain(
    h: &mut SMatrix<f64, 12, 12>,
    g: &mut SMatrix<f64, 12, 1>,
    block: &ViewBlock,
    to_y: &Matrix6<f64>,
) {
    let cross = block.m * to_y;
    let corner = to_y.transpose() * cross;
    let mut xx = h.fixed_view_mut::<6, 6>(0, 0);
    xx += block.m;
    let mut xy = h.fixed_view_mut::<6, 6>(0, 6);
    xy += cross;
    let mut yx = h.fixed_view_mut::<6, 6>(6, 0);
    yx += cross.transpose();
    let mut yy = h.fixed_view_mut::<6, 6>(6, 6);
    yy += corner;
    let mut gx = g.fixed_rows_mut::<6>(0);
    gx += block.g;
    let mut gy = g.fixed_rows_mut::<6>(6);
    gy += to_y.transpose() * block.g;
}

/// Adds a view to the normal equations of all parameters.
fn add_general(
    h: &mut DMatrix<f64>,
    g: &mut DVector<f64>,
    block: &ViewBlock,
    view: &Linearised,
    extra: usize,
) {
    let n = h.nrows();
    let mut map = DMatrix::zeros(6 + extra, n);
    map.view_mut((0, 0), (6, 6)).fill_with_identity();
    map.view_mut((0, 6), (6, 6)).copy_from(&view.to_y);
    map.view_mut((6, 12), (extra, extra)).fill_with_identity();
    if let Some(to_kinematic) = &view.to_kinematic {
        map.view_mut((0, 12 + extra), to_kinematic.shape()).copy_from(to_kinematic);
    }
    let mut gradient = DVector::zeros(6 + extra);
    gradient.rows_mut(0, 6).copy_from(&block.g);
    if let Some(c) = &block.columns {
        gradient.rows_mut(6, extra).copy_from(&c.gc);
    }
    *h += map.tr_mul(&(block.matrix() * &map));
    *g += map.tr_mul(&gradient);
}

/// `(H + damping diag H) step = -g`; `None` if not positive definite.
fn solve_damped(system: &System, damping: f64) -> Option<DVector<f64>> {
    let mut h = system.h.clone();
    for i in 0..h.nrows() {
        h[(i, i)] += damping * h[(i, i)].max(1e-12);
    }
    let step = h.cholesky()?.solve(&-&system.g);
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// Decrease of the (doubled) quadratic model by the step; corrections are at their conditional optimum.
fn predicted_decrease(system: &System, step: &DVector<f64>, damping: f64) -> f64 {
    let mut decrease = -system.g.dot(step);
    for i in 0..step.len() {
        decrease += damping * system.h[(i, i)].max(1e-12) * step[i] * step[i];
    }
    decrease
}
