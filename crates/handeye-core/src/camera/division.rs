//! The division model: one coefficient that also follows wide lenses.
//!
//! Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion", CVPR 2001, eq. 3:
//! of a point at radius `r'` after the lens, the radius before it is `r = r' / (1 + k1 r'^2)`. Here in units of the
//! plane at unit depth. Forward, `r' = 2 r / (1 + sqrt(1 - 4 k1 r^2))`.

use super::distortion::DistortedPoint;
use super::lens_model::{Model, ParameterJacobian, Parameters};
use super::region::MAX_SQUARED_RADIUS;

pub(super) const MODEL: Model =
    Model { name: "division", coefficients: &["k1"], max_squared_radius, distort, differentiate, undistort };

/// `sqrt(1 - 4 k1 s)`, nothing below zero.
#[inline]
fn root(p: &Parameters, s: f64) -> f64 {
    (1.0 - 4.0 * p[4] * s).max(0.0).sqrt()
}

fn distort(p: &Parameters, x: f64, y: f64) -> DistortedPoint<f64> {
    let s = x * x + y * y;
    let root = root(p, s);
    let scale = 2.0 / (1.0 + root);
    // Twice the derivative of the scale in s.
    let slope = 2.0 * p[4] * scale * scale / root;
    DistortedPoint::along_radius(x, y, scale, slope)
}

fn differentiate(
    p: &Parameters,
    (x, y): (f64, f64),
    lens: &DistortedPoint<f64>,
    out: &mut ParameterJacobian,
) {
    let factor = lens.squared_radius * lens.radial * lens.radial / root(p, lens.squared_radius);
    out[(0, 4)] = x * factor;
    out[(1, 4)] = y * factor;
}

/// A lens with a positive coefficient folds where the root vanishes.
fn max_squared_radius(p: &Parameters) -> f64 {
    let fold = 1.0 / (4.0 * p[4]);
    // On the fold itself derivatives are infinite.
    if fold > 0.0 { (fold * (1.0 - 1e-9)).min(MAX_SQUARED_RADIUS) } else { MAX_SQUARED_RADIUS }
}

fn undistort(p: &Parameters, max_squared_radius: f64, (u, v): (f64, f64)) -> Option<(f64, f64)> {
    let denominator = 1.0 + p[4] * (u * u + v * v);
    let (x, y) = (u / denominator, v / denominator);
    // Beyond the fold a point after the lens has one before it that the lens sends elsewhere.
    (denominator > 0.0 && x * x + y * y <= max_squared_radius && p[4] * (u * u + v * v) < 1.0)
        .then_some((x, y))
}
