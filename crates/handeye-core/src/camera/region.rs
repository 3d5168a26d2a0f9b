//! Where a lens is one-to-one, and its inverse there.
//!
//! A distortion polynomial is fitted where there were corners; beyond, it may turn back and map a point far
//! outside the field of view onto the image. A lens is taken as valid up to the first such fold.

use nalgebra::Vector2;

use super::distortion::DistortedPoint;

/// Largest squared radius at unit depth: 89.94 deg off the axis.
pub(super) const MAX_SQUARED_RADIUS: f64 = 1e6;

/// Highest degree of a polynomial here.
const MAX_DEGREE: usize = 6;

/// Value at `s` of the polynomial with these coefficients, lowest power first.
#[inline]
pub(super) fn value(coefficients: &[f64], s: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * s + c)
}

/// Derivative at `s` of the polynomial with these coefficients.
#[inline]
pub(super) fn derivative(coefficients: &[f64], s: f64) -> f64 {
    coefficients.iter().enumerate().skip(1).rev().fold(0.0, |sum, (i, c)| sum * s + c * i as f64)
}

/// The first place in `(0, upper]` where the polynomial, positive at zero, changes its sign; else `upper`.
pub(super) fn first_root(coefficients: &[f64], upper: f64) -> f64 {
    sign_changes(coefficients, upper).0[0].min(upper)
}

/// Places in `(0, upper)` where the polynomial changes its sign, ascending, padded with infinity; their number.
///
/// Between two neighbouring sign changes of its derivative a polynomial is monotone, so each such interval
/// holds at most one.
fn sign_changes(coefficients: &[f64], upper: f64) -> ([f64; MAX_DEGREE], usize) {
    let mut roots = ([f64::INFINITY; MAX_DEGREE], 0);
    let degree = coefficients.iter().rposition(|c| *c != 0.0).unwrap_or(0);
    if degree == 0 {
        return roots;
    }
    let mut slope = [0.0; MAX_DEGREE];
    for i in 0..degree {
        slope[i] = coefficients[i + 1] * (i + 1) as f64;
    }
    let (turns, count) = sign_changes(&slope[..degree], upper);
    let coefficients = &coefficients[..=degree];
    let mut left = (0.0, value(coefficients, 0.0));
    for right in turns[..count].iter().copied().chain([upper]) {
        let right = (right, value(coefficients, right));
        if (left.1 > 0.0) != (right.1 > 0.0) {
            let sign = if right.1 > 0.0 { 1.0 } else { -1.0 };
            roots.0[roots.1] = rising_between(0.0, left.0, right.0, |s| {
                (sign * value(coefficients, s), sign * derivative(coefficients, s))
            });
            roots.1 += 1;
        }
        left = right;
    }
    roots
}

/// The first place in `(0, upper]` where a function, positive at zero, is not; else `upper`.
///
/// Looked for at places that are dense near zero, then by bisection; a shorter dip is missed.
pub(super) fn first_nonpositive(upper: f64, function: impl Fn(f64) -> f64) -> f64 {
    const PLACES: usize = 64;
    let mut before = 0.0;
    for i in 1..=PLACES {
        let t = i as f64 / PLACES as f64;
        let at = t / (1.0 - t + t / upper);
        // NaN (a pole) is not positive either.
        if function(at) > 0.0 {
            before = at;
            continue;
        }
        let mut beyond = at;
        for _ in 0..50 {
            let middle = 0.5 * (before + beyond);
            if function(middle) > 0.0 {
                before = middle;
            } else {
                beyond = middle;
            }
        }
        return before;
    }
    upper
}

/// The argument in `[0, upper]` where a rising function of value and slope reaches `target`; else the nearer end.
pub(super) fn rising_root(target: f64, upper: f64, function: impl Fn(f64) -> (f64, f64)) -> f64 {
    rising_between(target, 0.0, upper, function)
}

/// Newton's method kept inside a shrinking bracket.
fn rising_between(target: f64, lower: f64, upper: f64, function: impl Fn(f64) -> (f64, f64)) -> f64 {
    let (mut lower, mut upper) = (lower, upper);
    let mut at = if target > lower && target < upper { target } else { 0.5 * (lower + upper) };
    for _ in 0..200 {
        let (value, slope) = function(at);
        if value < target {
            lower = at;
        } else {
            upper = at;
        }
        let mut next = at - (value - target) / slope;
        // Also true where the slope is zero and the step NaN.
        if !(lower < next && next < upper) {
            next = 0.5 * (lower + upper);
        }
        if (next - at).abs() <= 4.0 * f64::EPSILON * at.abs() || next <= lower || next >= upper {
            return next;
        }
        at = next;
    }
    at
}

/// Solves `lens(x, y) = target` from a start near the answer, staying where the lens is valid.
///
/// Where that fails (strong decentring next to a fold) the answer is followed from the axis outwards instead.
pub(super) fn undistort(
    start: (f64, f64),
    target: (f64, f64),
    lens: impl Fn(f64, f64) -> Option<DistortedPoint<f64>>,
) -> Option<(f64, f64)> {
    const STAGES: usize = 32;
    let target = Vector2::new(target.0, target.1);
    let found = newton(Vector2::new(start.0, start.1), &target, &lens).or_else(|| {
        let axis = lens(0.0, 0.0)?;
        let axis = Vector2::new(axis.x, axis.y);
        (1..=STAGES).try_fold(Vector2::zeros(), |at, stage| {
            let waypoint = axis.lerp(&target, stage as f64 / STAGES as f64);
            newton(at, &waypoint, &lens)
        })
    })?;
    Some((found.x, found.y))
}

/// Newton's method with halved steps; None where it does not reach the target.
fn newton(
    start: Vector2<f64>,
    target: &Vector2<f64>,
    lens: impl Fn(f64, f64) -> Option<DistortedPoint<f64>>,
) -> Option<Vector2<f64>> {
    let miss = |at: &Vector2<f64>| lens(at.x, at.y).map(|b| (Vector2::new(b.x, b.y) - target, b.jacobian()));
    let mut at = start;
    let (mut residual, mut jacobian) = miss(&at).or_else(|| {
        // The start may lie on the very edge of the region.
        at *= 1.0 - 1e-6;
        miss(&at)
    })?;
    for _ in 0..50 {
        let norm = residual.norm();
        let step = jacobian.try_inverse()? * residual;
        let mut length = 1.0;
        let better = loop {
            let trial = at - step * length;
            match miss(&trial) {
                Some((r, j)) if r.norm() < norm => break Some((trial, r, j)),
                _ if length > 1e-3 => length *= 0.5,
                _ => break None,
            }
        };
        let Some(next) = better else { break };
        (at, residual, jacobian) = next;
    }
    (residual.norm() <= 1e-13 * (1.0 + target.norm())).then_some(at)
}
