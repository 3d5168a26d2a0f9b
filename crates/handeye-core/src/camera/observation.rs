//! What a camera sees of a feature: a point, or of a circle the area centroid of its image.
//!
//! A detector that takes the centre of gravity of a blob measures the centroid of the projected disc, which is not
//! the projection of the disc's centre: with focal length f, radius r, depth Z and tilt a the two differ by about
//! `f r^2 sin(2 a) / (2 Z^2)` pixels. What is predicted here is the centroid.

use nalgebra::{Matrix2x6, Vector2};

use super::circle::{BOUNDARY, Boundary, CIRCLE, Ellipse};
use super::feature::Feature;
use super::{Camera, Lens, ParameterJacobian, at_unit_depth};
use crate::se3::Se3;

/// What a camera sees of a feature, with derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// The pixel.
    pub pixel: Vector2<f64>,
    /// Derivative in the left perturbation `[rho; phi]` of `T_camera_target`.
    pub d_twist: Matrix2x6<f64>,
    /// Derivative in the camera parameters.
    pub d_parameters: ParameterJacobian,
}

impl Camera {
    /// Pixel at which a feature is detected: of a point its projection, of a circle the centroid of its image.
    /// None where the lens does not see all of it.
    #[inline]
    pub fn observe(&self, t_camera_target: &Se3, feature: &Feature) -> Option<Vector2<f64>> {
        if feature.radius == 0.0 {
            return self.project(&t_camera_target.act(&feature.position));
        }
        self.observe_circle(t_camera_target, feature)
    }

    /// [`Camera::observe`] with the derivative in the left perturbation of `T_camera_target`.
    #[inline]
    pub fn observe_with_twist_derivative(
        &self,
        t_camera_target: &Se3,
        feature: &Feature,
    ) -> Option<(Vector2<f64>, Matrix2x6<f64>)> {
        if feature.radius == 0.0 {
            let (x, y, inverse_depth) = at_unit_depth(&t_camera_target.act(&feature.position))?;
            let distorted = self.distort(x, y)?;
            let pixel = self.scale_and_shift(distorted.x, distorted.y);
            return Some((pixel, self.twist_derivative(x, y, inverse_depth, &distorted)));
        }
        self.observe_circle_with_derivatives(t_camera_target, feature, None)
    }

    /// [`Camera::observe`] with all derivatives.
    #[inline]
    pub fn observe_with_derivatives(&self, t_camera_target: &Se3, feature: &Feature) -> Option<Observation> {
        if feature.radius == 0.0 {
            let (x, y, inverse_depth) = at_unit_depth(&t_camera_target.act(&feature.position))?;
            let distorted = self.distort(x, y)?;
            return Some(Observation {
                pixel: self.scale_and_shift(distorted.x, distorted.y),
                d_twist: self.twist_derivative(x, y, inverse_depth, &distorted),
                d_parameters: self.parameter_derivative(x, y, &distorted),
            });
        }
        let mut d_parameters = ParameterJacobian::zeros();
        let (pixel, d_twist) =
            self.observe_circle_with_derivatives(t_camera_target, feature, Some(&mut d_parameters))?;
        Some(Observation { pixel, d_twist, d_parameters })
    }

    fn observe_circle(&self, t_camera_target: &Se3, feature: &Feature) -> Option<Vector2<f64>> {
        let ellipse = Ellipse::of(t_camera_target, feature)?;
        let [x, y] = ellipse.centre;
        let middle = self.distort(x, y)?;
        if self.lens == Lens::Pinhole {
            return Some(self.scale_and_shift(x, y));
        }
        let mut boundary = Boundary::default();
        for (i, at) in ellipse.boundary().iter().enumerate() {
            let distorted = self.distort(at[0], at[1])?;
            boundary.x[i] = distorted.x - middle.x;
            boundary.y[i] = distorted.y - middle.y;
        }
        let (centroid, _) = boundary.centroid();
        Some(self.scale_and_shift(middle.x + centroid.x, middle.y + centroid.y))
    }

    /// `d_parameters`, where wanted, starts as zero.
    fn observe_circle_with_derivatives(
        &self,
        t_camera_target: &Se3,
        feature: &Feature,
        mut d_parameters: Option<&mut ParameterJacobian>,
    ) -> Option<(Vector2<f64>, Matrix2x6<f64>)> {
        let ellipse = Ellipse::of(t_camera_target, feature)?;
        let [x, y] = ellipse.centre;
        let middle = self.distort(x, y)?;
        // Gradients of the centroid's coordinates in centre and root of the ellipse.
        let (mut d_x, mut d_y) = ([1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0, 0.0]);
        let mut centroid = Vector2::new(middle.x, middle.y);
        if self.lens != Lens::Pinhole {
            let at = ellipse.boundary();
            let mut boundary = Boundary::default();
            let mut lens = [middle; BOUNDARY];
            for i in 0..BOUNDARY {
                let distorted = self.distort(at[i][0], at[i][1])?;
                boundary.x[i] = distorted.x - middle.x;
                boundary.y[i] = distorted.y - middle.y;
                lens[i] = distorted;
            }
            let (offset, weights) = boundary.centroid();
            centroid += offset;
            (d_x, d_y) = ([0.0; 5], [0.0; 5]);
            let mut d_distorted = ParameterJacobian::zeros();
            for i in 0..BOUNDARY {
                let d_at = weights[i] * lens[i].jacobian();
                let (cos, sin) = CIRCLE[i];
                for (d, x, y) in [(&mut d_x, d_at.m11, d_at.m12), (&mut d_y, d_at.m21, d_at.m22)] {
                    d[0] += x;
                    d[1] += y;
                    d[2] += cos * x;
                    d[3] += cos * y;
                    d[4] += sin * y;
                }
                if let Some(d_parameters) = d_parameters.as_mut() {
                    self.distortion_derivatives((at[i][0], at[i][1]), &lens[i], &mut d_distorted);
                    for column in 4..self.lens.parameter_count() {
                        let d = weights[i] * d_distorted.column(column);
                        d_parameters[(0, column)] += d.x;
                        d_parameters[(1, column)] += d.y;
                    }
                }
            }
        }
        if let Some(d_parameters) = d_parameters {
            self.finish_parameters(centroid.x, centroid.y, d_parameters);
        }
        let mut d_twist = Matrix2x6::zeros();
        d_twist.set_row(0, &(ellipse.pull_back(&d_x) * self.parameters[0]).transpose());
        d_twist.set_row(1, &(ellipse.pull_back(&d_y) * self.parameters[1]).transpose());
        Some((self.scale_and_shift(centroid.x, centroid.y), d_twist))
    }
}

#[cfg(test)]
mod tests;
