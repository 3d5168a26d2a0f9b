//! One view as a six-dimensional measurement: its 6 x 6 information and gradient in the camera-frame twist,
//! and beside it the columns of the pixel parameters.

use nalgebra::{DMatrix, DVector, Matrix2x6, Matrix6, Matrix6xX, SMatrix, Vector2, Vector3, Vector6};

use super::pixel_parameters::PixelParameters;
use super::problem::Problem;
use crate::camera::{Camera, Observation};
use crate::se3::Se3;

/// The quadratic of one view around `T_camera_target`, in `[eta; c]`: twist and pixel parameters.
#[derive(Clone, Debug)]
pub struct ViewBlock {
    /// `M = G' G / sigma^2`.
    pub m: Matrix6<f64>,
    /// Gradient `G' r / sigma^2` with `r = pi - u`.
    pub g: Vector6<f64>,
    /// Pixel-parameter columns; `None` without pixel parameters.
    pub columns: Option<PixelColumns>,
    /// Sum of squared residuals, px^2.
    pub squared_px: f64,
}

/// Blocks of the pixel parameters in a view's quadratic.
#[derive(Clone, Debug)]
pub struct PixelColumns {
    /// `G' C / sigma^2`, `6 x n`.
    pub mc: Matrix6xX<f64>,
    /// `C' C / sigma^2`, `n x n`.
    pub cc: DMatrix<f64>,
    /// `C' r / sigma^2`.
    pub gc: DVector<f64>,
}

impl ViewBlock {
    /// The whole `(6 + n)` square matrix.
    pub fn matrix(&self) -> DMatrix<f64> {
        let n = self.columns.as_ref().map_or(0, |c| c.gc.len());
        let mut all = DMatrix::zeros(6 + n, 6 + n);
        all.view_mut((0, 0), (6, 6)).copy_from(&self.m);
        if let Some(c) = &self.columns {
            all.view_mut((0, 6), (6, n)).copy_from(&c.mc);
            all.view_mut((6, 0), (n, 6)).copy_from(&c.mc.transpose());
            all.view_mut((6, 6), (n, n)).copy_from(&c.cc);
        }
        all
    }
}

/// Upper triangle of a symmetric 6 x 6 sum and its gradient, filled point by point.
#[derive(Clone)]
pub(crate) struct Moments {
    upper: [f64; 21],
    gradient: [f64; 6],
}

impl Moments {
    pub(crate) fn new() -> Self {
        Self { upper: [0.0; 21], gradient: [0.0; 6] }
    }

    /// Adds `d' w d` and `d' w r` of a point.
    #[inline]
    pub(crate) fn add(&mut self, d_twist: &Matrix2x6<f64>, residual: &Vector2<f64>, weight: f64) {
        for axis in 0..2 {
            let mut n = 0;
            for i in 0..6 {
                let scaled = weight * d_twist[(axis, i)];
                self.gradient[i] += scaled * residual[axis];
                for j in i..6 {
                    self.upper[n] += scaled * d_twist[(axis, j)];
                    n += 1;
                }
            }
        }
    }

    /// The sums as a matrix and a vector.
    pub(crate) fn finish(&self) -> (Matrix6<f64>, Vector6<f64>) {
        let mut m = Matrix6::zeros();
        let mut n = 0;
        for i in 0..6 {
            for j in i..6 {
                m[(i, j)] = self.upper[n];
                m[(j, i)] = self.upper[n];
                n += 1;
            }
        }
        (m, Vector6::from(self.gradient))
    }
}

/// The quadratic of view `k` of `problem` in its pose, at `pose = T_camera_target`, noise `sigma` px.
///
/// `None` where a point cannot be seen (behind the camera, outside the lens' valid region).
pub fn view_block(problem: &Problem, k: usize, camera: &Camera, pose: &Se3, sigma: f64) -> Option<ViewBlock> {
    let range = problem.samples(k);
    let weight = 1.0 / (sigma * sigma);
    let mut moments = Moments::new();
    let mut squared_px = 0.0;
    for (feature, pixel) in problem.features()[range.clone()].iter().zip(&problem.pixels()[range]) {
        let (predicted, d_twist) = camera.observe_with_twist_derivative(pose, feature)?;
        let residual = predicted - pixel;
        moments.add(&d_twist, &residual, weight);
        squared_px += residual.norm_squared();
    }
    if !squared_px.is_finite() {
        return None;
    }
    let (m, g) = moments.finish();
    Some(ViewBlock { m, g, columns: None, squared_px })
}

/// Widest set of pixel parameters: all of a lens' and the board scale.
const MAX_COLUMNS: usize = crate::camera::MAX_PARAMETERS + 1;

impl PixelColumns {
    /// Empty sums for `n` pixel parameters.
    pub(crate) fn zeros(n: usize) -> Self {
        Self { mc: Matrix6xX::zeros(n), cc: DMatrix::zeros(n, n), gc: DVector::zeros(n) }
    }

    /// Adds one point, `weight` its information.
    pub(crate) fn add(
        &mut self,
        parameters: &PixelParameters,
        seen: &Observation,
        point: &Vector3<f64>,
        residual: &Vector2<f64>,
        weight: f64,
    ) {
        let mut extra = SMatrix::<f64, 2, MAX_COLUMNS>::zeros();
        for (column, parameter) in parameters.camera.iter().enumerate() {
            extra.set_column(column, &seen.d_parameters.column(*parameter).into_owned());
        }
        if parameters.board_scale {
            // The first three twist columns are d pixel / d p, and d p / d s = R P.
            let d_point = seen.d_twist.fixed_columns::<3>(0);
            extra.set_column(parameters.camera.len(), &(d_point * point));
        }
        let d_twist = &seen.d_twist;
        let n = self.gc.len();
        for j in 0..n {
            let (eu, ev) = (weight * extra[(0, j)], weight * extra[(1, j)]);
            self.gc[j] += eu * residual.x + ev * residual.y;
            for i in 0..6 {
                self.mc[(i, j)] += d_twist[(0, i)] * eu + d_twist[(1, i)] * ev;
            }
            for i in 0..=j {
                let value = extra[(0, i)] * eu + extra[(1, i)] * ev;
                self.cc[(i, j)] += value;
                if i != j {
                    self.cc[(j, i)] += value;
                }
            }
        }
    }
}
