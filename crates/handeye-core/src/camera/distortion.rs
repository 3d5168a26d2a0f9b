//! A point after the lens, with the derivatives of the lens there: a single one, or one in each lane.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::Matrix2;

use crate::simd::{Simd, Vector};

/// A point of the plane at unit depth after the lens, and the derivatives `[along_x, cross_x; cross_y, along_y]` in the
/// point before it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DistortedPoint<V> {
    pub x: V,
    pub y: V,
    pub along_x: V,
    pub cross_x: V,
    pub cross_y: V,
    pub along_y: V,
    /// Of the point before the lens, from the axis.
    pub squared_radius: V,
    /// `N / D` and `1 / D` of Brown and Conrady's lens.
    pub radial: V,
    pub inverse_denominator: V,
}

impl<V: Vector> DistortedPoint<V> {
    /// A point that the lens leaves where it is.
    #[inline(always)]
    pub fn unchanged<S: Simd<Vector = V>>(simd: S, x: V, y: V) -> Self {
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        Self {
            x,
            y,
            along_x: one,
            cross_x: zero,
            cross_y: zero,
            along_y: one,
            squared_radius: x.mul_add(x, y * y),
            radial: one,
            inverse_denominator: one,
        }
    }

    /// Whether a point in front of the camera is where the lens is one-to-one.
    #[inline(always)]
    pub fn is_valid<S: Simd<Vector = V>>(&self, simd: S, max_squared_radius: f64) -> V::Mask {
        let determinant = self.cross_y.neg_mul_add(self.cross_x, self.along_x * self.along_y);
        simd.splat(max_squared_radius).at_least(self.squared_radius) & determinant.greater(simd.splat(0.0))
    }
}

impl DistortedPoint<f64> {
    /// A point that the lens moves along its radius, by a scale of slope `2 d scale / d r^2`.
    #[inline]
    pub fn along_radius(x: f64, y: f64, scale: f64, slope: f64) -> Self {
        let cross = slope * x * y;
        Self {
            x: x * scale,
            y: y * scale,
            along_x: scale + slope * x * x,
            cross_x: cross,
            cross_y: cross,
            along_y: scale + slope * y * y,
            squared_radius: x * x + y * y,
            radial: scale,
            inverse_denominator: 1.0,
        }
    }

    /// `[[dx'/dx, dx'/dy], [dy'/dx, dy'/dy]]`.
    #[inline]
    pub fn jacobian(&self) -> Matrix2<f64> {
        Matrix2::new(self.along_x, self.cross_x, self.cross_y, self.along_y)
    }

    /// Determinant of the Jacobian.
    #[inline]
    pub fn determinant(&self) -> f64 {
        self.along_x * self.along_y - self.cross_x * self.cross_y
    }
}
