//! k views jointly: greedy, then exchange while a swap improves (Fedorov 1972; Mitchell 1974).

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use super::objective::Objective;
use super::pool::Pool;
use crate::error::Error;
use crate::interrupt;
use crate::simd::VectorUnit;

/// A choice of views and its worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// Indices into the pool, in the order of choice.
    pub indices: Vec<usize>,
    /// `phi` after each of the greedy choices, before exchange.
    pub greedy: Vec<f64>,
    /// `phi` of the whole choice.
    pub value: f64,
    /// Swaps that exchange made.
    pub swaps: usize,
}

/// First views tried: the best alone need not belong to the best choice.
const STARTS: usize = 16;
/// Most passes of exchange over the choice.
const PASSES: usize = 20;

pub(super) fn check(base: &DMatrix<f64>, pool: &[DMatrix<f64>], k: usize) -> Result<(), Error> {
    let n = base.nrows();
    if n < 7 || base.ncols() != n || pool.iter().any(|i| i.shape() != (n, n)) {
        return Err(Error::invalid("the information of the pool must have the shape of the base's"));
    }
    if k == 0 || k > pool.len() {
        return Err(Error::invalid(format!("{k} of {} views cannot be chosen", pool.len())));
    }
    Ok(())
}

/// Chooses `k` of the pool on top of what `base` knows.
///
/// # Errors
/// [`Error::InvalidInput`] for shapes that differ or an impossible `k`; [`Error::Degenerate`] if no choice makes
/// the information regular.
pub fn select(
    base: &DMatrix<f64>,
    pool: &[DMatrix<f64>],
    k: usize,
    objective: &Objective,
) -> Result<Selection, Error> {
    check(base, pool, k)?;
    let pool = Pool::new(pool, VectorUnit::widest());
    let mut worth = Vec::new();
    pool.worth(base, objective, &mut worth);
    let mut first: Vec<usize> = (0..pool.len()).collect();
    first.sort_by(|a, b| worth[*b].total_cmp(&worth[*a]));
    let mut seen = BTreeSet::new();
    let mut best: Option<Selection> = None;
    for j in first.iter().take(STARTS) {
        let found = from_first(base, &pool, k, objective, (*j, worth[*j]), &mut seen);
        best = match (best, found) {
            (Some(best), Some(found)) if is_better(found.value, best.value) => Some(found),
            (best, found) => best.or(found),
        };
    }
    best.ok_or_else(|| Error::degenerate("no choice of these views determines the answer"))
}

/// Better by more than rounding: the order of choices of one worth is that of the pool on every machine.
fn is_better(new: f64, old: f64) -> bool {
    new > old + 1e-12 * old.abs() || !old.is_finite()
}

/// Greedy from a given first view and its worth, then exchange; `None` if nothing regular is found, or nothing that
/// another first view has not led to.
fn from_first(
    base: &DMatrix<f64>,
    pool: &Pool<'_>,
    k: usize,
    objective: &Objective,
    (first, alone): (usize, f64),
    seen: &mut BTreeSet<Vec<usize>>,
) -> Option<Selection> {
    let mut worth = Vec::new();
    let mut indices = vec![first];
    let mut total = base + pool.information(first);
    let mut greedy = vec![alone];
    for _ in 1..k {
        interrupt::check();
        let (index, value) = best_addition(&total, pool, &indices, objective, &mut worth)?;
        total += pool.information(index);
        indices.push(index);
        greedy.push(value);
    }
    let mut value = greedy[k - 1];
    let mut swaps = 0;
    for _ in 0..PASSES {
        let mut choice = indices.clone();
        choice.sort_unstable();
        if !seen.insert(choice) {
            return None;
        }
        let before = swaps;
        for slot in 0..k {
            interrupt::check();
            let without = &total - pool.information(indices[slot]);
            if let Some((index, better)) = best_addition(&without, pool, &indices, objective, &mut worth)
                && is_better(better, value)
            {
                total = without + pool.information(index);
                indices[slot] = index;
                value = better;
                swaps += 1;
            }
        }
        if swaps == before {
            break;
        }
    }
    value.is_finite().then_some(Selection { indices, greedy, value, swaps })
}

/// The view worth most on top of a total among those not taken, and the worth; `worth` is a desk.
fn best_addition(
    total: &DMatrix<f64>,
    pool: &Pool<'_>,
    taken: &[usize],
    objective: &Objective,
    worth: &mut Vec<f64>,
) -> Option<(usize, f64)> {
    pool.worth(total, objective, worth);
    worth
        .iter()
        .copied()
        .enumerate()
        .filter(|(j, value)| !taken.contains(j) && *value > f64::NEG_INFINITY)
        .max_by(|a, b| a.1.total_cmp(&b.1))
}
