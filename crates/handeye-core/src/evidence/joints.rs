//! Errors of the joints of an arm whose kinematics are known: encoder noise, and offsets that stay.
//!
//! The joints are truly at `q + dq` where `q` is read, so the motion of the chain is truly `exp(D_k dq) A_k`. An
//! offset is the same `dq` in every view: a parameter. Noise is another one in each: a covariance `D_k Sigma D_k'` on
//! the left of `A_k`.

use nalgebra::{DMatrix, Matrix6};

use crate::error::Error;

/// How errors of the joints move the motions of the views.
#[derive(Clone, Debug, PartialEq)]
pub struct JointErrors {
    /// `D_k`, `6 x n`, one per view: `A_k <- exp(D_k dq) A_k`.
    pub jacobians: Vec<DMatrix<f64>>,
    /// What a level of one radian means for each joint: 1 for one that turns, metres for one that slides.
    pub scales: Vec<f64>,
    /// Joints whose offset is a parameter. Those of the first and of the last joint only say where base and flange
    /// are, and cannot be told from `X` and `Y`.
    pub free: Vec<usize>,
}

impl JointErrors {
    /// Number of offsets that are parameters.
    pub fn offset_count(&self) -> usize {
        self.free.len()
    }

    /// Derivative of the motion of view `k` on the left in the free offsets, `6 x offset_count()`.
    pub(super) fn offset_columns(&self, k: usize) -> DMatrix<f64> {
        self.jacobians[k].select_columns(&self.free)
    }

    /// Covariance of the motion of view `k` on the left, at noise of one radian per joint.
    pub(super) fn unit_covariance(&self, k: usize) -> Matrix6<f64> {
        let mut covariance = Matrix6::zeros();
        for (column, scale) in self.jacobians[k].column_iter().zip(&self.scales) {
            covariance += column * column.transpose() * (scale * scale);
        }
        covariance
    }

    /// # Errors
    /// [`Error::InvalidInput`] for lists that do not fit or values that are not finite.
    pub(super) fn check(&self, views: usize) -> Result<(), Error> {
        let n = self.scales.len();
        let fits = self.jacobians.len() == views
            && self.jacobians.iter().all(|d| d.shape() == (6, n) && d.iter().all(|x| x.is_finite()))
            && self.scales.iter().all(|s| *s > 0.0 && s.is_finite())
            && self.free.iter().all(|i| *i < n);
        if fits {
            return Ok(());
        }
        Err(Error::invalid(format!(
            "joint errors: expected {views} finite Jacobians of 6 x {n}, {n} positive scales, free joints below {n}"
        )))
    }
}
