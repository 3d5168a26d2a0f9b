//! Measurements and their solution, as Python values.

use handeye_core::error::Error;
use handeye_core::least_squares::{
    Loss, Method, Options, Problem as CoreProblem, Solution as CoreSolution, Start, solve, view_block,
};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::camera::{camera, features};
use crate::convert::{self, Array, Indices};
use crate::errors::{invalid, to_python};
use crate::model::Model;

/// Registers the classes of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Problem>()?;
    module.add_class::<Solution>()
}

/// The measurements of a calibration.
#[pyclass(frozen, module = "handeye._core")]
pub struct Problem {
    pub inner: CoreProblem,
}

/// The answer of a solve.
#[pyclass(frozen, module = "handeye._core")]
pub struct Solution {
    inner: CoreSolution,
}

fn loss(py: Python<'_>, name: &str, scale: f64) -> PyResult<Loss> {
    match name {
        "squared" => Ok(Loss::Squared),
        "huber" => Ok(Loss::Huber(scale)),
        "cauchy" => Ok(Loss::Cauchy(scale)),
        "tukey" => Ok(Loss::Tukey(scale)),
        other => {
            Err(invalid(py, &format!("loss must be squared, huber, cauchy or tukey, found \"{other}\"")))
        }
    }
}

fn method(py: Python<'_>, name: &str) -> PyResult<Method> {
    match name {
        "levenberg_marquardt" => Ok(Method::LevenbergMarquardt),
        "gauss_newton" => Ok(Method::GaussNewton),
        other => Err(invalid(
            py,
            &format!("method must be levenberg_marquardt or gauss_newton, found \"{other}\""),
        )),
    }
}

#[pymethods]
impl Problem {
    #[new]
    #[pyo3(signature = (lens, parameters, points, radii, pixels, offsets, motions, *, covariances=None))]
    #[expect(clippy::too_many_arguments, reason = "flat arrays, one per kind of measurement")]
    fn new<'py>(
        py: Python<'py>,
        lens: &str,
        parameters: Array<'py>,
        points: Array<'py>,
        radii: Array<'py>,
        pixels: Array<'py>,
        offsets: Indices,
        motions: Array<'py>,
        covariances: Option<Array<'py>>,
    ) -> PyResult<Self> {
        let camera = camera(py, lens, &parameters)?;
        let features = features(py, &points, &radii)?;
        let pixels = convert::vectors::<2>(py, "pixels", &pixels)?;
        let motions = convert::transforms(py, "motions", &motions)?;
        let covariances =
            covariances.map(|c| convert::matrices::<2, 2>(py, "covariances", &c)).transpose()?;
        let inner = CoreProblem::new(camera, features, pixels, covariances.as_deref(), offsets.0, motions)
            .map_err(|e| to_python(py, e))?;
        Ok(Self { inner })
    }

    /// Number of views.
    #[getter]
    fn view_count(&self) -> usize {
        self.inner.view_count()
    }

    /// Minimises the reprojection error; see the type stub.
    #[pyo3(signature = (
        x, y, model, *, views=None, method="levenberg_marquardt", loss="squared", loss_scale=3.0,
        max_iterations=100, cost_tolerance=1e-10, step_tolerance=1e-13, gradient_tolerance=1e-12,
    ))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per option")]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        x: Array<'py>,
        y: Array<'py>,
        model: &Model,
        views: Option<Vec<usize>>,
        method: &str,
        loss: &str,
        loss_scale: f64,
        max_iterations: usize,
        cost_tolerance: f64,
        step_tolerance: f64,
        gradient_tolerance: f64,
    ) -> PyResult<Solution> {
        let start = Start { x: convert::transform(py, "x", &x)?, y: convert::transform(py, "y", &y)? };
        let views = views.unwrap_or_else(|| (0..self.inner.view_count()).collect());
        let options = Options {
            method: self::method(py, method)?,
            max_iterations,
            cost_tolerance,
            step_tolerance,
            gradient_tolerance,
            loss: self::loss(py, loss, loss_scale)?,
        };
        let inner = py
            .detach(|| solve(&self.inner, &model.inner, &start, &views, &options))
            .map_err(|e| to_python(py, e))?;
        Ok(Solution { inner })
    }

    /// Sum of squared residuals in px^2 of `T_camera_target = X A Y` over the views; infinite if out of sight.
    #[pyo3(signature = (x, y, *, views=None))]
    fn squared_error<'py>(
        &self,
        py: Python<'py>,
        x: Array<'py>,
        y: Array<'py>,
        views: Option<Vec<usize>>,
    ) -> PyResult<f64> {
        let (x, y) = (convert::transform(py, "x", &x)?, convert::transform(py, "y", &y)?);
        let views = views.unwrap_or_else(|| (0..self.inner.view_count()).collect());
        if let Some(k) = views.iter().find(|k| **k >= self.inner.view_count()) {
            return Err(invalid(py, &format!("view {k} of {}", self.inner.view_count())));
        }
        Ok(py.detach(|| {
            views
                .iter()
                .map(|k| {
                    let pose = x * *self.inner.motion(*k) * y;
                    view_block(&self.inner, *k, self.inner.camera(), 0.0, &pose, 1.0, None, Loss::Squared)
                        .map_or(f64::INFINITY, |b| b.squared_px)
                })
                .sum()
        }))
    }
}

#[pymethods]
impl Solution {
    /// `X`, 4 x 4.
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::matrix_out(py, &self.inner.x.to_matrix())
    }

    /// `Y`, 4 x 4.
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::matrix_out(py, &self.inner.y.to_matrix())
    }

    /// Camera parameters, free ones updated.
    #[getter]
    fn parameters(&self) -> Vec<f64> {
        let camera = &self.inner.camera;
        camera.parameters[..camera.lens.parameter_count()].to_vec()
    }

    /// Board scale minus one.
    #[getter]
    fn board_scale(&self) -> f64 {
        self.inner.board_scale
    }

    /// Kinematic parameters.
    #[getter]
    fn kinematic(&self) -> Vec<f64> {
        self.inner.kinematic.as_slice().to_vec()
    }

    /// Information of all global parameters, priors included.
    #[getter]
    fn information<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::dynamic_out(py, &self.inner.information)
    }

    /// Inverse of the information.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let covariance = self.inner.covariance().ok_or_else(|| {
            to_python(
                py,
                Error::degenerate("the information is singular: the views do not determine the answer"),
            )
        })?;
        Ok(convert::dynamic_out(py, &covariance))
    }

    /// The part of the information that came from priors.
    #[getter]
    fn prior_information<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::dynamic_out(py, &self.inner.prior_information)
    }

    /// Minus twice the log posterior up to constants.
    #[getter]
    fn cost(&self) -> f64 {
        self.inner.cost
    }

    /// The cost at the start.
    #[getter]
    fn initial_cost(&self) -> f64 {
        self.inner.initial_cost
    }

    /// Steps taken.
    #[getter]
    fn iterations(&self) -> usize {
        self.inner.iterations
    }

    /// How it ended.
    #[getter]
    fn ending(&self) -> &'static str {
        self.inner.ending.name()
    }

    /// Whether the answer is a minimum.
    #[getter]
    fn is_converged(&self) -> bool {
        self.inner.ending.is_converged()
    }

    /// Indices of the views used.
    #[getter]
    fn views(&self) -> Vec<usize> {
        self.inner.views.iter().map(|v| v.view).collect()
    }

    /// Root mean square residual of each view, px.
    #[getter]
    fn view_rmse_px(&self) -> Vec<f64> {
        self.inner.views.iter().map(|v| v.rmse_px).collect()
    }

    /// Squared whitened residuals of each view.
    #[getter]
    fn view_cost(&self) -> Vec<f64> {
        self.inner.views.iter().map(|v| v.cost).collect()
    }

    /// Estimated robot error of each view, `(K, 6)` twists.
    #[getter]
    fn corrections<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::vectors_out(py, &self.inner.views.iter().map(|v| v.correction).collect::<Vec<_>>())
    }

    /// Squared whitened correction of each view.
    #[getter]
    fn correction_cost(&self) -> Vec<f64> {
        self.inner.views.iter().map(|v| v.correction_cost).collect()
    }

    /// `T_camera_target` of each view, `(K, 4, 4)`.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::transforms_out(py, &self.inner.views.iter().map(|v| v.pose).collect::<Vec<_>>())
    }

    /// Sum over views of the log-determinant of the whitened correction's information.
    #[getter]
    fn correction_log_determinant(&self) -> f64 {
        self.inner.correction_log_determinant
    }
}
