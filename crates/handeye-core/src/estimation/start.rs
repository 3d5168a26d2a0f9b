//! `X` and `Y` from poses alone, from anywhere: many starts, a weak prior, Levenberg-Marquardt on twists.
//!
//! Three views at random are often degenerate (equal orientations); a plan must survive them. A weak prior keeps
//! what they leave open near where a camera can be, and a start on each of the 24 rotations that map axes to axes
//! finds the basin where the closed forms refuse, or lead nowhere.

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector6};

use super::descent::{Poses, Run};
use super::weak_prior::WeakPrior;
use crate::closed_form;
use crate::error::Error;
use crate::se3::{Se3, nearest_rotation};

/// `X` and `Y` found from poses.
#[derive(Clone, Copy, Debug)]
pub struct ChainStart {
    /// `X`.
    pub x: Se3,
    /// `Y`.
    pub y: Se3,
    /// Sum of squared whitened twists between chain and poses, and the prior.
    pub cost: f64,
    /// Where it started: a closed form's name, `"given"`, or `"axes"`.
    pub origin: &'static str,
}

/// Steps before the field of starts is thinned, and after.
const FIRST_STEPS: usize = 6;
const LAST_STEPS: usize = 25;
/// Starts that survive the thinning.
const SURVIVORS: usize = 6;

/// Finds `X` and `Y` with `poses[k] ~ X motions[k] Y`, weighted by the poses' covariances.
///
/// # Errors
/// [`Error::InvalidInput`] for lists that differ in length or are empty, or a covariance that is not positive
/// definite.
pub fn start_from_poses(
    motions: &[Se3],
    poses: &[Se3],
    covariances: &[Matrix6<f64>],
    prior: &WeakPrior,
    given: Option<(Se3, Se3)>,
) -> Result<ChainStart, Error> {
    if motions.len() != poses.len() || poses.len() != covariances.len() || poses.is_empty() {
        return Err(Error::invalid("motions, poses and covariances must be as many, at least one"));
    }
    let weights = covariances
        .iter()
        .map(|c| c.cholesky().map(|f| f.inverse()))
        .collect::<Option<Vec<_>>>()
        .ok_or_else(|| Error::invalid("the covariance of a pose is not positive definite"))?;
    let mut starts = Vec::new();
    if let Some((x, y)) = given {
        starts.push(Run::new(x, y, "given"));
    }
    let twists = Poses::new(motions, poses, &weights, prior);
    twists.descend(&mut starts, FIRST_STEPS + LAST_STEPS);
    let mut found = false;
    for method in [closed_form::Method::ParkMartin, closed_form::Method::Shah] {
        if found {
            break;
        }
        if let Ok(estimate) = closed_form::solve(method, motions, poses) {
            let mut run = [Run::new(estimate.x, estimate.y, method.name())];
            twists.descend(&mut run, FIRST_STEPS + LAST_STEPS);
            starts.extend(run);
            // Motions that determine an answer, and one that is off by no more than noise: there is no other.
            found = starts.iter().any(|run| run.cost <= (6 * poses.len()) as f64);
        }
    }
    if !found {
        let mut axes: Vec<Run> = axis_rotations()
            .iter()
            .map(|rotation| {
                let (x, y) = with_rotation(rotation, motions, poses, prior);
                Run::new(x, y, "axes")
            })
            .collect();
        twists.descend(&mut axes, FIRST_STEPS);
        starts.append(&mut axes);
        starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        starts.truncate(SURVIVORS);
        twists.descend(&mut starts, LAST_STEPS);
    }
    starts
        .into_iter()
        .map(|run| ChainStart { x: run.x, y: run.y, cost: run.cost, origin: run.origin })
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .ok_or_else(|| Error::numerical("no start"))
}

/// `Y` as the mean rotation of what the views say, and both translations by linear least squares.
fn with_rotation(rx: &Matrix3<f64>, motions: &[Se3], poses: &[Se3], prior: &WeakPrior) -> (Se3, Se3) {
    let mut sum = Matrix3::zeros();
    let mut h = Matrix6::zeros();
    let mut right = Vector6::zeros();
    for (motion, pose) in motions.iter().zip(poses) {
        let turn = rx * motion.rotation;
        sum += turn.transpose() * pose.rotation;
        let mut rows = SMatrix::<f64, 3, 6>::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&turn);
        h += rows.transpose() * rows;
        right += rows.transpose() * (pose.translation - rx * motion.translation);
    }
    // Just enough belief to make the system regular.
    let faint = 1e-6;
    for i in 0..6 {
        h[(i, i)] += faint;
    }
    for i in 0..3 {
        right[i] += faint * prior.x_translation_m[i];
    }
    let t = h.cholesky().map_or_else(Vector6::zeros, |f| f.solve(&right));
    let ry = nearest_rotation(&sum).unwrap_or_else(|_| Matrix3::identity());
    let x = Se3::new(*rx, t.fixed_rows::<3>(0).into_owned());
    (x, Se3::new(ry, t.fixed_rows::<3>(3).into_owned()))
}

/// The 24 rotations that map the axes onto axes.
fn axis_rotations() -> Vec<Matrix3<f64>> {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut all = Vec::with_capacity(24);
    for order in orders {
        for signs in 0..8_u8 {
            let mut m = Matrix3::zeros();
            for (row, column) in order.into_iter().enumerate() {
                m[(row, column)] = if signs >> row & 1 == 0 { 1.0 } else { -1.0 };
            }
            if m.determinant() > 0.0 {
                all.push(m);
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn axes_are_tried_where_no_closed_form_explains_the_poses() {
        let random = &mut Random::new(12);
        let (x, y) = (random.transform(0.2, 1.0), random.transform(0.8, 1.0));
        let mut origin = |turn: f64, wrong: f64| {
            let motions: Vec<Se3> = (0..8).map(|_| random.transform(0.4, turn)).collect();
            let poses: Vec<Se3> =
                motions.iter().map(|a| random.transform(wrong, wrong) * x * *a * y).collect();
            let covariances = vec![Matrix6::identity() * 1e-6; poses.len()];
            let found =
                start_from_poses(&motions, &poses, &covariances, &WeakPrior::default(), None).unwrap();
            (found.origin, found.cost <= (6 * poses.len()) as f64)
        };
        assert_eq!(origin(0.5, 1e-4), ("park_martin", true));
        // Motions that determine nothing, though all agree.
        assert_eq!(origin(0.0, 1e-4), ("axes", true));
        // Poses that no answer explains: whatever fits best.
        assert!(!origin(0.5, 0.3).1);
    }
}
