//! What matters at the work: the predicted deviation of anything that follows linearly from all parameters.

use nalgebra::DMatrix;

use super::{Criterion, Gain, update_factor};
use crate::error::Error;
use crate::information::Belief;

/// Decrease of the root mean variance of tasks, each a few rows over all parameters: `sqrt(mean tr(J S J'))`.
#[derive(Clone, Debug)]
pub struct Task {
    rows: DMatrix<f64>,
    count: usize,
}

impl Task {
    /// Rows of all tasks, one under the other, and how many tasks there are.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] without rows, or with one that is not finite.
    pub fn new(rows: DMatrix<f64>, count: usize) -> Result<Self, Error> {
        if rows.is_empty() || count == 0 || rows.iter().any(|x| !x.is_finite()) {
            return Err(Error::invalid("task: at least one row, all finite"));
        }
        Ok(Self { rows, count })
    }
}

struct Prepared<'a> {
    belief: &'a Belief,
    /// `J S`.
    spread: DMatrix<f64>,
    before: f64,
    count: f64,
}

impl Criterion for Task {
    fn name(&self) -> &'static str {
        "task"
    }

    fn prepare<'a>(&'a self, belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error> {
        let covariance = belief.covariance();
        if self.rows.ncols() != covariance.ncols() {
            return Err(Error::invalid(format!(
                "task: {} columns, {} parameters",
                self.rows.ncols(),
                covariance.ncols()
            )));
        }
        let spread = &self.rows * covariance;
        let before = spread.dot(&self.rows) / self.count as f64;
        Ok(Box::new(Prepared { belief, spread, before, count: self.count as f64 }))
    }
}

impl Gain for Prepared<'_> {
    fn gain(&self, factor: &DMatrix<f64>) -> f64 {
        // With G = J S F and C C' = I + F' S F the variances fall by |G C'^-1|^2.
        let Some(update) = update_factor(self.belief.covariance(), factor) else { return f64::NAN };
        let mut known = (&self.spread * factor).transpose();
        update.l_dirty().solve_lower_triangular_mut(&mut known);
        let after = self.before - known.norm_squared() / self.count;
        self.before.sqrt() - after.max(0.0).sqrt()
    }
}
