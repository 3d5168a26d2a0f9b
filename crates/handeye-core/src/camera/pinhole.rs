//! No distortion.

use super::distortion::DistortedPoint;
use super::lens_model::Model;
use super::region::MAX_SQUARED_RADIUS;
use crate::simd::Scalar;

pub(super) const MODEL: Model = Model {
    name: "pinhole",
    coefficients: &[],
    max_squared_radius: |_| MAX_SQUARED_RADIUS,
    distort: |_, x, y| DistortedPoint::unchanged(Scalar, x, y),
    differentiate: |_, _, _, _| {},
    undistort: |_, _, at| Some(at),
};
