//! What each file of a lens provides.

use nalgebra::SMatrix;

use super::distortion::DistortedPoint;

/// Most parameters a lens can have (Brown-Conrady with 12 coefficients).
pub const MAX_PARAMETERS: usize = 16;

/// Derivative of a pixel in the camera parameters; columns beyond the lens' count are zero.
pub type ParameterJacobian = SMatrix<f64, 2, MAX_PARAMETERS>;

/// Parameters of a camera, padded with zeros.
pub(super) type Parameters = [f64; MAX_PARAMETERS];

/// A point of the plane at unit depth.
pub(super) type At = (f64, f64);

/// What a lens is made of: the mapping of the plane at unit depth to itself, in a file of its own.
pub(super) struct Model {
    /// The name in files and messages.
    pub name: &'static str,
    /// Names of the coefficients, in the order of the parameters after `fx, fy, cx, cy`.
    pub coefficients: &'static [&'static str],
    /// Squared radius, before the lens, up to which it is one-to-one.
    pub max_squared_radius: fn(&Parameters) -> f64,
    /// A point after the lens.
    pub distort: fn(&Parameters, f64, f64) -> DistortedPoint<f64>,
    /// Derivative of the point after the lens in the coefficients: columns 4 and on.
    pub differentiate: fn(&Parameters, At, &DistortedPoint<f64>, &mut ParameterJacobian),
    /// The point before the lens; None where there is none within the squared radius.
    pub undistort: fn(&Parameters, f64, At) -> Option<At>,
}
