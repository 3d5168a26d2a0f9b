//! The equidistant fisheye, as `cv2.fisheye` states it.
//!
//! Kannala and Brandt, "A generic camera model and calibration method for conventional, wide-angle, and fish-eye
//! lenses", PAMI 28(8), 2006, eq. 6. With `r = sqrt(x^2 + y^2)` and `theta = atan r`:
//! `(x', y') = (x, y) theta_d / r`, `theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)`.

use super::distortion::DistortedPoint;
use super::lens_model::{Model, ParameterJacobian, Parameters};
use super::region::{self, MAX_SQUARED_RADIUS};

pub(super) const MODEL: Model = Model {
    name: "kannala_brandt",
    coefficients: &["k1", "k2", "k3", "k4"],
    max_squared_radius,
    distort,
    differentiate: |_, (x, y), _, out| coefficients(x, y, out),
    undistort,
};

/// Below this squared radius the quotients in `r` are replaced by their series.
const SMALL: f64 = 1e-8;

/// `theta_d` and its derivative in `theta`.
#[inline]
fn distorted_angle(p: &Parameters, theta: f64) -> (f64, f64) {
    let s = theta * theta;
    let (k1, k2, k3, k4) = (p[4], p[5], p[6], p[7]);
    (
        theta * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4)))),
        1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4))),
    )
}

#[inline]
fn distort(p: &Parameters, x: f64, y: f64) -> DistortedPoint<f64> {
    let s = x * x + y * y;
    let (scale, slope) = if s < SMALL {
        let second = p[4] - 1.0 / 3.0;
        (1.0 + second * s, 2.0 * second)
    } else {
        let r = s.sqrt();
        let (angle, rate) = distorted_angle(p, r.atan());
        let scale = angle / r;
        (scale, (rate / (1.0 + s) - scale) / s)
    };
    DistortedPoint::along_radius(x, y, scale, slope)
}

/// Derivative of the point after the lens in `k1..k4`: columns 4 to 7 of `out`.
#[inline]
fn coefficients(x: f64, y: f64, out: &mut ParameterJacobian) {
    let r = (x * x + y * y).sqrt();
    let theta = r.atan();
    let mut factor = if r * r < SMALL { 1.0 } else { theta / r };
    for column in 4..8 {
        factor *= theta * theta;
        out[(0, column)] = x * factor;
        out[(1, column)] = y * factor;
    }
}

/// Squared radius up to which `theta_d` rises.
fn max_squared_radius(p: &Parameters) -> f64 {
    let limit = MAX_SQUARED_RADIUS.sqrt().atan();
    let rising = [1.0, 3.0 * p[4], 5.0 * p[5], 7.0 * p[6], 9.0 * p[7]];
    let theta = region::first_root(&rising, limit * limit).sqrt();
    if theta < limit { theta.tan().powi(2) } else { MAX_SQUARED_RADIUS }
}

/// The point before the lens; None beyond the largest angle.
fn undistort(p: &Parameters, max_squared_radius: f64, (u, v): (f64, f64)) -> Option<(f64, f64)> {
    let target = u.hypot(v);
    let limit = max_squared_radius.sqrt().atan();
    if target > distorted_angle(p, limit).0 {
        return None;
    }
    if target == 0.0 {
        return Some((0.0, 0.0));
    }
    let radius = region::rising_root(target, limit, |theta| distorted_angle(p, theta)).tan();
    Some((u * radius / target, v * radius / target))
}
