//! Levenberg-Marquardt and Gauss-Newton with the per-view pose corrections eliminated (Schur complement).
//!
//! Damping after Nielsen (1999), "Damping Parameter in Marquardt's Method", IMM-REP-1999-05.

use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, SMatrix, Vector6};

use super::accumulate::{ViewBlock, view_block};
use super::loss::Loss;
use super::marginal::{Eliminated, eliminate};
use super::model::{Model, Side};
use super::problem::{MIN_VIEWS, Problem};
use super::report::{Ending, Solution, ViewReport};
use crate::camera::Camera;
use crate::error::Error;
use crate::se3::Se3;

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

/// Smallest pivot of the equilibrated information that counts as determined. A pivot is one minus the squared
/// multiple correlation of a parameter with those before it; rounding alone leaves about 1e-15.
const PIVOT_LIMIT: f64 = 1e-13;
/// Damping at which no further try makes sense.
const LARGEST_DAMPING: f64 = 1e16;
/// Squared whitened residual per sample below which a cost is rounding.
const ROUNDING_COST: f64 = 1e-20;

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

struct Solver<'a> {
    problem: &'a Problem,
    model: &'a Model,
    options: &'a Options,
    views: &'a [usize],
}

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
    Solver { problem, model, options, views }.run(start)
}

impl Solver<'_> {
    fn run(&self, start: &Start) -> Result<Solution, Error> {
        let corrections = if self.model.robot.is_some() { self.views.len() } else { 0 };
        let mut state = State {
            x: start.x,
            y: start.y,
            camera: *self.problem.camera(),
            board_scale: 0.0,
            kinematic: DVector::zeros(self.model.kinematic_count()),
            corrections: vec![Vector6::zeros(); corrections],
        };
        let mut current = self.evaluate(&state).map_err(|k| {
            Error::numerical(format!("the start puts points of view {k} out of the camera's sight"))
        })?;
        let initial_cost = current.cost;
        let samples: usize = self.views.iter().map(|k| self.problem.point_count(*k)).sum();
        let floor = ROUNDING_COST * samples as f64;
        let damped = self.options.method == Method::LevenbergMarquardt;
        let mut damping = if damped { 1e-4 } else { 0.0 };
        let mut growth = 2.0;
        let mut rises = 0;
        let mut iterations = 0;
        let ending = loop {
            if iterations == self.options.max_iterations {
                break Ending::OutOfIterations;
            }
            iterations += 1;
            let system = self.assemble(&state, &current, damping);
            let Some(step) = solve_damped(&system, damping) else {
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
            let predicted = predicted_decrease(&system, &step, damping);
            if predicted <= self.options.gradient_tolerance * current.cost.max(floor) {
                break Ending::ConvergedGradient;
            }
            let small_step = step.amax() < self.options.step_tolerance;
            let trial_state = self.step(&state, &current, &system, &step);
            // Linearising costs little more than the cost alone, and most trials are accepted.
            let trial = trial_state
                .as_ref()
                .and_then(|s| self.evaluate(s).ok())
                .filter(|t| !damped || t.cost < current.cost);
            let Some((trial_state, trial)) = trial_state.zip(trial) else {
                if !damped {
                    break Ending::Diverged;
                }
                // Rounding: nothing left to gain although the model promises a trace.
                if small_step || predicted <= 1e-9 * current.cost.max(floor) {
                    break Ending::ConvergedStep;
                }
                damping *= growth;
                growth *= 2.0;
                if damping > LARGEST_DAMPING {
                    break Ending::Diverged;
                }
                continue;
            };
            let decrease = current.cost - trial.cost;
            let previous = current.cost;
            state = trial_state;
            current = trial;
            if damped {
                let ratio = decrease / predicted;
                damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 9.0);
                damping = damping.max(1e-15);
                growth = 2.0;
            } else if decrease < 0.0 {
                rises += 1;
                if rises == 5 {
                    break Ending::Diverged;
                }
            }
            if decrease.abs() <= self.options.cost_tolerance * previous {
                break Ending::ConvergedCost;
            }
            if small_step {
                break Ending::ConvergedStep;
            }
        };
        Ok(self.report(&state, &current, initial_cost, iterations, ending))
    }

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
            for (of_x, value) in [(true, &state.x), (false, &state.y)] {
                let (deviation, _, information) = prior.term(of_x, value);
                cost += deviation.component_mul(&deviation).dot(&information);
            }
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
                self.options.loss,
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
                let (deviation, jacobian, information) = prior.term(of_x, value);
                let weighted = jacobian.transpose() * Matrix6::from_diagonal(&information);
                let mut block = h.view_mut((at, at), (6, 6));
                block += weighted * jacobian;
                let mut rows = g.rows_mut(at, 6);
                rows += weighted * deviation;
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
        let degenerate = smallest_pivot(&system.h) < PIVOT_LIMIT;
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
            prior_information,
            cost: at.cost,
            initial_cost,
            iterations,
            ending: if degenerate { Ending::Degenerate } else { ending },
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

/// Smallest pivot of the Cholesky factorisation of `h` scaled to a unit diagonal; zero if it does not exist.
fn smallest_pivot(h: &DMatrix<f64>) -> f64 {
    let n = h.nrows();
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / h[(i, i)].max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| h[(i, j)] * scale[i] * scale[j]);
    if scaled.iter().any(|x| !x.is_finite()) {
        return 0.0;
    }
    let Some(factor) = scaled.cholesky() else { return 0.0 };
    (0..n).map(|i| factor.l_dirty()[(i, i)].powi(2)).fold(f64::INFINITY, f64::min)
}
