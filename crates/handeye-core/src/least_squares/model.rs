//! What is believed about the measurements: noise levels, and which parameters are known only roughly.

use nalgebra::{DMatrix, Matrix6, Vector6};

use crate::camera::Camera;
use crate::error::Error;
use crate::se3::Se3;

/// On which side of `A_k` the robot's error acts.
///
/// Eye-in-hand: `A = T_flange_base`, so left is the flange and right the base; eye-to-hand the other way round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// `X exp(eps) A Y`.
    Left,
    /// `X A exp(eps) Y`.
    Right,
}

/// Error of the robot's poses, one zero-mean Gaussian twist per view.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotNoise {
    /// Where the twist acts.
    pub side: Side,
    /// Square roots `L` of the covariance `L L'`: one for all views, or one per view. Rank may be below six.
    pub square_roots: Vec<Matrix6<f64>>,
}

impl RobotNoise {
    /// The same covariance `diag(sigma_t^2, sigma_r^2)` for every view: metres and radians.
    pub fn isotropic(side: Side, sigma_translation_m: f64, sigma_rotation_rad: f64) -> Self {
        let mut root = Matrix6::zeros();
        for i in 0..3 {
            root[(i, i)] = sigma_translation_m;
            root[(i + 3, i + 3)] = sigma_rotation_rad;
        }
        Self { side, square_roots: vec![root] }
    }

    /// Square root of the covariance of view `k`.
    pub fn square_root(&self, k: usize) -> &Matrix6<f64> {
        if self.square_roots.len() == 1 { &self.square_roots[0] } else { &self.square_roots[k] }
    }
}

/// Parameters that act on the pixels directly, known up to a Gaussian prior around their values.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelParameters {
    /// Indices of the free camera parameters, in the lens' order.
    pub camera: Vec<usize>,
    /// Whether the scale of the board is free (last column): points become `(1 + s) P`.
    pub board_scale: bool,
    /// Prior information around the start, square, of `count()` rows; zero rows mean no prior.
    pub prior_information: DMatrix<f64>,
}

impl PixelParameters {
    /// How many parameters there are.
    pub fn count(&self) -> usize {
        self.camera.len() + usize::from(self.board_scale)
    }
}

/// Parameters of the robot's kinematics that move every pose linearly: `A_k <- exp(D_k q) A_k`.
///
/// Joint offsets give `D_k` as the arm's Jacobian in the frame on the left of `A_k`; a time lag gives its velocity.
#[derive(Clone, Debug, PartialEq)]
pub struct KinematicParameters {
    /// `D_k`, `6 x n_q`, one per view.
    pub jacobians: Vec<DMatrix<f64>>,
    /// Prior information around zero, `n_q x n_q`.
    pub prior_information: DMatrix<f64>,
}

impl KinematicParameters {
    /// How many parameters there are.
    pub fn count(&self) -> usize {
        self.prior_information.nrows()
    }
}

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
    pub(super) fn cost(&self, x: &Se3, y: &Se3) -> f64 {
        [(true, x), (false, y)].into_iter().fold(0.0, |sum, (of_x, value)| {
            let (deviation, _, information) = self.term(of_x, value);
            sum + deviation.component_mul(&deviation).dot(&information)
        })
    }

    /// Information and gradient of the twist of `X` (`of_x`) or `Y`.
    pub(super) fn normal(&self, of_x: bool, value: &Se3) -> (Matrix6<f64>, Vector6<f64>) {
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

/// The assumptions of a solve.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Standard deviation of the pixels of each view, px.
    pub pixel_sigma: Vec<f64>,
    /// Error of the robot's poses; `None`: exact, as in the paper.
    pub robot: Option<RobotNoise>,
    /// Free camera parameters and board scale; `None`: exact, as in the paper.
    pub pixel_parameters: Option<PixelParameters>,
    /// Free kinematic parameters; `None`: exact, as in the paper.
    pub kinematic: Option<KinematicParameters>,
    /// Prior of `X` and `Y`; `None`: no belief.
    pub chain_prior: Option<ChainPrior>,
}

impl Model {
    /// The paper's: 12 parameters, everything else exact, one pixel noise for all views.
    pub fn paper(views: usize, pixel_sigma: f64) -> Self {
        Self {
            pixel_sigma: vec![pixel_sigma; views],
            robot: None,
            pixel_parameters: None,
            kinematic: None,
            chain_prior: None,
        }
    }

    /// Number of pixel parameters.
    pub fn pixel_parameter_count(&self) -> usize {
        self.pixel_parameters.as_ref().map_or(0, PixelParameters::count)
    }

    /// Number of kinematic parameters.
    pub fn kinematic_count(&self) -> usize {
        self.kinematic.as_ref().map_or(0, KinematicParameters::count)
    }

    /// Number of global parameters: `xi_x, xi_y`, pixel parameters, kinematic parameters.
    pub fn parameter_count(&self) -> usize {
        12 + self.pixel_parameter_count() + self.kinematic_count()
    }

    /// # Errors
    /// [`Error::InvalidInput`] naming the part that does not fit `views` views and this camera.
    pub(super) fn check(&self, views: usize, camera: &Camera) -> Result<(), Error> {
        if self.pixel_sigma.len() != views {
            return Err(Error::invalid(format!(
                "{} pixel noise levels for {views} views",
                self.pixel_sigma.len()
            )));
        }
        if let Some(k) = self.pixel_sigma.iter().position(|s| !(s.is_finite() && *s > 0.0)) {
            return Err(Error::invalid(format!("pixel noise of view {k} must be positive and finite")));
        }
        if let Some(prior) = &self.chain_prior {
            prior.check()?;
        }
        if let Some(robot) = &self.robot {
            if robot.square_roots.len() != 1 && robot.square_roots.len() != views {
                return Err(Error::invalid(format!(
                    "{} robot covariances for {views} views: give one, or one per view",
                    robot.square_roots.len()
                )));
            }
            if robot.square_roots.iter().any(|m| m.iter().any(|x| !x.is_finite())) {
                return Err(Error::invalid("a robot covariance is not finite"));
            }
        }
        if let Some(pixel) = &self.pixel_parameters {
            let count = camera.lens.parameter_count();
            if let Some(i) = pixel.camera.iter().find(|i| **i >= count) {
                return Err(Error::invalid(format!("camera parameter {i} of a lens with {count}")));
            }
            check_prior(&pixel.prior_information, pixel.count(), "camera prior")?;
        }
        if let Some(kinematic) = &self.kinematic {
            check_prior(&kinematic.prior_information, kinematic.count(), "kinematic prior")?;
            if kinematic.jacobians.len() != views
                || kinematic.jacobians.iter().any(|d| d.shape() != (6, kinematic.count()))
            {
                return Err(Error::invalid(format!(
                    "kinematic Jacobians must be {views} of 6 x {}",
                    kinematic.count()
                )));
            }
        }
        Ok(())
    }
}

fn check_prior(prior: &DMatrix<f64>, count: usize, name: &str) -> Result<(), Error> {
    if prior.shape() != (count, count) || prior.iter().any(|x| !x.is_finite()) {
        return Err(Error::invalid(format!(
            "{name}: expected a finite {count} x {count} information matrix"
        )));
    }
    Ok(())
}
