//! One view as a pose: what its image says of `T_camera_target`, and how that depends on the camera.

use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX};

use super::pixel_field::{SlowResiduals, quadratic};
use crate::camera::Camera;
use crate::error::Error;
use crate::least_squares::{PixelParameters, Problem, ViewBlock};
use crate::se3::Se3;

/// A view reduced to the pose that fits its image best.
///
/// With free camera parameters the pose is `exp(-sensitivity dc) pose`, and the residual it leaves still says
/// something of `dc`: information `camera_information` and gradient `camera_gradient`, at a pixel noise of 1 px.
#[derive(Clone, Debug)]
pub struct PoseMeasurement {
    /// `A` of the chain.
    pub motion: Se3,
    /// `T_camera_target` of the image alone.
    pub pose: Se3,
    /// Covariance of the pose's left perturbation at 1 px.
    pub covariance: Matrix6<f64>,
    /// Derivative of the pose's twist in the camera parameters, negated: `6 x n_c`.
    pub sensitivity: Matrix6xX<f64>,
    /// Information about the camera parameters that the pose does not absorb, at 1 px: `n_c x n_c`.
    pub camera_information: DMatrix<f64>,
    /// Its gradient `C' (u - pi)`, at 1 px.
    pub camera_gradient: DVector<f64>,
    /// Variance of the pixels estimated from the residual, px^2.
    pub variance_px2: f64,
    /// Degrees of freedom behind that variance.
    pub degrees_of_freedom: f64,
    /// The slow part of the residual.
    pub slow: SlowResiduals,
    /// Whether somebody else's detector measured it, whose error has levels of its own.
    pub is_foreign: bool,
}

impl PoseMeasurement {
    /// A pose without pixels, as somebody else's detector states it: `covariance` is that of its left perturbation.
    pub fn stated(motion: Se3, pose: Se3, covariance: Matrix6<f64>) -> Self {
        Self {
            motion,
            pose,
            covariance,
            sensitivity: Matrix6xX::zeros(0),
            camera_information: DMatrix::zeros(0, 0),
            camera_gradient: DVector::zeros(0),
            variance_px2: 1.0,
            degrees_of_freedom: 0.0,
            slow: SlowResiduals::default(),
            is_foreign: true,
        }
    }
}

/// Weights of the points of a view by their deviations, of mean one: what they say of each other, not of the view.
pub fn relative_weights(sigmas_px: &[f64]) -> Vec<f64> {
    let mean = sigmas_px.iter().map(|s| s.powi(-2)).sum::<f64>() / sigmas_px.len() as f64;
    sigmas_px.iter().map(|s| s.powi(-2) / mean).collect()
}

/// Compresses a view at the pose that fits its image; where points are weighted, at the pose that fits them so.
///
/// # Errors
/// [`Error::Numerical`] if a point is out of sight at the pose, [`Error::Degenerate`] if its points determine none.
pub fn compress(
    problem: &Problem,
    k: usize,
    camera: &Camera,
    pose: &Se3,
    parameters: Option<&PixelParameters>,
    weights: Option<&[f64]>,
) -> Result<PoseMeasurement, Error> {
    let block_at = |pose: &Se3, parameters| {
        quadratic(problem, k, camera, pose, parameters, weights).ok_or_else(|| {
            Error::numerical(format!("view {k}: a point is out of sight at the pose of its own image"))
        })
    };
    let inverse = |block: &ViewBlock| {
        let factor = block.m.cholesky().ok_or_else(|| {
            Error::degenerate(format!("view {k}: its points do not determine the target's pose"))
        })?;
        Ok::<_, Error>(factor.inverse())
    };
    let mut pose = *pose;
    if weights.is_some() {
        // The pose fits points that weigh alike; from there one step of Newton's is within rounding of the other.
        let (block, _) = block_at(&pose, None)?;
        pose = Se3::exp(&-(inverse(&block)? * block.g)) * pose;
    }
    let (block, slow) = block_at(&pose, parameters)?;
    let covariance = inverse(&block)?;
    let (sensitivity, camera_information, camera_gradient) = match &block.columns {
        None => (Matrix6xX::zeros(0), DMatrix::zeros(0, 0), DVector::zeros(0)),
        Some(c) => {
            let sensitivity = covariance * &c.mc;
            let information = &c.cc - c.mc.tr_mul(&sensitivity);
            // The gradient of the cost in the parameters at the best pose, as a step towards less cost.
            let gradient = -(&c.gc - sensitivity.tr_mul(&block.g));
            (sensitivity, information, gradient)
        }
    };
    let degrees_of_freedom = (2 * problem.point_count(k)) as f64 - 6.0;
    Ok(PoseMeasurement {
        motion: *problem.motion(k),
        pose,
        covariance,
        sensitivity,
        camera_information,
        camera_gradient,
        variance_px2: block.squared_px / degrees_of_freedom.max(1.0),
        degrees_of_freedom,
        slow,
        is_foreign: false,
    })
}

/// Pixel variance of each view, shrunk towards the median of all with `prior_degrees` of freedom.
///
/// Corner noise differs severalfold between views (small, oblique, cluttered); a view's own residual says by how
/// much, and the others keep a view with few points from fooling itself. Never below `floor_px2`.
pub fn shrunk_variances(views: &[&PoseMeasurement], prior_degrees: f64, floor_px2: f64) -> Vec<f64> {
    let mut sorted: Vec<f64> = views.iter().map(|v| v.variance_px2).collect();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    if n == 0 {
        return Vec::new();
    }
    let median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
    views
        .iter()
        .map(|v| {
            let degrees = v.degrees_of_freedom.max(0.0);
            ((degrees * v.variance_px2 + prior_degrees * median) / (degrees + prior_degrees)).max(floor_px2)
        })
        .collect()
}
