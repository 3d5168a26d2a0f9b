//! No choice of k of these views can beat this bound.
//!
//! `phi` is concave, so for any reference `R`
//! `phi(Lambda) <= phi(R) + tr(G(R) (Lambda - R))`, and over all choices of k views the right side is largest for
//! the k with the largest `tr(G I_j)`. Frank-Wolfe over fractional choices `R = Lambda_0 + sum w_j I_j` minimises
//! the bound (Frank and Wolfe 1956; Jaggi 2013 for the gap).

use nalgebra::DMatrix;

use super::objective::Objective;
use super::selection::check;
use crate::error::Error;

/// An upper bound on what any choice can reach.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// No choice of k views has a larger `phi`.
    pub bound: f64,
    /// `phi` of the best fractional choice found.
    pub relaxed: f64,
    /// Steps of Frank-Wolfe.
    pub iterations: usize,
}

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
    let share = k as f64 / pool.len() as f64;
    // Mostly the start, a little of everything: regular wherever any choice is.
    let lean = if start.len() == k { 0.9 } else { 0.0 };
    let mut reference = base.clone();
    for information in pool {
        reference += information * (share * (1.0 - lean));
    }
    for index in start.iter().take(if lean > 0.0 { k } else { 0 }) {
        let information =
            pool.get(*index).ok_or_else(|| Error::invalid(format!("view {index} of {}", pool.len())))?;
        reference += information * lean;
    }
    let mut bound = f64::INFINITY;
    let mut relaxed = f64::NEG_INFINITY;
    let mut done = 0;
    for _ in 0..iterations.max(1) {
        done += 1;
        let Some((value, gradient)) = objective.gradient(&reference) else {
            return Err(Error::degenerate("no choice of these views determines the answer"));
        };
        relaxed = relaxed.max(value);
        let mut scores: Vec<(usize, f64)> =
            pool.iter().enumerate().map(|(j, i)| (j, gradient.dot(i))).collect();
        scores.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut vertex = base.clone();
        let mut linear = 0.0;
        for (j, score) in &scores[..k] {
            vertex += &pool[*j];
            linear += score;
        }
        let here = gradient.dot(&(&reference - base));
        bound = bound.min(value + linear - here);
        if bound - relaxed <= tolerance {
            break;
        }
        let direction = vertex - &reference;
        let step = line_search(&reference, &direction, objective, gradient.dot(&direction));
        if step <= 0.0 {
            break;
        }
        reference += direction * step;
    }
    Ok(Certificate { bound, relaxed, iterations: done })
}

/// Maximises the concave `phi(reference + step direction)` over `[0, 1]`: a root of its slope, which falls from
/// `at_start`, by false position with the Illinois rule (Dowell and Jarratt 1971). A step that is nearly best will do.
fn line_search(
    reference: &DMatrix<f64>,
    direction: &DMatrix<f64>,
    objective: &Objective,
    at_start: f64,
) -> f64 {
    const ENOUGH: f64 = 1e-2;
    const TRIES: usize = 12;
    let slope =
        |step: f64| objective.gradient(&(reference + direction * step)).map(|(_, g)| g.dot(direction));
    let (mut low, mut above) = (0.0, at_start);
    let (mut high, mut below) = match slope(1.0) {
        Some(s) if s >= 0.0 => return 1.0,
        Some(s) => (1.0, s),
        None => (1.0, -at_start),
    };
    if above <= 0.0 {
        return 0.0;
    }
    for _ in 0..TRIES {
        let step = (low * below - high * above) / (below - above);
        let Some(s) = slope(step) else {
            high = step;
            continue;
        };
        if s.abs() <= ENOUGH * at_start {
            return step;
        }
        if s > 0.0 {
            (low, above) = (step, s);
            below *= 0.5;
        } else {
            (high, below) = (step, s);
            above *= 0.5;
        }
    }
    low
}
