//! `X` and `Y` from poses alone, from anywhere: many starts, a weak prior, Levenberg-Marquardt on twists.
//!
//! Three views at random are often degenerate (equal orientations); a plan must survive them. A weak prior keeps
//! what they leave open near where a camera can be, and a start on each of the 24 rotations that map axes to axes
//! finds the basin where the closed forms refuse.

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

use super::descent::{Poses, Run};
use crate::closed_form;
use crate::error::Error;
use crate::se3::{Se3, hat, nearest_rotation};

type Matrix12 = SMatrix<f64, 12, 12>;
type Vector12 = SVector<f64, 12>;

/// What is believed of `X` and `Y` before any view: only enough to keep the information regular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeakPrior {
    /// Mean of the translation of `X`, metres.
    pub x_translation_m: Vector3<f64>,
    /// Its standard deviation per axis.
    pub x_translation_sigma_m: f64,
    /// Standard deviation of rotations about the present estimate, radians.
    pub rotation_sigma_rad: f64,
    /// Standard deviation of the translation of `Y` about the present estimate, metres.
    pub y_translation_sigma_m: f64,
}

impl Default for WeakPrior {
    fn default() -> Self {
        Self {
            x_translation_m: Vector3::zeros(),
            x_translation_sigma_m: 1.0,
            rotation_sigma_rad: 3.0,
            y_translation_sigma_m: 10.0,
        }
    }
}

impl WeakPrior {
    /// Information and right-hand side of a twist of `X` at the present `X`.
    pub(super) fn of_x(&self, x: &Se3) -> (Matrix6<f64>, Vector6<f64>) {
        let (information, right) = self.normal(x);
        (information.fixed_view::<6, 6>(0, 0).into_owned(), right.fixed_rows::<6>(0).into_owned())
    }

    /// Information of a twist of `Y`.
    pub(super) fn of_y(&self) -> Matrix6<f64> {
        let (translation, rotation) = (self.y_translation_sigma_m.powi(-2), self.rotation_sigma_rad.powi(-2));
        Matrix6::from_diagonal(&Vector6::new(
            translation,
            translation,
            translation,
            rotation,
            rotation,
            rotation,
        ))
    }
    /// Information and right-hand side of a twist of `X` and `Y` at the present `X`.
    pub(crate) fn normal(&self, x: &Se3) -> (Matrix12, Vector12) {
        let mut jacobian = SMatrix::<f64, 3, 6>::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-hat(&x.translation));
        let weight = self.x_translation_sigma_m.powi(-2);
        let mut information = Matrix12::zeros();
        information.fixed_view_mut::<6, 6>(0, 0).copy_from(&(jacobian.transpose() * jacobian * weight));
        for i in 3..6 {
            information[(i, i)] += self.rotation_sigma_rad.powi(-2);
            information[(i + 6, i + 6)] += self.rotation_sigma_rad.powi(-2);
            information[(i + 3, i + 3)] += self.y_translation_sigma_m.powi(-2);
        }
        let mut right = Vector12::zeros();
        let pull = jacobian.transpose() * (self.x_translation_m - x.translation) * weight;
        right.fixed_rows_mut::<6>(0).copy_from(&pull);
        (information, right)
    }
}

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
    for method in [closed_form::Method::Shah, closed_form::Method::ParkMartin] {
        if let Ok(estimate) = closed_form::solve(method, motions, poses) {
            starts.push(Run::new(estimate.x, estimate.y, method.name()));
        }
    }
    for rotation in axis_rotations() {
        let (x, y) = with_rotation(&rotation, motions, poses, prior);
        starts.push(Run::new(x, y, "axes"));
    }
    let poses = Poses::new(motions, poses, &weights, prior);
    poses.descend(&mut starts, FIRST_STEPS);
    starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    starts.truncate(SURVIVORS);
    poses.descend(&mut starts, LAST_STEPS);
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
