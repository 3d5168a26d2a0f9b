//! The image of a circle and the centroid of what it encloses.
//!
//! The perspective image of a circle is an ellipse, found in closed form from its dual conic (Hartley and
//! Zisserman, "Multiple View Geometry", 2nd ed., 2004, section 8.4). Its centre is its centroid, which is all a
//! pinhole camera needs. Any other lens bends the ellipse; the centroid then follows from Green's theorem, with the
//! boundary known at a few points and differentiated by trigonometric interpolation: an error that falls
//! geometrically with the number of points.

use std::array::from_fn;

use nalgebra::{Matrix2, SMatrix, SVector, Vector2, Vector3};

use super::MIN_DEPTH_M;
use super::feature::Feature;
use crate::se3::Se3;

/// Number of points on the boundary of a circle's image.
pub(super) const BOUNDARY: usize = 8;

/// A disc whose plane passes the camera at less than this sine of the angle of sight counts as not seen.
const MIN_GRAZING_SINE: f64 = 1e-6;

/// Cosine and sine of the directions to the boundary points.
pub(super) const CIRCLE: [(f64, f64); BOUNDARY] = {
    const H: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [(1.0, 0.0), (H, H), (0.0, 1.0), (-H, H), (-1.0, 0.0), (-H, -H), (0.0, -1.0), (H, -H)]
};

/// The image of a circle in the plane at unit depth: `centre + root (cos t, sin t)`.
pub(super) struct Ellipse {
    /// Centre of the circle and normal of its plane, camera frame.
    position: Vector3<f64>,
    normal: Vector3<f64>,
    squared_radius: f64,
    /// Minus the last entry of the dual conic: `Z^2 - r^2 (1 - n_z^2)`.
    denominator: f64,
    /// `n . C`: distance of the camera from the circle's plane, signed.
    distance: f64,
    pub centre: [f64; 2],
    /// `r / denominator`.
    scale: f64,
    /// Lower triangle `[l11, l21, l22]`; the root of the ellipse is `scale` times it.
    triangle: [f64; 3],
}

impl Ellipse {
    /// None unless the whole circle lies in front of the camera and its plane is not seen edge-on.
    ///
    /// The dual conic of the circle's image is `r^2 (I - n n') - C C'`. Its quotients give centre `c` and shape
    /// `S` (points `c + S^(1/2) (cos t, sin t)`), the latter here with its cancelling terms cancelled.
    #[inline]
    pub fn of(t_camera_target: &Se3, feature: &Feature) -> Option<Self> {
        let position = t_camera_target.act(&feature.position);
        let normal = t_camera_target.rotation.column(2).into_owned();
        let (c, n, radius) = (&position, &normal, feature.radius);
        let tilt_squared = n.x * n.x + n.y * n.y;
        let distance = n.dot(c);
        let seen = radius > 0.0
            && c.z - radius * tilt_squared.sqrt() > MIN_DEPTH_M
            && distance.abs() > MIN_GRAZING_SINE * c.norm();
        if !seen {
            return None;
        }
        let rr = radius * radius;
        let denominator = c.z * c.z - rr * tilt_squared;
        let centre = [
            (c.z * c.x + rr * n.z * n.x) / denominator,
            (c.z * c.y + rr * n.z * n.y) / denominator,
        ];
        let zz = c.z * c.z;
        let zn = c.z * n.z;
        let w11 = zz * (1.0 - n.x * n.x) + tilt_squared * c.x * c.x + 2.0 * zn * c.x * n.x - rr * n.y * n.y;
        let w12 = (rr - zz) * n.x * n.y + tilt_squared * c.x * c.y + zn * (c.x * n.y + n.x * c.y);
        let l11 = w11.sqrt();
        // The determinant of the shape is known: denominator (n . C)^2.
        let triangle = [l11, w12 / l11, denominator.sqrt() * distance.abs() / l11];
        triangle.iter().all(|x| x.is_finite()).then_some(Self {
            position,
            normal,
            squared_radius: rr,
            denominator,
            distance,
            centre,
            scale: radius / denominator,
            triangle,
        })
    }

    #[inline]
    pub fn boundary(&self) -> impl Iterator<Item = [f64; 2]> {
        let [cx, cy] = self.centre;
        let [a, b, c] = self.triangle.map(|l| l * self.scale);
        CIRCLE.iter().map(move |(cos, sin)| [cx + a * cos, cy + b * cos + c * sin])
    }

    /// Derivative of centre and root `(c_x, c_y, l11, l21, l22)` in the twist.
    ///
    /// A scalar with gradients `g` in the circle's position C and `h` in its normal n has the gradient
    /// `[g; C x g + n x h]` in the twist.
    #[inline]
    pub fn d_twist(&self) -> SMatrix<f64, 5, 6> {
        let (c, n, rr) = (&self.position, &self.normal, self.squared_radius);
        let (zz, zn) = (c.z * c.z, c.z * n.z);
        let tilt_squared = n.x * n.x + n.y * n.y;
        let twist = |g: Vector3<f64>, h: Vector3<f64>| {
            let turn = c.cross(&g) + n.cross(&h);
            SVector::<f64, 6>::new(g.x, g.y, g.z, turn.x, turn.y, turn.z)
        };
        let d_log_denominator =
            twist(Vector3::new(0.0, 0.0, 2.0 * c.z), Vector3::new(-2.0 * rr * n.x, -2.0 * rr * n.y, 0.0))
                / self.denominator;
        let d_x = twist(Vector3::new(c.z, 0.0, c.x), Vector3::new(rr * n.z, 0.0, rr * n.x)) / self.denominator
            - d_log_denominator * self.centre[0];
        let d_y = twist(Vector3::new(0.0, c.z, c.y), Vector3::new(0.0, rr * n.z, rr * n.y)) / self.denominator
            - d_log_denominator * self.centre[1];
        let d_w11 = twist(
            Vector3::new(
                2.0 * (tilt_squared * c.x + zn * n.x),
                0.0,
                2.0 * (c.z * (1.0 - n.x * n.x) + n.z * c.x * n.x),
            ),
            Vector3::new(
                2.0 * (n.x * (c.x * c.x - zz) + zn * c.x),
                2.0 * n.y * (c.x * c.x - rr),
                2.0 * c.z * c.x * n.x,
            ),
        );
        let crossed = c.x * n.y + n.x * c.y;
        let d_w12 = twist(
            Vector3::new(
                tilt_squared * c.y + zn * n.y,
                tilt_squared * c.x + zn * n.x,
                n.z * crossed - 2.0 * c.z * n.x * n.y,
            ),
            Vector3::new(
                (rr - zz) * n.y + 2.0 * n.x * c.x * c.y + zn * c.y,
                (rr - zz) * n.x + 2.0 * n.y * c.x * c.y + zn * c.x,
                c.z * crossed,
            ),
        );
        // Gradients n in C and C in n: rotating both changes nothing.
        let d_log_distance = twist(*n, *c) / self.distance;
        let [l11, l21, l22] = self.triangle;
        let d_l11 = d_w11 / (2.0 * l11);
        let d_l21 = (d_w12 - d_l11 * l21) / l11;
        let d_l22 = (d_log_denominator * 0.5 + d_log_distance - d_l11 / l11) * l22;
        let mut jacobian = SMatrix::<f64, 5, 6>::zeros();
        jacobian.set_row(0, &d_x.transpose());
        jacobian.set_row(1, &d_y.transpose());
        for (row, (d_l, l)) in [(d_l11, l11), (d_l21, l21), (d_l22, l22)].into_iter().enumerate() {
            jacobian.set_row(row + 2, &((d_l - d_log_denominator * l) * self.scale).transpose());
        }
        jacobian
    }
}

/// Points on the boundary of a bent ellipse, anticlockwise at equal steps of the ellipse's parameter.
#[derive(Default)]
pub(super) struct Boundary {
    pub x: [f64; BOUNDARY],
    pub y: [f64; BOUNDARY],
}

impl Boundary {
    /// Centroid of the enclosed area, and its derivative in each point.
    ///
    /// Area `A = oint x dy`, moments `oint x^2 dy / 2` and `-oint y^2 dx / 2`.
    #[inline]
    pub fn centroid(&self) -> (Vector2<f64>, [Matrix2<f64>; BOUNDARY]) {
        let (x, y) = (&self.x, &self.y);
        let (dx, dy) = (along(x), along(y));
        let (dxx, dyy) = (along(&x.map(|x| x * x)), along(&y.map(|y| y * y)));
        let (mut area, mut moment_x, mut moment_y) = (0.0, 0.0, 0.0);
        for i in 0..BOUNDARY {
            area += x[i] * dy[i];
            moment_x += 0.5 * x[i] * x[i] * dy[i];
            moment_y -= 0.5 * y[i] * y[i] * dx[i];
        }
        let inverse = 1.0 / area;
        let (cx, cy) = (moment_x * inverse, moment_y * inverse);
        let weights = from_fn(|i| {
            Matrix2::new(
                (x[i] - cx) * dy[i],
                cx * dx[i] - 0.5 * dxx[i],
                0.5 * dyy[i] - cy * dy[i],
                (cy - y[i]) * dx[i],
            ) * inverse
        });
        (Vector2::new(cx, cy), weights)
    }
}

/// Derivative of the trigonometric interpolant at its own points (Trefethen, "Spectral Methods in MATLAB", 2000,
/// chapter 3): `f'_i = sum over m of (-1)^(m+1) cot(m pi / n) / 2 (f_(i+m) - f_(i-m))`.
#[inline]
fn along(f: &[f64; BOUNDARY]) -> [f64; BOUNDARY] {
    // cot(pi/8), cot(pi/4), cot(3 pi/8), halved, with alternating signs.
    const C: [f64; 3] = [
        0.5 * (1.0 + std::f64::consts::SQRT_2),
        -0.5,
        0.5 * (std::f64::consts::SQRT_2 - 1.0),
    ];
    from_fn(|i| {
        let mut sum = 0.0;
        for (m, c) in C.iter().enumerate() {
            sum += c * (f[(i + m + 1) % BOUNDARY] - f[(i + BOUNDARY - m - 1) % BOUNDARY]);
        }
        sum
    })
}
