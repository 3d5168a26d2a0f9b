//! No choice of k of these views can beat this bound.
//!
//! `phi` is concave, so for any reference `R`
//! `phi(Lambda) <= phi(R) + tr(G(R) (Lambda - R))`, and over all choices of k views the right side is largest for
//! the k with the largest `tr(G I_j)` (Frank and Wolfe 1956; Jaggi 2013 for the gap). References are fractional choices
//! `R = Lambda_0 + sum w_j I_j` with `0 <= w_j <= 1` and `sum w_j = k`. The weights of the few views that violate the
//! conditions of optimality most are improved by Newton's method, the others stay, as in the decomposition methods of
//! support vector machines (Joachims 1999).

use nalgebra::DMatrix;

use super::objective::{Expansion, Objective};
use super::pool::Pool;
use super::reweigh::reweigh;
use super::selection::check;
use crate::error::Error;
use crate::interrupt;
use crate::simd::VectorUnit;

/// An upper bound on what any choice can reach.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// No choice of k views has a larger `phi`.
    pub bound: f64,
    /// `phi` of the best fractional choice found.
    pub relaxed: f64,
    /// References looked at.
    pub iterations: usize,
}

/// Views whose weights are raised, and as many whose weights are lowered, at a time.
const TOGETHER: usize = 12;

/// Bounds `phi` over all choices of `k` views of the pool on top of `base`.
///
/// Stops when bound and fractional optimum agree to `tolerance`, or after `iterations`; the bound holds whenever
/// it stops. `start` is a choice to begin from, for example a greedy one.
///
/// # Errors
/// As [`super::select`].
pub fn certify(
    base: &DMatrix<f64>,
    pool: &[DMatrix<f64>],
    k: usize,
    objective: &Objective,
    start: &[usize],
    iterations: usize,
    tolerance: f64,
) -> Result<Certificate, Error> {
    check(base, pool, k)?;
    if let Some(index) = start.iter().find(|i| **i >= pool.len()) {
        return Err(Error::invalid(format!("view {index} of {}", pool.len())));
    }
    let pool = Pool::new(pool, VectorUnit::widest());
    let degenerate = || Error::degenerate("no choice of these views determines the answer");
    let (mut weights, mut here) = chosen(base, &pool, k, objective, start)
        .or_else(|| spread_evenly(base, &pool, k, objective))
        .ok_or_else(degenerate)?;
    let mut bound = f64::INFINITY;
    let mut relaxed = f64::NEG_INFINITY;
    let mut done = 0;
    let mut lean = Vec::new();
    for _ in 0..iterations.max(1) {
        interrupt::check();
        done += 1;
        relaxed = relaxed.max(here.value);
        pool.lean(&here.gradient, &mut lean);
        bound = bound.min(here.value + gap(&lean, &weights, k));
        if bound - relaxed <= tolerance {
            break;
        }
        let Some(next) = improve(base, &pool, objective, &here, &lean, &mut weights) else { break };
        here = next;
    }
    Ok(Certificate { bound, relaxed, iterations: done })
}

/// All weight on a choice of k, and `phi` there; `None` if it is not one or leaves something open.
fn chosen(
    base: &DMatrix<f64>,
    pool: &Pool<'_>,
    k: usize,
    objective: &Objective,
    start: &[usize],
) -> Option<(Vec<f64>, Expansion)> {
    let mut weights = vec![0.0; pool.len()];
    for index in start {
        weights[*index] = 1.0;
    }
    let distinct = weights.iter().filter(|w| **w > 0.0).count();
    (start.len() == k && distinct == k).then_some(())?;
    let here = objective.expand(&reference(base, pool, &weights))?;
    Some((weights, here))
}

/// The same weight on every view: regular wherever any choice is.
fn spread_evenly(
    base: &DMatrix<f64>,
    pool: &Pool<'_>,
    k: usize,
    objective: &Objective,
) -> Option<(Vec<f64>, Expansion)> {
    let weights = vec![k as f64 / pool.len() as f64; pool.len()];
    let here = objective.expand(&reference(base, pool, &weights))?;
    Some((weights, here))
}

/// `Lambda_0 + sum w_j I_j`.
fn reference(base: &DMatrix<f64>, pool: &Pool<'_>, weights: &[f64]) -> DMatrix<f64> {
    let mut sum = base.clone();
    for (view, weight) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
        sum += pool.information(view) * *weight;
    }
    sum
}

/// By how much the linear bound lies above the fractional choice it is taken at.
fn gap(lean: &[f64], weights: &[f64], k: usize) -> f64 {
    let mut largest = lean.to_vec();
    largest.select_nth_unstable_by(k - 1, |a, b| b.total_cmp(a));
    let best: f64 = largest[..k].iter().sum();
    best - lean.iter().zip(weights).map(|(l, w)| l * w).sum::<f64>()
}

/// Moves weight between the views that violate optimality most; what is there then, `None` if nothing can be gained.
fn improve(
    base: &DMatrix<f64>,
    pool: &Pool<'_>,
    objective: &Objective,
    here: &Expansion,
    lean: &[f64],
    weights: &mut [f64],
) -> Option<Expansion> {
    let views = violators(lean, weights);
    let curved: Vec<DMatrix<f64>> =
        views.iter().map(|j| objective.curvature(here, pool.information(*j))).collect();
    let mut curvatures = DMatrix::zeros(views.len(), views.len());
    for (i, along) in curved.iter().enumerate() {
        for (j, view) in views.iter().enumerate().skip(i) {
            let value = along.dot(pool.information(*view));
            curvatures[(i, j)] = value;
            curvatures[(j, i)] = value;
        }
    }
    let slopes: Vec<f64> = views.iter().map(|j| lean[*j]).collect();
    let before: Vec<f64> = views.iter().map(|j| weights[*j]).collect();
    let change = reweigh(&slopes, &curvatures, &before);
    let at_start: f64 = slopes.iter().zip(&change).map(|(s, d)| s * d).sum();
    let mut direction = DMatrix::zeros(base.nrows(), base.nrows());
    for (view, d) in views.iter().zip(&change).filter(|(_, d)| **d != 0.0) {
        direction += pool.information(*view) * *d;
    }
    let current = reference(base, pool, weights);
    let (step, found) = line_search(&current, &direction, objective, at_start)?;
    for ((view, d), w) in views.iter().zip(&change).zip(&before) {
        weights[*view] = (w + step * d).clamp(0.0, 1.0);
    }
    Some(found)
}

/// Views that should weigh more than they do, and views that should weigh less.
fn violators(lean: &[f64], weights: &[f64]) -> Vec<usize> {
    let mut up: Vec<usize> = (0..lean.len()).filter(|j| weights[*j] < 1.0).collect();
    up.sort_by(|a, b| lean[*b].total_cmp(&lean[*a]));
    let mut down: Vec<usize> = (0..lean.len()).filter(|j| weights[*j] > 0.0).collect();
    down.sort_by(|a, b| lean[*a].total_cmp(&lean[*b]));
    let mut views: Vec<usize> =
        up.into_iter().take(TOGETHER).chain(down.into_iter().take(TOGETHER)).collect();
    views.sort_unstable();
    views.dedup();
    views
}

/// Maximises the concave `phi(reference + step direction)` over `[0, 1]`, and what is there: a root of its slope, which
/// falls from `at_start`, by false position with the Illinois rule (Dowell and Jarratt 1971). A step that is nearly
/// best will do; `None` if there is none.
fn line_search(
    reference: &DMatrix<f64>,
    direction: &DMatrix<f64>,
    objective: &Objective,
    at_start: f64,
) -> Option<(f64, Expansion)> {
    const ENOUGH: f64 = 0.1;
    const TRIES: usize = 12;
    if at_start <= 0.0 {
        return None;
    }
    let slope_at = |step: f64| {
        let there = objective.expand(&(reference + direction * step))?;
        let slope = there.gradient.dot(direction);
        Some((slope, there))
    };
    let (mut low, mut above, mut found) = (0.0, at_start, None);
    let (mut high, mut below) = match slope_at(1.0) {
        Some((slope, there)) if slope >= -ENOUGH * at_start => return Some((1.0, there)),
        Some((slope, _)) => (1.0, slope),
        None => (1.0, -at_start),
    };
    for _ in 0..TRIES {
        let step = (low * below - high * above) / (below - above);
        let Some((slope, there)) = slope_at(step) else {
            high = step;
            continue;
        };
        if slope.abs() <= ENOUGH * at_start {
            return Some((step, there));
        }
        if slope > 0.0 {
            (low, above, found) = (step, slope, Some((step, there)));
            below *= 0.5;
        } else {
            (high, below) = (step, slope);
            above *= 0.5;
        }
    }
    found
}
