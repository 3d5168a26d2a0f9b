//! A start chosen automatically: every method, ranked by the caller's cost.

use super::{Method, Prepared};
use crate::error::Error;
use crate::se3::Se3;

/// One method's answer and what it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Which method gave it.
    pub method: Method,
    /// `X` of `C = X A Y`.
    pub x: Se3,
    /// `Y` of `C = X A Y`.
    pub y: Se3,
    /// What the caller's cost said, finite.
    pub cost: f64,
}

/// Every answer, the cheapest first, and the methods that had none.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranking {
    /// By rising cost, at least one.
    pub candidates: Vec<Candidate>,
    /// Methods without an answer, and why.
    pub failures: Vec<(Method, Error)>,
}

/// Runs every method and ranks the answers by `cost(X, Y)`, for instance the reprojection error.
///
/// An answer whose cost is an error or not finite (a target behind the camera, say) counts as a failure.
///
/// # Errors
/// The errors of [`super::solve`] that concern the views themselves, and the first failure if no
/// method had an answer.
pub fn rank(
    a: &[Se3],
    c: &[Se3],
    mut cost: impl FnMut(&Se3, &Se3) -> Result<f64, Error>,
) -> Result<Ranking, Error> {
    let prepared = Prepared::new(a, c)?;
    let mut candidates = Vec::new();
    let mut failures = Vec::new();
    for method in Method::ALL {
        let candidate = prepared.solve(method).and_then(|estimate| {
            let cost = cost(&estimate.x, &estimate.y)?;
            if cost.is_finite() {
                Ok(Candidate { method, x: estimate.x, y: estimate.y, cost })
            } else {
                Err(Error::numerical(format!("the cost of the start by {} is {cost}", method.name())))
            }
        });
        match candidate {
            Ok(candidate) => candidates.push(candidate),
            Err(error) => failures.push((method, error)),
        }
    }
    if candidates.is_empty() {
        return Err(failures.remove(0).1);
    }
    // Stable: of equal costs the order of `Method::ALL` decides.
    candidates.sort_by(|p, q| p.cost.total_cmp(&q.cost));
    Ok(Ranking { candidates, failures })
}

impl Ranking {
    /// The cheapest answer.
    pub fn best(&self) -> &Candidate {
        &self.candidates[0]
    }

    /// Up to `count` of the cheapest answers that are not nearly the same: two differ if their `X` or their
    /// `Y` are more than `metres` or `radians` apart.
    pub fn distinct(&self, count: usize, metres: f64, radians: f64) -> Vec<&Candidate> {
        let apart = |p: &Se3, q: &Se3| {
            let difference = p.inverse() * *q;
            difference.translation.norm() > metres || difference.angle() > radians
        };
        let mut chosen: Vec<&Candidate> = Vec::new();
        for candidate in &self.candidates {
            if chosen.len() == count {
                break;
            }
            if chosen.iter().all(|other| apart(&other.x, &candidate.x) || apart(&other.y, &candidate.y)) {
                chosen.push(candidate);
            }
        }
        chosen
    }
}
