//! The image of a circle and the centroid of what it encloses.
//!
//! The perspective image of a circle is an ellipse, found in closed form from its dual conic (Hartley and
//! Zisserman, "Multiple View Geometry", 2nd ed., 2004, section 8.4). Its centre is its centroid, which is all a
//! pinhole camera needs. Any other lens distorts the ellipse; the centroid then follows from Green's theorem, with the
//! boundary known at a few points and differentiated by trigonometric interpolation: an error that falls
//! geometrically with the number of points.

use std::array::from_fn;

use nalgebra::{Matrix2, SVector, Vector2, Vector3};

use super::MIN_DEPTH_M;
use super::feature::Feature;
use crate::se3::Se3;

/// Number of points on the boundary of a circle's image.
pub(super) const BOUNDARY: usize = 6;

/// A disc whose plane passes the camera at less than this sine of the angle of sight counts as not seen.
const MIN_GRAZING_SINE: f64 = 1e-6;

/// Cosine and sine of the directions to the boundary points.
pub(super) const CIRCLE: [(f64, f64); BOUNDARY] = {
    // sin(pi / 3)
    const H: f64 = 0.866_025_403_784_438_6;
    [(1.0, 0.0), (0.5, H), (-0.5, H), (-1.0, 0.0), (-0.5, -H), (0.5, -H)]
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
        let centre = [(c.z * c.x + rr * n.z * n.x) / denominator, (c.z * c.y + rr * n.z * n.y) / denominator];
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
    pub fn boundary(&self) -> [[f64; 2]; BOUNDARY] {
        let [cx, cy] = self.centre;
        let [a, b, c] = self.triangle.map(|l| l * self.scale);
        CIRCLE.map(|(cos, sin)| [cx + a * cos, cy + b * cos + c * sin])
    }

    /// The gradient in the twist of a scalar with gradient `d` in centre and root `(c_x, c_y, l11, l21, l22)`.
    ///
    /// Reverse accumulation: back to the gradients `g` in the circle's position C and `h` in its normal n, which
    /// make `[g; C x g + n x h]` in the twist.
    #[inline]
    pub fn pull_back(&self, d: &[f64; 5]) -> SVector<f64, 6> {
        let (c, n, rr) = (&self.position, &self.normal, self.squared_radius);
        let [l11, l21, l22] = self.triangle;
        let [d_l11, d_l21, d_l22] = [d[2], d[3], d[4]].map(|d| d * self.scale);
        // The denominator divides everything, and its root is a factor of l22; the rest of l22 is n . C / l11.
        let d_denominator = (0.5 * d_l22 * l22
            - d[0] * self.centre[0]
            - d[1] * self.centre[1]
            - d_l11 * l11
            - d_l21 * l21
            - d_l22 * l22)
            / self.denominator;
        let d_distance = d_l22 * l22 / self.distance;
        let d_w12 = d_l21 / l11;
        let d_w11 = 0.5 * (d_l11 - (d_l21 * l21 + d_l22 * l22) / l11) / l11;
        let (d_x, d_y) = (d[0] / self.denominator, d[1] / self.denominator);

        let (zz, zn) = (c.z * c.z, c.z * n.z);
        let tilt_squared = n.x * n.x + n.y * n.y;
        let crossed = c.x * n.y + n.x * c.y;
        let along_x = tilt_squared * c.x + zn * n.x;
        let along_y = tilt_squared * c.y + zn * n.y;
        let g = Vector3::new(
            d_x * c.z + 2.0 * d_w11 * along_x + d_w12 * along_y,
            d_y * c.z + d_w12 * along_x,
            d_x * c.x
                + d_y * c.y
                + 2.0 * d_denominator * c.z
                + 2.0 * d_w11 * (c.z * (1.0 - n.x * n.x) + n.z * c.x * n.x)
                + d_w12 * (n.z * crossed - 2.0 * c.z * n.x * n.y),
        ) + n * d_distance;
        let h = Vector3::new(
            rr * (d_x * n.z - 2.0 * d_denominator * n.x)
                + 2.0 * d_w11 * (n.x * (c.x * c.x - zz) + zn * c.x)
                + d_w12 * ((rr - zz) * n.y + 2.0 * n.x * c.x * c.y + zn * c.y),
            rr * (d_y * n.z - 2.0 * d_denominator * n.y)
                + 2.0 * d_w11 * n.y * (c.x * c.x - rr)
                + d_w12 * ((rr - zz) * n.x + 2.0 * n.y * c.x * c.y + zn * c.x),
            rr * (d_x * n.x + d_y * n.y) + c.z * (2.0 * d_w11 * c.x * n.x + d_w12 * crossed),
        ) + c * d_distance;
        let turn = c.cross(&g) + n.cross(&h);
        SVector::<f64, 6>::new(g.x, g.y, g.z, turn.x, turn.y, turn.z)
    }
}

/// Points on the boundary of a distorted ellipse, anticlockwise at equal steps of the ellipse's parameter.
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
    // cot(pi/6) and cot(pi/3), halved, with alternating signs; cot(pi/2) is zero.
    const C: [f64; 2] = [0.866_025_403_784_438_6, -0.288_675_134_594_812_9];
    from_fn(|i| {
        let mut sum = 0.0;
        for (m, c) in C.iter().enumerate() {
            sum += c * (f[(i + m + 1) % BOUNDARY] - f[(i + BOUNDARY - m - 1) % BOUNDARY]);
        }
        sum
    })
}
