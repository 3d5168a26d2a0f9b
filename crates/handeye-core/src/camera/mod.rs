//! Camera models: from a point in the camera frame to a pixel, with analytic derivatives.
//!
//! The camera frame is OpenCV's: x right, y down, z forward; pixel centres at integers.
//! One file per lens; [`Camera`] holds which lens it is and its parameters.

use nalgebra::{Matrix2x3, SMatrix, Vector2, Vector3};

use crate::error::Error;

/// Most parameters a lens can have (Brown-Conrady with 12 coefficients).
pub const MAX_PARAMETERS: usize = 16;

/// Derivative of a pixel in the camera parameters; columns beyond the lens' count are zero.
pub type ParameterJacobian = SMatrix<f64, 2, MAX_PARAMETERS>;

/// The lens models, parameters in OpenCV's order after `fx, fy, cx, cy`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lens {
    /// No distortion: 4 parameters.
    Pinhole,
    /// Radial-tangential `k1 k2 p1 p2`: 8 parameters.
    BrownConrady4,
    /// `k1 k2 p1 p2 k3`: 9 parameters.
    BrownConrady5,
    /// Rational, `k1 k2 p1 p2 k3 k4 k5 k6`: 12 parameters.
    BrownConrady8,
    /// Rational with thin prism, `... s1 s2 s3 s4`: 16 parameters.
    BrownConrady12,
    /// Equidistant fisheye `k1 k2 k3 k4`: 8 parameters (Kannala-Brandt 2006).
    KannalaBrandt,
}

/// A pixel with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// The pixel.
    pub pixel: Vector2<f64>,
    /// Derivative in the point, camera frame.
    pub d_point: Matrix2x3<f64>,
    /// Derivative in the camera parameters.
    pub d_parameters: ParameterJacobian,
}

/// A camera: a lens and its parameters `fx, fy, cx, cy, distortion...`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Which lens.
    pub lens: Lens,
    /// Its parameters; the first `lens.parameter_count()` count.
    pub parameters: [f64; MAX_PARAMETERS],
}
