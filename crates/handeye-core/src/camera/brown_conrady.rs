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

use nalgebra::Matrix2;

use super::region::{self, MAX_SQUARED_RADIUS};
use super::{DistortedPoint, MAX_PARAMETERS, ParameterJacobian};

type Parameters = [f64; MAX_PARAMETERS];

/// Coefficients of the numerator `N` and denominator `D`, lowest power first.
#[inline]
fn fraction(p: &Parameters) -> ([f64; 4], [f64; 4]) {
    ([1.0, p[4], p[5], p[8]], [1.0, p[9], p[10], p[11]])
}

/// The point after the lens; `RATIONAL` and `PRISM` say whether `k4..k6` and `s1..s4` can differ from zero.
#[inline]
pub(super) fn distort<const RATIONAL: bool, const PRISM: bool>(
    p: &Parameters,
    x: f64,
    y: f64,
) -> DistortedPoint {
    let (k1, k2, p1, p2, k3) = (p[4], p[5], p[6], p[7], p[8]);
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    let mut radial = 1.0 + s * (k1 + s * (k2 + s * k3));
    let mut slope = k1 + s * (2.0 * k2 + 3.0 * s * k3);
    if RATIONAL {
        let (k4, k5, k6) = (p[9], p[10], p[11]);
        let inverse = 1.0 / (1.0 + s * (k4 + s * (k5 + s * k6)));
        radial *= inverse;
        slope = (slope - radial * (k4 + s * (2.0 * k5 + 3.0 * s * k6))) * inverse;
    }
    let cross = 2.0 * (xy * slope + p1 * x + p2 * y);
    let mut distorted = DistortedPoint {
        x: x * radial + 2.0 * p1 * xy + p2 * (s + 2.0 * xx),
        y: y * radial + p1 * (s + 2.0 * yy) + 2.0 * p2 * xy,
        jacobian: Matrix2::new(
            radial + 2.0 * (xx * slope + p1 * y) + 6.0 * p2 * x,
            cross,
            cross,
            radial + 2.0 * (yy * slope + p2 * x) + 6.0 * p1 * y,
        ),
    };
    if PRISM {
        let (s1, s2, s3, s4) = (p[12], p[13], p[14], p[15]);
        distorted.x += s * (s1 + s * s2);
        distorted.y += s * (s3 + s * s4);
        let (along_x, along_y) = (2.0 * (s1 + 2.0 * s * s2), 2.0 * (s3 + 2.0 * s * s4));
        distorted.jacobian += Matrix2::new(along_x * x, along_x * y, along_y * x, along_y * y);
    }
    distorted
}

/// Derivative of the point after the lens in the coefficients: columns 4 to `COUNT` of `out`.
#[inline]
pub(super) fn coefficients<const COUNT: usize>(p: &Parameters, x: f64, y: f64, out: &mut ParameterJacobian) {
    let s = x * x + y * y;
    let mut set = |column: usize, dx: f64, dy: f64| {
        out[(0, column)] = dx;
        out[(1, column)] = dy;
    };
    let mut weight = 1.0;
    if COUNT >= 12 {
        let (n, d) = fraction(p);
        weight = 1.0 / region::value(&d, s);
        let radial = region::value(&n, s) * weight;
        let mut power = -radial * weight;
        for column in 9..12 {
            power *= s;
            set(column, x * power, y * power);
        }
    }
    let (first, second, third) = (weight * s, weight * s * s, weight * s * s * s);
    set(4, x * first, y * first);
    set(5, x * second, y * second);
    set(6, 2.0 * x * y, s + 2.0 * y * y);
    set(7, s + 2.0 * x * x, 2.0 * x * y);
    if COUNT >= 9 {
        set(8, x * third, y * third);
    }
    if COUNT >= 16 {
        set(12, s, 0.0);
        set(13, s * s, 0.0);
        set(14, 0.0, s);
        set(15, 0.0, s * s);
    }
}

/// Squared radius of a disc on which the lens is one-to-one.
///
/// The radial mapping `r N/D` rises up to the first root of `N D + 2 s (N' D - N D')`, where `D` is positive. The
/// Jacobian of the radial part is symmetric with eigenvalues `N/D` across and `d/dr (r N/D)` along the radius; those
/// of decentring and prism have a spectral norm of at most `r (6 |(p1, p2)| + 2 |(s1, s3)| + 4 s |(s2, s4)|)`. Where
/// that stays below both eigenvalues the sum is positive definite, and a map whose Jacobian is so on a convex region
/// is one-to-one there.
pub(super) fn max_squared_radius(p: &Parameters) -> f64 {
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
pub(super) fn undistort_radially(p: &Parameters, max_squared_radius: f64, u: f64, v: f64) -> (f64, f64) {
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
