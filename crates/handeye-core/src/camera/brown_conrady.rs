//! Brown-Conrady distortion with 4, 5, 8 or 12 coefficients, as OpenCV states it.
//!
//! Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32(3), 1966; the rational and the thin
//! prism terms as in OpenCV's documentation of `projectPoints`. With `s = x^2 + y^2`,
//! `N = 1 + k1 s + k2 s^2 + k3 s^3` and `D = 1 + k4 s + k5 s^2 + k6 s^3`:
//!
//! ```text
//! x' = x N/D + 2 p1 x y + p2 (s + 2 x^2) + s1 s + s2 s^2
//! y' = y N/D + p1 (s + 2 y^2) + 2 p2 x y + s3 s + s4 s^2
//! ```

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use super::distortion::DistortedPoint;
use super::lens_model::{Model, ParameterJacobian, Parameters};
use super::region::{self, MAX_SQUARED_RADIUS};
use crate::simd::{Scalar, Simd, Vector};

pub(super) const MODEL_4: Model = Model {
    name: "brown_conrady_4",
    coefficients: &["k1", "k2", "p1", "p2"],
    max_squared_radius,
    distort: |p, x, y| distort::<_, false, false>(Scalar, p, x, y),
    differentiate: |_, at, lens, out| differentiate(8, at, lens, out),
    undistort,
};
pub(super) const MODEL_5: Model = Model {
    name: "brown_conrady_5",
    coefficients: &["k1", "k2", "p1", "p2", "k3"],
    differentiate: |_, at, lens, out| differentiate(9, at, lens, out),
    ..MODEL_4
};
pub(super) const MODEL_8: Model = Model {
    name: "brown_conrady_8",
    coefficients: &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
    distort: |p, x, y| distort::<_, true, false>(Scalar, p, x, y),
    differentiate: |_, at, lens, out| differentiate(12, at, lens, out),
    ..MODEL_4
};
pub(super) const MODEL_12: Model = Model {
    name: "brown_conrady_12",
    coefficients: &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"],
    distort: |p, x, y| distort::<_, true, true>(Scalar, p, x, y),
    differentiate: |_, at, lens, out| differentiate(16, at, lens, out),
    ..MODEL_4
};

fn differentiate(
    parameters: usize,
    (x, y): (f64, f64),
    lens: &DistortedPoint<f64>,
    out: &mut ParameterJacobian,
) {
    for i in 4..parameters {
        (out[(0, i)], out[(1, i)]) = coefficient_derivative(Scalar, i, x, y, lens);
    }
}

fn undistort(p: &Parameters, max_squared_radius: f64, at: (f64, f64)) -> Option<(f64, f64)> {
    let start = undistort_radially(p, max_squared_radius, at.0, at.1);
    region::undistort(start, at, |x, y| {
        // Coefficients that a lens does not have are zero.
        let lens = distort::<_, true, true>(Scalar, p, x, y);
        (x * x + y * y <= max_squared_radius && lens.determinant() > 0.0).then_some(lens)
    })
}

/// Coefficients of the numerator `N` and denominator `D`, lowest power first.
#[inline]
fn fraction(p: &Parameters) -> ([f64; 4], [f64; 4]) {
    ([1.0, p[4], p[5], p[8]], [1.0, p[9], p[10], p[11]])
}

/// The point after the lens; `RATIONAL` and `PRISM` say whether `k4..k6` and `s1..s4` can differ from zero.
#[inline(always)]
pub(crate) fn distort<S: Simd, const RATIONAL: bool, const PRISM: bool>(
    simd: S,
    p: &Parameters,
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

/// Derivative of the point after the lens in a distortion coefficient, by its place among the parameters.
#[inline(always)]
pub(crate) fn coefficient_derivative<S: Simd>(
    simd: S,
    parameter: usize,
    x: S::Vector,
    y: S::Vector,
    distorted: &DistortedPoint<S::Vector>,
) -> (S::Vector, S::Vector) {
    let zero = simd.splat(0.0);
    let two = simd.splat(2.0);
    let s = distorted.squared_radius;
    let radial = match parameter {
        4 => distorted.inverse_denominator * s,
        5 => distorted.inverse_denominator * s * s,
        8 => distorted.inverse_denominator * s * s * s,
        9 => -(distorted.radial * distorted.inverse_denominator * s),
        10 => -(distorted.radial * distorted.inverse_denominator * s * s),
        11 => -(distorted.radial * distorted.inverse_denominator * s * s * s),
        6 => return (two * x * y, (two * y).mul_add(y, s)),
        7 => return ((two * x).mul_add(x, s), two * x * y),
        12 => return (s, zero),
        13 => return (s * s, zero),
        14 => return (zero, s),
        _ => return (zero, s * s),
    };
    (x * radial, y * radial)
}

/// Squared radius of a disc on which the lens is one-to-one.
///
/// The radial mapping `r N/D` rises up to the first root of `N D + 2 s (N' D - N D')`, where `D` is positive. The
/// Jacobian of the radial part is symmetric with eigenvalues `N/D` across and `d/dr (r N/D)` along the radius; those
/// of decentring and prism have a spectral norm of at most `r (6 |(p1, p2)| + 2 |(s1, s3)| + 4 s |(s2, s4)|)`. Where
/// that stays below both eigenvalues the sum is positive definite, and a map whose Jacobian is so on a convex region
/// is one-to-one there.
fn max_squared_radius(p: &Parameters) -> f64 {
    let (n, d) = fraction(p);
    let mut rising = [0.0; 7];
    for (i, a) in n.iter().enumerate() {
        for (j, b) in d.iter().enumerate() {
            rising[i + j] += a * b * (1.0 + 2.0 * (i as f64 - j as f64));
        }
    }
    let fold = region::first_root(&rising, MAX_SQUARED_RADIUS);
    let pole = region::first_root(&d, MAX_SQUARED_RADIUS);
    let radial = fold.min(pole);
    let first = 6.0 * p[6].hypot(p[7]) + 2.0 * p[12].hypot(p[14]);
    let third = 4.0 * p[13].hypot(p[15]);
    if first == 0.0 && third == 0.0 {
        return radial;
    }
    let margin = |r: f64| {
        let (across, along) = radial_factors(&n, &d, r * r);
        across.min(along) - r * (first + r * r * third)
    };
    region::first_nonpositive(radial.sqrt(), margin).powi(2)
}

/// `N/D` and `d/dr (r N/D)` at a squared radius: how much the radial part stretches across and along the radius.
fn radial_factors(n: &[f64; 4], d: &[f64; 4], s: f64) -> (f64, f64) {
    let denominator = region::value(d, s);
    let across = region::value(n, s) / denominator;
    let slope = (region::derivative(n, s) - across * region::derivative(d, s)) / denominator;
    (across, across + 2.0 * s * slope)
}

/// The point before the lens if it were purely radial: the start for Newton's method.
fn undistort_radially(p: &Parameters, max_squared_radius: f64, u: f64, v: f64) -> (f64, f64) {
    let target = u.hypot(v);
    if target == 0.0 {
        return (0.0, 0.0);
    }
    let (n, d) = fraction(p);
    let radius = region::rising_root(target, max_squared_radius.sqrt(), |r| {
        let (across, along) = radial_factors(&n, &d, r * r);
        (r * across, along)
    });
    (u * radius / target, v * radius / target)
}
