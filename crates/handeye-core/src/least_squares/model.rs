//! What is believed about the measurements: pixel noise, and where `X` and `Y` may be.

use nalgebra::{Matrix6, Vector6};

use crate::error::Error;
use crate::se3::Se3;

/// What is believed of `X` and `Y` beforehand: independent Gaussian twists around a mean.
///
/// A weak one (a metre, a radian) keeps views that do not determine the answer yet from running away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainPrior {
    /// Mean of `X`.
    pub x: Se3,
    /// Mean of `Y`.
    pub y: Se3,
    /// Standard deviations of the twist of `X`, metres and radians; infinite for no belief.
    pub sigma_x: Vector6<f64>,
    /// Standard deviations of the twist of `Y`.
    pub sigma_y: Vector6<f64>,
}

impl ChainPrior {
    /// Deviation, its Jacobian in the perturbation, and the information of `X` (`of_x`) or `Y`.
    fn term(&self, of_x: bool, value: &Se3) -> (Vector6<f64>, Matrix6<f64>, Vector6<f64>) {
        let (mean, sigma) = if of_x { (&self.x, &self.sigma_x) } else { (&self.y, &self.sigma_y) };
        let deviation = (*value * mean.inverse()).log();
        let information = sigma.map(|s| if s.is_finite() { 1.0 / (s * s) } else { 0.0 });
        (deviation, Se3::left_jacobian_inverse(&deviation), information)
    }

    /// Sum of squared whitened deviations of `X` and `Y`.
    fn cost(&self, x: &Se3, y: &Se3) -> f64 {
        [(true, x), (false, y)].into_iter().fold(0.0, |sum, (of_x, value)| {
            let (deviation, _, information) = self.term(of_x, value);
            sum + deviation.component_mul(&deviation).dot(&information)
        })
    }

    /// Information and gradient of the twist of `X` (`of_x`) or `Y`.
    fn normal(&self, of_x: bool, value: &Se3) -> (Matrix6<f64>, Vector6<f64>) {
        let (deviation, jacobian, information) = self.term(of_x, value);
        let weighted = jacobian.transpose() * Matrix6::from_diagonal(&information);
        (weighted * jacobian, weighted * deviation)
    }

    fn check(&self) -> Result<(), Error> {
        if self.sigma_x.iter().chain(self.sigma_y.iter()).all(|s| *s > 0.0) {
            Ok(())
        } else {
            Err(Error::invalid("standard deviations of the prior of X and Y must be positive"))
        }
    }
}

/// The assumptions of a solve: robot and camera exact, as in the paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Standard deviation of the pixels of each view, px.
    pub pixel_sigma: Vec<f64>,
    /// Prior of `X` and `Y`; `None`: no belief.
    pub chain_prior: Option<ChainPrior>,
}

impl Model {
    /// The paper's: one pixel noise for all views, and no belief.
    pub fn paper(views: usize, pixel_sigma: f64) -> Self {
        Self { pixel_sigma: vec![pixel_sigma; views], chain_prior: None }
    }

    /// What the prior adds to the cost.
    pub(super) fn prior_cost(&self, x: &Se3, y: &Se3) -> f64 {
        self.chain_prior.as_ref().map_or(0.0, |prior| prior.cost(x, y))
    }

    /// What the prior adds to the normal equations of `[xi_x; xi_y]`: where, information and gradient.
    pub(super) fn prior_terms(
        &self,
        x: &Se3,
        y: &Se3,
    ) -> impl Iterator<Item = (usize, (Matrix6<f64>, Vector6<f64>))> {
        let terms = self.chain_prior.as_ref().map(|p| [(0, p.normal(true, x)), (6, p.normal(false, y))]);
        terms.into_iter().flatten()
    }

    /// # Errors
    /// [`Error::InvalidInput`] naming the part that does not fit `views` views.
    pub(super) fn check(&self, views: usize) -> Result<(), Error> {
        if self.pixel_sigma.len() != views {
            return Err(Error::invalid(format!(
                "{} pixel noise levels for {views} views",
                self.pixel_sigma.len()
            )));
        }
        if let Some(k) = self.pixel_sigma.iter().position(|s| !(s.is_finite() && *s > 0.0)) {
            return Err(Error::invalid(format!("pixel noise of view {k} must be positive and finite")));
        }
        self.chain_prior.as_ref().map_or(Ok(()), ChainPrior::check)
    }
}
