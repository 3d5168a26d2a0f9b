//! Lenses and what of the image counts, in the plane at unit depth.

use crate::camera::MAX_PARAMETERS;
use crate::simd::{Simd, Vector};

/// The part of the plane, after the lens, whose points count as seen.
#[derive(Clone, Copy)]
pub(crate) struct Window {
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
}

/// A point after the lens and the derivatives `[along_x, cross_x; cross_y, along_y]`.
pub(crate) struct DistortedPoint<V> {
    pub x: V,
    pub y: V,
    pub along_x: V,
    pub cross_x: V,
    pub cross_y: V,
    pub along_y: V,
    /// Of the point before the lens, from the axis.
    pub squared_radius: V,
    /// `N / D` and `1 / D`.
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

    /// Whether it is in the window as well.
    #[inline(always)]
    pub fn in_sight<S: Simd<Vector = V>>(&self, simd: S, window: &Window) -> V::Mask {
        self.is_valid(simd, window.max_squared_radius)
            & self.x.at_least(simd.splat(window.x[0]))
            & simd.splat(window.x[1]).at_least(self.x)
            & self.y.at_least(simd.splat(window.y[0]))
            & simd.splat(window.y[1]).at_least(self.y)
    }
}

/// As `camera::brown_conrady::distort`.
#[inline(always)]
pub(crate) fn distort<S: Simd, const RATIONAL: bool, const PRISM: bool>(
    simd: S,
    p: &[f64; MAX_PARAMETERS],
    x: S::Vector,
    y: S::Vector,
) -> DistortedPoint<S::Vector> {
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    let (mut radial, mut twice_slope) = cubic(simd, [p[4], p[5], p[8]], s);
    let mut inverse_denominator = simd.splat(1.0);
    if RATIONAL {
        let (denominator, twice_rise) = cubic(simd, [p[9], p[10], p[11]], s);
        inverse_denominator = inverse_denominator / denominator;
        radial = radial * inverse_denominator;
        twice_slope = radial.neg_mul_add(twice_rise, twice_slope) * inverse_denominator;
    }
    let (p1, p2) = (simd.splat(2.0 * p[6]), simd.splat(2.0 * p[7]));
    let (half_p1, half_p2) = (simd.splat(p[6]), simd.splat(p[7]));
    let cross = xy.mul_add(twice_slope, p1.mul_add(x, p2 * y));
    let two = simd.splat(2.0);
    let mut distorted = DistortedPoint {
        x: x.mul_add(radial, p1.mul_add(xy, half_p2 * two.mul_add(xx, s))),
        y: y.mul_add(radial, p2.mul_add(xy, half_p1 * two.mul_add(yy, s))),
        along_x: xx.mul_add(twice_slope, p1.mul_add(y, simd.splat(6.0 * p[7]).mul_add(x, radial))),
        cross_x: cross,
        cross_y: cross,
        along_y: yy.mul_add(twice_slope, p2.mul_add(x, simd.splat(6.0 * p[6]).mul_add(y, radial))),
        squared_radius: s,
        radial,
        inverse_denominator,
    };
    if PRISM {
        let (s1, s2, s3, s4) = (p[12], p[13], p[14], p[15]);
        distorted.x = simd.splat(s2).mul_add(s, simd.splat(s1)).mul_add(s, distorted.x);
        distorted.y = simd.splat(s4).mul_add(s, simd.splat(s3)).mul_add(s, distorted.y);
        let along_x = simd.splat(4.0 * s2).mul_add(s, simd.splat(2.0 * s1));
        let along_y = simd.splat(4.0 * s4).mul_add(s, simd.splat(2.0 * s3));
        distorted.along_x = along_x.mul_add(x, distorted.along_x);
        distorted.cross_x = along_x.mul_add(y, distorted.cross_x);
        distorted.cross_y = along_y.mul_add(x, distorted.cross_y);
        distorted.along_y = along_y.mul_add(y, distorted.along_y);
    }
    distorted
}

/// `1 + c1 s + c2 s^2 + c3 s^3` and twice its derivative.
#[inline(always)]
fn cubic<S: Simd>(simd: S, c: [f64; 3], s: S::Vector) -> (S::Vector, S::Vector) {
    let value = simd.splat(c[2]).mul_add(s, simd.splat(c[1])).mul_add(s, simd.splat(c[0]));
    let slope = simd.splat(6.0 * c[2]).mul_add(s, simd.splat(4.0 * c[1])).mul_add(s, simd.splat(2.0 * c[0]));
    (value.mul_add(s, simd.splat(1.0)), slope)
}
