//! Errors of the links of an arm whose kinematics are known: every joint sits wrongly on the link before it.
//!
//! The motion of view `k` is truly `exp(L_k l) A_k`: `l` are the twists by which the joints are displaced, the same in
//! every view, `L_k` the arm's Jacobian in them. They are many and each view says little of each, so they are not
//! parameters but integrated out with a Gaussian prior, whose levels (metres for displacements, radians for tilts) are
//! a hypothesis. What they are most likely to be follows from the answer (a best linear unbiased prediction).

use nalgebra::{DMatrix, Matrix6};

use crate::error::Error;

/// How displaced joints move the motions of the views.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkErrors {
    /// `L_k`, `6 x m`, one per view: `A_k <- exp(L_k l) A_k`.
    pub jacobians: Vec<DMatrix<f64>>,
    /// Whether each column is a displacement in metres; otherwise a tilt in radians.
    pub lengths: Vec<bool>,
}

impl LinkErrors {
    /// Number of ways in which the joints may be displaced.
    pub(super) fn coefficients(&self) -> usize {
        self.lengths.len()
    }

    /// Standard deviation of coefficient `i` at these levels.
    pub(super) fn deviation(&self, i: usize, translation_m: f64, rotation_rad: f64) -> f64 {
        if self.lengths[i] { translation_m } else { rotation_rad }
    }

    /// Writes what a standard deviation of each coefficient does to view `k` in the camera frame into 6 rows, and
    /// returns the covariance of what is the view's own: a share of the error's variance.
    pub(super) fn fill(
        &self,
        k: usize,
        left: &Matrix6<f64>,
        levels: (f64, f64),
        own_share: f64,
        rows: &mut DMatrix<f64>,
    ) -> Matrix6<f64> {
        let mut own = Matrix6::zeros();
        for (i, column) in self.jacobians[k].column_iter().enumerate() {
            let moved = left * column * self.deviation(i, levels.0, levels.1);
            own += moved * moved.transpose() * own_share;
            rows.fixed_view_mut::<6, 1>(0, i).copy_from(&(moved * (1.0 - own_share).sqrt()));
        }
        own
    }

    /// # Errors
    /// [`Error::InvalidInput`] for lists that do not fit or values that are not finite.
    pub(super) fn check(&self, views: usize) -> Result<(), Error> {
        let m = self.lengths.len();
        let fits = self.jacobians.len() == views
            && self.jacobians.iter().all(|l| l.shape() == (6, m) && l.iter().all(|x| x.is_finite()));
        if fits {
            return Ok(());
        }
        Err(Error::invalid(format!("link errors: expected {views} finite Jacobians of 6 x {m}")))
    }
}
