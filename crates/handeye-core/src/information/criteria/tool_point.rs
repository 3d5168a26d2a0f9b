//! What matters at the tool: the predicted standard deviation of points that the user names.

use nalgebra::{DMatrix, Matrix3x6, Matrix6, Vector3};

use super::{Criterion, Gain, Quantity, hand_eye_decrease};
use crate::error::Error;
use crate::information::Belief;
use crate::se3::hat;

/// How several points are summed up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// Root mean square.
    Mean,
    /// The worst point.
    Worst,
}

/// Decrease of the standard deviation, in metres, of points fixed in the camera frame when mapped through `X`.
///
/// `X <- exp(xi) X` moves the image of a camera-frame point `p` by `rho + phi x p` (in camera axes).
#[derive(Clone, Debug)]
pub struct ToolPoint {
    jacobians: Vec<Matrix3x6<f64>>,
    over: Over,
}

impl ToolPoint {
    /// Points in the camera frame, metres.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] without points or with one that is not finite.
    pub fn new(points: &[Vector3<f64>], over: Over) -> Result<Self, Error> {
        if points.is_empty() || points.iter().any(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(Error::invalid("tool points: at least one, all finite"));
        }
        let jacobians = points
            .iter()
            .map(|p| {
                let mut j = Matrix3x6::zeros();
                j.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
                j.fixed_view_mut::<3, 3>(0, 3).copy_from(&-hat(p));
                j
            })
            .collect();
        Ok(Self { jacobians, over })
    }

    /// Standard deviation in metres (of the norm of the displacement) under a covariance of `xi_x`.
    pub fn standard_deviation_m(&self, covariance: &Matrix6<f64>) -> f64 {
        let variances = self.jacobians.iter().map(|j| (j * covariance * j.transpose()).trace());
        match self.over {
            Over::Mean => (variances.sum::<f64>() / self.jacobians.len() as f64).sqrt(),
            Over::Worst => variances.fold(0.0, f64::max).sqrt(),
        }
    }
}

struct Prepared<'a> {
    criterion: &'a ToolPoint,
    belief: &'a Belief,
    before: f64,
}

impl Criterion for ToolPoint {
    fn name(&self) -> &'static str {
        "tool_point"
    }

    fn prepare<'a>(&'a self, belief: &'a Belief) -> Result<Box<dyn Gain + 'a>, Error> {
        let before = self.standard_deviation_m(&belief.hand_eye_covariance());
        Ok(Box::new(Prepared { criterion: self, belief, before }))
    }

    fn quantity(&self) -> Option<Quantity> {
        Some(Quantity::HandEyeCovariance)
    }
}

impl Gain for Prepared<'_> {
    fn gain(&self, factor: &DMatrix<f64>) -> f64 {
        hand_eye_decrease(self.belief.covariance(), factor).map_or(f64::NAN, |d| self.gain_of_decrease(&d))
    }

    fn gain_of_decrease(&self, decrease: &Matrix6<f64>) -> f64 {
        self.before - self.criterion.standard_deviation_m(&(self.belief.hand_eye_covariance() - decrease))
    }
}
