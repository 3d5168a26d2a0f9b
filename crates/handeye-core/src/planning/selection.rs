//! k views jointly: greedy, then exchange while a swap improves (Fedorov 1972; Mitchell 1974).

use nalgebra::DMatrix;

use super::objective::Objective;
use crate::error::Error;

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
    let mut first: Vec<(usize, f64)> = (0..pool.len())
        .map(|j| (j, objective.value(&(base + &pool[j])).unwrap_or(f64::NEG_INFINITY)))
        .collect();
    first.sort_by(|a, b| b.1.total_cmp(&a.1));
    first
        .iter()
        .take(STARTS)
        .filter_map(|(j, _)| from_first(base, pool, k, objective, *j))
        .max_by(|a, b| a.value.total_cmp(&b.value))
        .ok_or_else(|| Error::degenerate("no choice of these views determines the answer"))
}

/// Greedy from a given first view, then exchange.
fn from_first(
    base: &DMatrix<f64>,
    pool: &[DMatrix<f64>],
    k: usize,
    objective: &Objective,
    first: usize,
) -> Option<Selection> {
    let mut indices = vec![first];
    let mut total = base + &pool[first];
    let mut greedy = vec![objective.value(&total).unwrap_or(f64::NEG_INFINITY)];
    for _ in 1..k {
        let (index, value) = best_addition(&total, pool, &indices, objective)?;
        total += &pool[index];
        indices.push(index);
        greedy.push(value);
    }
    let mut value = greedy[k - 1];
    let mut swaps = 0;
    for _ in 0..PASSES {
        let before = swaps;
        for slot in 0..k {
            let without = &total - &pool[indices[slot]];
            if let Some((index, better)) = best_addition(&without, pool, &indices, objective)
                && (better > value + 1e-12 * value.abs() || !value.is_finite())
            {
                total = without + &pool[index];
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

fn best_addition(
    total: &DMatrix<f64>,
    pool: &[DMatrix<f64>],
    taken: &[usize],
    objective: &Objective,
) -> Option<(usize, f64)> {
    (0..pool.len())
        .filter(|j| !taken.contains(j))
        .filter_map(|j| objective.value(&(total + &pool[j])).map(|value| (j, value)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
}
