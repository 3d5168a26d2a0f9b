//! Levenberg-Marquardt on twists between chain and poses from many starts at once, lanes = starts.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]
#![expect(clippy::needless_range_loop, reason = "indices of matrices: several are read at the same place")]

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::systems::{eliminate, entries_of, start_of, substitute};
use super::twists::{exponential, logarithm, product};
use super::weak_prior::WeakPrior;
use crate::batched_algebra::{UPPER, load, store, upper};
use crate::least_squares::through_chain;
use crate::se3::Se3;
use crate::se3::{entries, right_product};
use crate::simd::{Kernel, MAX_LANES, Mask, Simd, Vector, VectorUnit, dispatch};

type Row = [f64; MAX_LANES];

const UNKNOWNS: usize = 12;
/// A step that lowers the cost by less, relatively, is the last of its start.
const TOLERANCE: f64 = 1e-9;
/// Damping to begin with, and its limits.
const FIRST_DAMPING: f64 = 1e-3;
const SMALLEST_DAMPING: f64 = 1e-12;
const LARGEST_DAMPING: f64 = 1e6;

/// What all starts share.
pub(super) struct Poses<'a> {
    views: Vec<View>,
    prior: &'a WeakPrior,
}

struct View {
    motion: [f64; 12],
    /// Inverse of the pose.
    back: [f64; 12],
    /// Information of the pose's twist.
    weight: [f64; UPPER],
}

impl<'a> Poses<'a> {
    pub fn new(motions: &[Se3], poses: &[Se3], weights: &[Matrix6<f64>], prior: &'a WeakPrior) -> Self {
        let view = |((motion, pose), weight): ((&Se3, &Se3), &Matrix6<f64>)| {
            let mut triangle = [0.0; UPPER];
            for i in 0..6 {
                for j in i..6 {
                    triangle[upper(i, j)] = weight[(i, j)];
                }
            }
            View { motion: entries(motion), back: entries(&pose.inverse()), weight: triangle }
        };
        Self { views: motions.iter().zip(poses).zip(weights).map(view).collect(), prior }
    }

    /// Takes steps from each start, fewer where it has converged.
    pub fn descend(&self, runs: &mut [Run], steps: usize) {
        for chunk in runs.chunks_mut(MAX_LANES) {
            let mut lanes = Lanes::of(chunk);
            dispatch(VectorUnit::widest(), Descend { poses: self, lanes: &mut lanes, steps });
            for (i, run) in chunk.iter_mut().enumerate() {
                run.x = transform(&lanes.x, i);
                run.y = transform(&lanes.y, i);
                run.cost = lanes.cost[i];
                run.damping = lanes.damping[i];
            }
        }
    }
}

/// Where a start has come to.
pub(super) struct Run {
    pub x: Se3,
    pub y: Se3,
    pub cost: f64,
    damping: f64,
    pub origin: &'static str,
}

impl Run {
    pub fn new(x: Se3, y: Se3, origin: &'static str) -> Self {
        Self { x, y, cost: f64::INFINITY, damping: FIRST_DAMPING, origin }
    }
}

/// Runs side by side.
#[repr(C, align(64))]
struct Lanes {
    x: [Row; 12],
    y: [Row; 12],
    cost: Row,
    damping: Row,
}

impl Lanes {
    /// Lanes without a run repeat the first.
    fn of(runs: &[Run]) -> Self {
        const ZERO: Row = [0.0; MAX_LANES];
        let mut lanes = Self { x: [ZERO; 12], y: [ZERO; 12], cost: ZERO, damping: ZERO };
        for i in 0..MAX_LANES {
            let run = &runs[if i < runs.len() { i } else { 0 }];
            let both = entries(&run.x).into_iter().zip(entries(&run.y));
            for ((x, y), (row_x, row_y)) in both.zip(lanes.x.iter_mut().zip(&mut lanes.y)) {
                (row_x[i], row_y[i]) = (x, y);
            }
            lanes.damping[i] = run.damping;
        }
        lanes
    }
}

fn transform(rows: &[Row; 12], lane: usize) -> Se3 {
    let e: [f64; 12] = std::array::from_fn(|i| rows[i][lane]);
    Se3::new(Matrix3::from_row_slice(&e[..9]), Vector3::from_column_slice(&e[9..]))
}

struct Descend<'a> {
    poses: &'a Poses<'a>,
    lanes: &'a mut Lanes,
    steps: usize,
}

impl Kernel for Descend<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { poses, lanes, steps } = self;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let mut here = vec![[zero; 6]; poses.views.len()];
        let mut there = here.clone();
        let mut system = vec![zero; entries_of(UNKNOWNS)];
        for at in (0..MAX_LANES).step_by(S::LANES) {
            let (mut x, mut y) = (load(simd, &lanes.x, at), load(simd, &lanes.y, at));
            let mut damping = simd.load(&lanes.damping[at..]);
            let mut cost = errors(simd, poses, &x, &y, &mut here);
            let mut going = one;
            for _ in 0..steps {
                let delta = step(simd, poses, &x, &here, damping, &mut system);
                let tried_x = product(&exponential(simd, &delta.0), &x);
                let tried_y = product(&exponential(simd, &delta.1), &y);
                let tried = errors(simd, poses, &tried_x, &tried_y, &mut there);
                let active = going.greater(zero);
                let better = cost.at_least(tried) & active;
                let lowered = cost - tried;
                let enough = lowered.at_least(simd.splat(TOLERANCE) * cost);
                for (value, other) in x.iter_mut().zip(tried_x).chain(y.iter_mut().zip(tried_y)) {
                    *value = other.keep_or(better, *value);
                }
                for (error, other) in here.iter_mut().zip(&there) {
                    for i in 0..6 {
                        error[i] = other[i].keep_or(better, error[i]);
                    }
                }
                cost = tried.keep_or(better, cost);
                let relaxed = (damping * simd.splat(0.1)).max(simd.splat(SMALLEST_DAMPING));
                let tightened = -(-(damping * simd.splat(10.0))).max(simd.splat(-LARGEST_DAMPING));
                damping = relaxed.keep_or(better, tightened).keep_or(active, damping);
                // A start that no longer gains by its steps is done; one whose step was refused goes on.
                let gained = lowered.greater(zero) & better;
                going = one.keep(enough).keep_or(gained, one).keep(active);
                if zero.at_least(going).all() {
                    break;
                }
            }
            store(&x, &mut lanes.x, at);
            store(&y, &mut lanes.y, at);
            cost.store(&mut lanes.cost[at..]);
            damping.store(&mut lanes.damping[at..]);
        }
    }
}

/// Twists between chain and poses at `X` and `Y`; the cost there, belief included.
#[inline(always)]
fn errors<S: Simd>(
    simd: S,
    poses: &Poses<'_>,
    x: &[S::Vector; 12],
    y: &[S::Vector; 12],
    out: &mut [[S::Vector; 6]],
) -> S::Vector {
    let mut cost = simd.splat(0.0);
    for i in 0..3 {
        let away = x[9 + i] - simd.splat(poses.prior.x_translation_m[i]);
        cost = away.mul_add(away, cost);
    }
    cost = cost * simd.splat(poses.prior.x_translation_sigma_m.powi(-2));
    for (view, out) in poses.views.iter().zip(out) {
        let chain = product(&right_product(simd, x, &view.motion), y);
        *out = logarithm(simd, &right_product(simd, &chain, &view.back));
        let weighted = weighted(simd, view, out);
        for i in 0..6 {
            cost = out[i].mul_add(weighted[i], cost);
        }
    }
    cost
}

#[inline(always)]
fn weighted<S: Simd>(simd: S, view: &View, error: &[S::Vector; 6]) -> [S::Vector; 6] {
    let mut out = *error;
    for i in 0..6 {
        out[i] = simd.splat(view.weight[upper(i, 0)]) * error[0];
        for j in 1..6 {
            out[i] = simd.splat(view.weight[upper(i, j)]).mul_add(error[j], out[i]);
        }
    }
    out
}

/// Twists of `X` and `Y` of the damped normal equations.
#[inline(always)]
fn step<S: Simd>(
    simd: S,
    poses: &Poses<'_>,
    x: &[S::Vector; 12],
    errors: &[[S::Vector; 6]],
    damping: S::Vector,
    system: &mut [S::Vector],
) -> ([S::Vector; 6], [S::Vector; 6]) {
    let zero = simd.splat(0.0);
    believe(simd, poses.prior, x, system);
    for (view, error) in poses.views.iter().zip(errors) {
        let forward = right_product(simd, x, &view.motion);
        let mut weight = [zero; UPPER];
        for (to, from) in weight.iter_mut().zip(view.weight) {
            *to = simd.splat(from);
        }
        let gradient = weighted(simd, view, error);
        let through = through_chain(&weight, &gradient, &forward);
        for i in 0..6 {
            let (upper_row, lower_row) = (start_of(UNKNOWNS, i), start_of(UNKNOWNS, 6 + i));
            for j in i..6 {
                let entry = &mut system[upper_row + j - i];
                *entry = *entry + weight[upper(i, j)];
                let entry = &mut system[lower_row + j - i];
                *entry = *entry + through.yy[upper(i, j)];
            }
            for j in 0..6 {
                let entry = &mut system[upper_row + 6 + j - i];
                *entry = *entry + through.xy[i][j];
            }
            let entry = &mut system[upper_row + UNKNOWNS - i];
            *entry = *entry + gradient[i];
            let entry = &mut system[lower_row + 6 - i];
            *entry = *entry + through.y[i];
        }
    }
    let factor = simd.splat(1.0) + damping;
    for i in 0..UNKNOWNS {
        let entry = &mut system[start_of(UNKNOWNS, i)];
        *entry = *entry * factor;
    }
    let (mut inverses, mut solution) = ([zero; UNKNOWNS], [zero; UNKNOWNS]);
    eliminate(simd, UNKNOWNS, f64::MIN_POSITIVE, system, &mut inverses);
    substitute(UNKNOWNS, system, &inverses, &mut solution);
    let [a, b, c, d, e, f, g, h, i, j, k, l] = solution;
    ([a, b, c, d, e, f], [g, h, i, j, k, l])
}

/// Normal equations of the prior at the present `X`: as [`WeakPrior::normal`].
#[inline(always)]
fn believe<S: Simd>(simd: S, prior: &WeakPrior, x: &[S::Vector; 12], system: &mut [S::Vector]) {
    let zero = simd.splat(0.0);
    for entry in system.iter_mut() {
        *entry = zero;
    }
    let weight = simd.splat(prior.x_translation_sigma_m.powi(-2));
    let turn = prior.rotation_sigma_rad.powi(-2);
    let t = [x[9], x[10], x[11]];
    let squared = t[0].mul_add(t[0], t[1].mul_add(t[1], t[2] * t[2]));
    let mut away = t;
    for i in 0..3 {
        away[i] = (t[i] - simd.splat(prior.x_translation_m[i])) * weight;
    }
    for i in 0..3 {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        // J = [I, -[t]].
        let row = start_of(UNKNOWNS, i);
        system[row] = weight;
        system[row + 3 + a - i] = t[b] * weight;
        system[row + 3 + b - i] = -(t[a] * weight);
        system[row + UNKNOWNS - i] = away[i];
        let row = start_of(UNKNOWNS, 3 + i);
        for j in i..3 {
            let own = if i == j { squared } else { zero };
            system[row + j - i] = (own - t[i] * t[j]) * weight;
        }
        system[row] = system[row] + simd.splat(turn);
        system[row + UNKNOWNS - 3 - i] = t[a] * away[b] - t[b] * away[a];
        system[start_of(UNKNOWNS, 6 + i)] = simd.splat(prior.y_translation_sigma_m.powi(-2));
        system[start_of(UNKNOWNS, 9 + i)] = simd.splat(turn);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;

    use super::*;
    use crate::testing::Random;

    #[test]
    fn a_start_goes_where_single_steps_lead() {
        let random = &mut Random::new(8);
        let (x, y) = (random.transform(0.3, 1.0), random.transform(1.0, 1.0));
        let motions: Vec<Se3> = (0..6).map(|_| random.transform(0.4, 0.8)).collect();
        let poses: Vec<Se3> = motions.iter().map(|a| random.transform(1e-3, 1e-3) * x * *a * y).collect();
        let weights = vec![Matrix6::identity() * 1e6; 6];
        let prior = WeakPrior::default();
        let cost = |x: &Se3, y: &Se3| {
            let off = x.translation - prior.x_translation_m;
            motions.iter().zip(&poses).fold(off.norm_squared(), |sum, (a, c)| {
                sum + 1e6 * (*x * *a * *y * c.inverse()).log().norm_squared()
            })
        };
        let mut runs: Vec<Run> = (0..11)
            .map(|_| Run::new(random.transform(0.2, 0.5) * x, random.transform(0.2, 0.5) * y, "given"))
            .collect();
        let before: Vec<f64> = runs.iter().map(|run| cost(&run.x, &run.y)).collect();
        Poses::new(&motions, &poses, &weights, &prior).descend(&mut runs, 40);
        let least = runs.iter().map(|run| run.cost).fold(f64::INFINITY, f64::min);
        for (run, before) in runs.iter().zip(before) {
            assert!(run.cost < before);
            assert!((run.cost - cost(&run.x, &run.y)).abs() < 1e-6 * run.cost);
            assert!(run.cost - least < 1e-6 * least, "{} {least}", run.cost);
        }
        // No small twist of X or Y lowers the cost.
        let best = &runs[0];
        for i in 0..12 {
            for step in [-1e-4, 1e-4] {
                let mut twist = Vector6::zeros();
                twist[i % 6] = step;
                let moved = Se3::exp(&twist);
                let (x, y) = if i < 6 { (moved * best.x, best.y) } else { (best.x, moved * best.y) };
                assert!(cost(&x, &y) > best.cost);
            }
        }
    }
}
