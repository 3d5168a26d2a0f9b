//! Joint positions that reach a pose: damped least squares within the limits, from many starts.
//!
//! Each step solves `(J J' + lambda I) y = e`, `dq = J' y` (Wampler 1986; Nakamura and Hanafusa 1986) with a damping
//! proportional to the squared error (Sugihara 2011), so that it passes singular postures far from the goal and
//! converges quadratically at it. A joint that would leave its range is held there for the step. Starts after the
//! first come from an additive recurrence over the joint ranges: even, and the same every time.

use nalgebra::{Matrix6, Vector6};

use super::chain::{Chain, JointKind, MAX_JOINTS};
use crate::error::Error;
use crate::interrupt;
use crate::se3::{Se3, so3_log};

/// How hard to try.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseOptions {
    /// Largest distance of the flange from the goal, metres.
    pub tolerance_m: f64,
    /// Largest angle between flange and goal, radians.
    pub tolerance_rad: f64,
    /// Most steps from one start.
    pub steps: usize,
    /// Most starts, the given one included.
    pub attempts: usize,
}

impl Default for InverseOptions {
    fn default() -> Self {
        Self { tolerance_m: 1e-9, tolerance_rad: 1e-9, steps: 60, attempts: 100 }
    }
}

/// Joint positions within the limits that reach the goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// One position per joint.
    pub joints: Vec<f64>,
    /// Starts tried, this one included.
    pub attempts: usize,
}

/// How near the arm came.
#[derive(Clone, Debug, PartialEq)]
pub struct Unreached {
    /// The nearest posture found.
    pub joints: Vec<f64>,
    /// Its distance from the goal, metres.
    pub off_m: f64,
    /// Its angle to the goal, radians.
    pub off_rad: f64,
}

type Positions = [f64; MAX_JOINTS];

/// Longest step of a joint, radians or metres: the linearisation holds that far.
const LONGEST_STEP: f64 = 0.6;
/// Damping over squared error: at the start, least, and where a start is given up.
const DAMPING: (f64, f64, f64) = (1.0, 1e-9, 1e6);
/// A start is given up where this many steps together shrink the error by less than a tenth.
const PATIENCE: usize = 8;
/// Solutions differ if a joint differs by more than this.
const DISTINCT: f64 = 1e-3;

/// Where one start ended.
struct Run {
    q: Positions,
    off_m: f64,
    off_rad: f64,
    reached: bool,
}

impl Chain {
    /// Joint positions that reach `goal`, near `start` where the way from there leads to it.
    ///
    /// # Errors
    /// [`Unreached`] with the nearest posture found: the goal may be out of reach, or a start was unlucky.
    ///
    /// # Panics
    /// If `start` has fewer entries than the chain has joints.
    pub fn inverse(&self, goal: &Se3, start: &[f64], options: &InverseOptions) -> Result<Reach, Unreached> {
        let mut q = [0.0; MAX_JOINTS];
        q[..self.len()].copy_from_slice(&start[..self.len()]);
        let mut nearest: Option<Run> = None;
        for attempt in 0..options.attempts.max(1) {
            interrupt::check();
            if attempt > 0 {
                q = self.spread_start(attempt);
            }
            let run = self.descend(goal, q, options);
            if run.reached {
                return Ok(Reach { joints: run.q[..self.len()].to_vec(), attempts: attempt + 1 });
            }
            if nearest
                .as_ref()
                .is_none_or(|n| self.cost(run.off_m, run.off_rad) < self.cost(n.off_m, n.off_rad))
            {
                nearest = Some(run);
            }
        }
        let run = nearest.unwrap_or(Run { q, off_m: f64::NAN, off_rad: f64::NAN, reached: false });
        Err(Unreached { joints: run.q[..self.len()].to_vec(), off_m: run.off_m, off_rad: run.off_rad })
    }

    /// All different solutions that the starts lead to, in the order found; a turn more or less is the same one.
    pub fn inverse_all(&self, goal: &Se3, options: &InverseOptions) -> Vec<Vec<f64>> {
        let mut found: Vec<Vec<f64>> = Vec::new();
        for attempt in 1..=options.attempts {
            interrupt::check();
            let run = self.descend(goal, self.spread_start(attempt), options);
            let q = &run.q[..self.len()];
            if run.reached && !found.iter().any(|other| self.same_posture(other, q)) {
                found.push(q.to_vec());
            }
        }
        found
    }

    /// The start `attempt` of a sequence that fills the joint ranges evenly (an additive recurrence).
    pub fn spread_start(&self, attempt: usize) -> [f64; MAX_JOINTS] {
        let n = self.len();
        // The positive root of x^(n+1) = x + 1 generalises the golden ratio (Roberts 2018).
        let mut root = 2.0_f64;
        for _ in 0..30 {
            root = (1.0 + root).powf(1.0 / (n as f64 + 1.0));
        }
        let mut q = [0.0; MAX_JOINTS];
        let mut share = 1.0;
        for (q, joint) in q.iter_mut().zip(self.joints()) {
            share /= root;
            let (low, high) = range(joint.kind, joint.lower, joint.upper);
            *q = low + (high - low) * (0.5 + attempt as f64 * share).fract();
        }
        q
    }

    fn same_posture(&self, a: &[f64], b: &[f64]) -> bool {
        self.joints().iter().zip(a.iter().zip(b)).all(|(joint, (a, b))| {
            let difference = match joint.kind {
                JointKind::Revolute => {
                    let turns = (a - b) / std::f64::consts::TAU;
                    (turns - turns.round()) * std::f64::consts::TAU
                }
                JointKind::Prismatic => a - b,
            };
            difference.abs() < DISTINCT
        })
    }

    /// Length at which a radian weighs as much as it moves things: about half the arm.
    fn radian_m(&self) -> f64 {
        (0.5 * self.links.iter().map(|l| l.translation.norm()).sum::<f64>()).max(0.05)
    }

    fn cost(&self, off_m: f64, off_rad: f64) -> f64 {
        off_m * off_m + (self.radian_m() * off_rad).powi(2)
    }

    /// Error from posture `q` to the goal, `[metres; weighted radians]`, and the Jacobian of the same.
    fn linearise(
        &self,
        goal: &Se3,
        q: &Positions,
        radian_m: f64,
    ) -> (Vector6<f64>, [Vector6<f64>; MAX_JOINTS]) {
        let (flange, places, axes) = self.axes(q);
        let shift = goal.translation - flange.translation;
        let turn = so3_log(&(goal.rotation * flange.rotation.transpose())) * radian_m;
        let mut columns = [Vector6::zeros(); MAX_JOINTS];
        for (i, joint) in self.joints().iter().enumerate() {
            let (v, w) = match joint.kind {
                JointKind::Revolute => (axes[i].cross(&(flange.translation - places[i])), axes[i] * radian_m),
                JointKind::Prismatic => (axes[i], nalgebra::Vector3::zeros()),
            };
            columns[i] = Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z);
        }
        (Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z), columns)
    }

    fn descend(&self, goal: &Se3, mut q: Positions, options: &InverseOptions) -> Run {
        let radian_m = self.radian_m();
        for (q, joint) in q.iter_mut().zip(self.joints()) {
            *q = settle(joint.kind, *q, joint.lower, joint.upper);
        }
        let (mut error, mut columns) = self.linearise(goal, &q, radian_m);
        let mut damping = DAMPING.0;
        let mut milestone = error.norm_squared();
        for step in 0..=options.steps {
            let (off_m, off_rad) =
                (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm() / radian_m);
            let reached = off_m <= options.tolerance_m && off_rad <= options.tolerance_rad;
            let stuck = step % PATIENCE == PATIENCE - 1
                && error.norm_squared() > 0.9 * std::mem::replace(&mut milestone, error.norm_squared());
            if reached || stuck || step == options.steps || damping > DAMPING.2 {
                return Run { q, off_m, off_rad, reached };
            }
            let trial = self.step(&q, &error, &columns, damping);
            let (trial_error, trial_columns) = self.linearise(goal, &trial, radian_m);
            if trial_error.norm_squared() < error.norm_squared() {
                (q, error, columns) = (trial, trial_error, trial_columns);
                damping = (damping * 0.2).max(DAMPING.1);
            } else {
                damping *= 8.0;
            }
        }
        unreachable!("the last step returns")
    }

    /// One damped step; joints that push against a limit are held.
    fn step(
        &self,
        q: &Positions,
        error: &Vector6<f64>,
        columns: &[Vector6<f64>; MAX_JOINTS],
        damping: f64,
    ) -> Positions {
        let n = self.len();
        let mut free = [false; MAX_JOINTS];
        for (i, joint) in self.joints().iter().enumerate() {
            let push = columns[i].dot(error);
            free[i] = !(q[i] <= joint.lower && push < 0.0 || q[i] >= joint.upper && push > 0.0);
        }
        let mut gram = Matrix6::identity() * (damping * error.norm_squared() + 1e-14);
        for column in columns.iter().zip(&free).take(n).filter(|(_, free)| **free).map(|(c, _)| c) {
            gram += column * column.transpose();
        }
        let Some(factor) = gram.cholesky() else { return *q };
        let y = factor.solve(error);
        let mut change = [0.0; MAX_JOINTS];
        let mut longest = 0.0_f64;
        for i in (0..n).filter(|i| free[*i]) {
            change[i] = columns[i].dot(&y);
            longest = longest.max(change[i].abs());
        }
        let scale = if longest > LONGEST_STEP { LONGEST_STEP / longest } else { 1.0 };
        let mut next = *q;
        for (i, joint) in self.joints().iter().enumerate() {
            next[i] = settle(joint.kind, q[i] + scale * change[i], joint.lower, joint.upper);
        }
        next
    }
}

/// The position itself, a turn more or less, or the nearer limit: whichever lies in the range first.
fn settle(kind: JointKind, q: f64, lower: f64, upper: f64) -> f64 {
    if kind == JointKind::Revolute && !(lower..=upper).contains(&q) {
        let turned = if q > upper { q - std::f64::consts::TAU } else { q + std::f64::consts::TAU };
        if (lower..=upper).contains(&turned) {
            return turned;
        }
    }
    q.clamp(lower, upper)
}

/// Limits, or a turn and a metre to both sides where there are none.
fn range(kind: JointKind, lower: f64, upper: f64) -> (f64, f64) {
    let default = if kind == JointKind::Revolute { std::f64::consts::PI } else { 1.0 };
    match (lower.is_finite(), upper.is_finite()) {
        (true, true) => (lower, upper),
        (true, false) => (lower, lower + 2.0 * default),
        (false, true) => (upper - 2.0 * default, upper),
        (false, false) => (-default, default),
    }
}

impl Unreached {
    /// As an error.
    pub fn into_error(self) -> Error {
        Error::numerical(format!(
            "the arm does not reach the pose within its joint limits: nearest {:.1} mm and {:.2} deg away",
            self.off_m * 1e3,
            self.off_rad.to_degrees()
        ))
    }
}
