//! Camera models: from a point in the camera frame to a pixel, with analytic derivatives.
//!
//! The camera frame is OpenCV's: x right, y down, z forward; pixel centres at integers.
//! One file per lens family. A lens maps the plane at unit depth to itself; [`Camera`] adds the perspective
//! division before it and the focal lengths and principal point after it.

mod brown_conrady;
mod circle;
mod distortion;
mod division;
mod feature;
mod kannala_brandt;
mod lens;
mod lens_model;
mod observation;
mod pinhole;
mod projection_row;
mod region;
mod shift;

use nalgebra::{Matrix2x3, Matrix2x6, Vector2, Vector3};

use crate::error::Error;

pub(crate) use brown_conrady::{coefficient_derivative, distort};
pub(crate) use distortion::DistortedPoint;
pub use feature::Feature;
pub use lens::Lens;
pub use lens_model::{MAX_PARAMETERS, ParameterJacobian};
pub use observation::Observation;
pub(crate) use projection_row::{projection_row, restore_signs};

/// Points nearer to the camera's plane than this, in metres, count as behind it.
pub const MIN_DEPTH_M: f64 = 1e-6;

/// Largest magnitude of a parameter: far beyond any lens, small enough that no product overflows.
const MAX_MAGNITUDE: f64 = 1e12;

/// A pixel with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// The pixel.
    pub pixel: Vector2<f64>,
    /// Derivative in the point, camera frame.
    pub d_point: Matrix2x3<f64>,
    /// Derivative in the camera parameters.
    pub d_parameters: ParameterJacobian,
}

/// A camera: a lens and its parameters `fx, fy, cx, cy, distortion...`, validated.
///
/// The fields are for reading; make a changed camera with [`Camera::new`] or [`Camera::plus`], which also find
/// the region where the lens is valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Which lens.
    pub lens: Lens,
    /// Its parameters; the first `lens.parameter_count()` count, the others are zero.
    pub parameters: [f64; MAX_PARAMETERS],
    /// Up to this squared radius in the plane at unit depth the lens is valid.
    max_squared_radius: f64,
}

impl Camera {
    /// A camera from all parameters of its lens.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a wrong count, a parameter that is not finite (or beyond 1e12), or a
    /// focal length that is not positive.
    pub fn new(lens: Lens, parameters: &[f64]) -> Result<Self, Error> {
        let count = lens.parameter_count();
        if parameters.len() != count {
            return Err(Error::invalid(format!(
                "lens \"{}\" has {count} parameters, found {}",
                lens.name(),
                parameters.len()
            )));
        }
        let mut padded = [0.0; MAX_PARAMETERS];
        padded[..count].copy_from_slice(parameters);
        if let Some(i) = padded.iter().position(|p| p.is_nan() || p.abs() > MAX_MAGNITUDE) {
            return Err(Error::invalid(format!(
                "camera parameter {i} is {}: not a finite number of sensible size",
                padded[i]
            )));
        }
        if padded[0] <= 0.0 || padded[1] <= 0.0 {
            return Err(Error::invalid(format!(
                "focal lengths must be positive pixels, found fx = {}, fy = {}",
                padded[0], padded[1]
            )));
        }
        let max_squared_radius = (lens.model().max_squared_radius)(&padded);
        Ok(Self { lens, parameters: padded, max_squared_radius })
    }

    /// The camera with `delta` added to its parameters; entries beyond the lens' count are ignored.
    ///
    /// # Errors
    /// As [`Camera::new`].
    pub fn plus(&self, delta: &[f64]) -> Result<Self, Error> {
        let mut parameters = self.parameters;
        for (parameter, change) in parameters.iter_mut().zip(delta) {
            *parameter += change;
        }
        Self::new(self.lens, &parameters[..self.lens.parameter_count()])
    }

    /// Largest squared distance from the axis, in the plane at unit depth, of a point that the lens sees.
    pub(crate) fn max_squared_radius(&self) -> f64 {
        self.max_squared_radius
    }

    /// The point at unit depth after the lens; None outside the region where the lens is one-to-one.
    #[inline]
    fn distort(&self, x: f64, y: f64) -> Option<DistortedPoint<f64>> {
        let p = &self.parameters;
        // Written so that NaN falls through to None.
        if x * x + y * y <= self.max_squared_radius {
            let distorted = (self.lens.model().distort)(p, x, y);
            // On the very edge rounding can make it singular, next to a pole NaN.
            if distorted.determinant() > 0.0 {
                return Some(distorted);
            }
        }
        None
    }

    /// Derivative of the point after the lens in the distortion coefficients, parameters 4 and on.
    #[inline]
    fn distortion_derivatives(
        &self,
        (x, y): (f64, f64),
        distorted: &DistortedPoint<f64>,
        out: &mut ParameterJacobian,
    ) {
        (self.lens.model().differentiate)(&self.parameters, (x, y), distorted, out);
    }

    /// Focal lengths and principal point applied to a point after the lens.
    #[inline]
    fn scale_and_shift(&self, x: f64, y: f64) -> Vector2<f64> {
        let p = &self.parameters;
        Vector2::new(p[0] * x + p[2], p[1] * y + p[3])
    }

    /// Finishes a derivative in the parameters that holds the unscaled columns 4 and on.
    #[inline]
    fn finish_parameters(&self, x: f64, y: f64, jacobian: &mut ParameterJacobian) {
        let p = &self.parameters;
        for i in 4..self.lens.parameter_count() {
            jacobian[(0, i)] *= p[0];
            jacobian[(1, i)] *= p[1];
        }
        jacobian[(0, 0)] = x;
        jacobian[(1, 1)] = y;
        jacobian[(0, 2)] = 1.0;
        jacobian[(1, 3)] = 1.0;
    }

    /// Pixel of a point in the camera frame; None where the lens does not see it.
    #[inline]
    pub fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (x, y, _) = at_unit_depth(point)?;
        let distorted = self.distort(x, y)?;
        Some(self.scale_and_shift(distorted.x, distorted.y))
    }

    /// Pixel and its derivatives in the point and in the camera parameters.
    #[inline]
    pub fn project_with_derivatives(&self, point: &Vector3<f64>) -> Option<Projection> {
        let (x, y, inverse_depth) = at_unit_depth(point)?;
        let distorted = self.distort(x, y)?;
        Some(Projection {
            pixel: self.scale_and_shift(distorted.x, distorted.y),
            d_point: self
                .twist_derivative(x, y, inverse_depth, &distorted)
                .fixed_columns::<3>(0)
                .into_owned(),
            d_parameters: self.parameter_derivative(x, y, &distorted),
        })
    }

    /// Derivative in the parameters of the pixel of a point at `(x, y)` in the plane at unit depth.
    #[inline]
    fn parameter_derivative(&self, x: f64, y: f64, distorted: &DistortedPoint<f64>) -> ParameterJacobian {
        let mut jacobian = ParameterJacobian::zeros();
        self.distortion_derivatives((x, y), distorted, &mut jacobian);
        self.finish_parameters(distorted.x, distorted.y, &mut jacobian);
        jacobian
    }

    /// Derivative in the left perturbation `[rho; phi]` of the pixel of a point that lies at `(x, y)` in the plane at unit depth.
    #[inline]
    fn twist_derivative(
        &self,
        x: f64,
        y: f64,
        inverse_depth: f64,
        lens: &DistortedPoint<f64>,
    ) -> Matrix2x6<f64> {
        let (fx, fy) = (self.parameters[0], self.parameters[1]);
        let rows = [(fx * lens.along_x, fx * lens.cross_x), (fy * lens.cross_y, fy * lens.along_y)];
        let [u, v] = rows.map(|of_lens| projection_row(of_lens, inverse_depth, x, y));
        Matrix2x6::new(u[0], u[1], -u[2], -u[3], u[4], u[5], v[0], v[1], -v[2], -v[3], v[4], v[5])
    }

    /// Unit vector, camera frame, along the ray of a pixel; None where no point that the lens sees has it.
    pub fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let p = &self.parameters;
        let (u, v) = ((pixel.x - p[2]) / p[0], (pixel.y - p[3]) / p[1]);
        if !(u.is_finite() && v.is_finite()) {
            return None;
        }
        let (x, y) = (self.lens.model().undistort)(p, self.max_squared_radius, (u, v))?;
        let norm_squared = x * x + y * y;
        // Written so that NaN falls through to None.
        if norm_squared <= self.max_squared_radius {
            return Some(Vector3::new(x, y, 1.0) / (1.0 + norm_squared).sqrt());
        }
        None
    }
}

/// `x/z, y/z, 1/z`; None behind the camera.
#[inline]
fn at_unit_depth(point: &Vector3<f64>) -> Option<(f64, f64, f64)> {
    if point.z > MIN_DEPTH_M {
        let inverse_depth = 1.0 / point.z;
        return Some((point.x * inverse_depth, point.y * inverse_depth, inverse_depth));
    }
    None
}

#[cfg(test)]
mod tests;
