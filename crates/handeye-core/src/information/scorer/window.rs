//! What of the image counts, in the plane at unit depth.

use crate::camera::DistortedPoint;
use crate::simd::{Simd, Vector};

/// The part of the plane, after the lens, whose points count as seen.
#[derive(Clone, Copy)]
pub(super) struct Window {
    /// Squared ratio of the focal lengths, `(f_y / f_x)^2`.
    pub squared_aspect: f64,
    /// Lowest and highest x and y.
    pub x: [f64; 2],
    pub y: [f64; 2],
    /// Largest squared distance from the axis before the lens.
    pub max_squared_radius: f64,
}

impl Window {
    /// Whether it has no edges.
    pub fn is_everything(&self) -> bool {
        self.x == [f64::NEG_INFINITY, f64::INFINITY] && self.y == [f64::NEG_INFINITY, f64::INFINITY]
    }

    /// Whether a point in front of the camera is where the lens is one-to-one, and inside the edges.
    #[inline(always)]
    pub fn shows<S: Simd>(&self, simd: S, point: &DistortedPoint<S::Vector>) -> <S::Vector as Vector>::Mask {
        point.is_valid(simd, self.max_squared_radius)
            & point.x.at_least(simd.splat(self.x[0]))
            & simd.splat(self.x[1]).at_least(point.x)
            & point.y.at_least(simd.splat(self.y[0]))
            & simd.splat(self.y[1]).at_least(point.y)
    }
}
