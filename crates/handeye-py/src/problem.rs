//! Measurements and their solution, as Python values.

use crate::call::CallCore;
use handeye_core::error::Error;
use handeye_core::least_squares::{
    Options, Problem as CoreProblem, Solution as CoreSolution, Start, solve, view_block,
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

type Floats<'py> = Bound<'py, PyArrayDyn<f64>>;

impl Problem {
    fn check_views(&self, py: Python<'_>, views: &[usize]) -> PyResult<()> {
        match views.iter().find(|k| **k >= self.inner.view_count()) {
            Some(k) => Err(invalid(py, &format!("view {k} of {}", self.inner.view_count()))),
            None => Ok(()),
        }
    }
}

#[pymethods]
impl Problem {
    #[new]
    #[pyo3(signature = (lens, parameters, points, radii, pixels, offsets, motions))]
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
    ) -> PyResult<Self> {
        let camera = camera(py, lens, &parameters)?;
        let features = features(py, &points, &radii)?;
        let pixels = convert::vectors::<2>(py, "pixels", &pixels)?;
        let motions = convert::transforms(py, "motions", &motions)?;
        let inner =
            CoreProblem::new(camera, features, pixels, offsets.0, motions).map_err(|e| to_python(py, e))?;
        Ok(Self { inner })
    }

    /// Number of views.
    #[getter]
    fn view_count(&self) -> usize {
        self.inner.view_count()
    }

    /// The same pixels as of another camera.
    fn through(&self, py: Python<'_>, lens: &str, parameters: Array<'_>) -> PyResult<Self> {
        Ok(Self { inner: self.inner.through(camera(py, lens, &parameters)?) })
    }

    /// Poses that fit some views best, each near its start; see the type stub.
    fn refined<'py>(
        &self,
        py: Python<'py>,
        views: Vec<usize>,
        starts: Array<'py>,
    ) -> PyResult<(Floats<'py>, Vec<f64>, Floats<'py>)> {
        let starts = convert::transforms(py, "starts", &starts)?;
        if starts.len() != views.len() {
            return Err(invalid(py, &format!("{} starts for {} views", starts.len(), views.len())));
        }
        self.check_views(py, &views)?;
        let starts: Vec<_> = views.into_iter().zip(starts).collect();
        let fits = py.core(|| self.inner.refined(&starts))?.map_err(|e| to_python(py, e))?;
        let poses: Vec<_> = fits.iter().map(|fit| fit.t_camera_target).collect();
        let information: Vec<_> = fits.iter().map(|fit| fit.information).collect();
        Ok((
            convert::transforms_out(py, &poses),
            fits.iter().map(|fit| fit.rmse_px).collect(),
            convert::matrices_out(py, &information),
        ))
    }

    /// Minimises the reprojection error; see the type stub.
    #[pyo3(signature = (
        x, y, model, *, max_iterations=100, cost_tolerance=1e-10, step_tolerance=1e-13, gradient_tolerance=1e-12,
    ))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per option")]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        x: Array<'py>,
        y: Array<'py>,
        model: &Model,
        max_iterations: usize,
        cost_tolerance: f64,
        step_tolerance: f64,
        gradient_tolerance: f64,
    ) -> PyResult<Solution> {
        let start = Start { x: convert::transform(py, "x", &x)?, y: convert::transform(py, "y", &y)? };
        let options = Options { max_iterations, cost_tolerance, step_tolerance, gradient_tolerance };
        let inner =
            py.core(|| solve(&self.inner, &model.inner, &start, &options))?.map_err(|e| to_python(py, e))?;
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
        self.check_views(py, &views)?;
        py.core(|| {
            views
                .iter()
                .map(|k| {
                    let pose = x * *self.inner.motion(*k) * y;
                    view_block(&self.inner, *k, self.inner.camera(), &pose, 1.0)
                        .map_or(f64::INFINITY, |b| b.squared_px)
                })
                .sum()
        })
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

    /// Information of `[xi_x; xi_y]`, the prior included.
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
}
