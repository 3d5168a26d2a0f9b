//! What is believed of a cell, as Python sees it.

use handeye_core::estimation::Posterior as CorePosterior;
use handeye_core::se3::Se3;
use nalgebra::DMatrix;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::invalid;
use crate::model::jacobian_list;

/// Registers the class of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Posterior>()
}

type Floats<'py> = Bound<'py, PyArrayDyn<f64>>;

/// What is believed of a cell.
#[pyclass(frozen, module = "handeye._core")]
pub struct Posterior {
    pub(crate) inner: CorePosterior,
    pub(crate) origin: &'static str,
}

fn transforms<'py>(py: Python<'py>, poses: &[Se3]) -> Floats<'py> {
    convert::matrices_out(py, &poses.iter().map(Se3::to_matrix).collect::<Vec<_>>())
}

#[pymethods]
impl Posterior {
    /// `X` of each camera, (C, 4, 4).
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Floats<'py> {
        transforms(py, &self.inner.x)
    }

    /// `Y` of each target, (T, 4, 4).
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Floats<'py> {
        transforms(py, &self.inner.y)
    }

    /// All parameters (n,): twists (zero), cameras, boards, constants of the arm.
    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Floats<'py> {
        convert::scalars_out(py, self.inner.theta.as_slice().to_vec())
    }

    /// Their covariance (n, n).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Floats<'py> {
        convert::dynamic_out(py, &self.inner.covariance)
    }

    /// Components with constants: name, first and one beyond the last of theirs in `theta`.
    #[getter]
    fn constants(&self) -> Vec<(&'static str, usize, usize)> {
        self.inner.constants.iter().map(|(name, r)| (*name, r.start, r.end)).collect()
    }

    /// Names of the levels.
    #[getter]
    fn level_names(&self) -> Vec<&'static str> {
        self.inner.level_names.clone()
    }

    /// Levels at each node (N, L), at the mode first.
    #[getter]
    fn levels<'py>(&self, py: Python<'py>) -> Floats<'py> {
        let nodes = &self.inner.nodes;
        let entries = nodes.iter().flat_map(|node| node.levels.iter().copied()).collect();
        convert::array(py, &[nodes.len(), self.inner.level_names.len()], entries)
    }

    /// Levels at the mode (L,).
    #[getter]
    fn mode(&self) -> Vec<f64> {
        self.inner.nodes.first().map_or_else(Vec::new, |node| node.levels.clone())
    }

    /// Share of each node (N,).
    #[getter]
    fn weights(&self) -> Vec<f64> {
        self.inner.nodes.iter().map(|node| node.weight).collect()
    }

    /// Degrees of freedom of the covariance of each `X`.
    #[getter]
    fn degrees_of_freedom(&self) -> Vec<f64> {
        self.inner.degrees_of_freedom.clone()
    }

    /// Degrees of freedom of the covariance of six linear combinations of `theta`, each of (K, 6, n).
    fn degrees_of_freedom_of(&self, py: Python<'_>, combinations: Array<'_>) -> PyResult<Vec<f64>> {
        let combinations = jacobian_list(py, &combinations)?;
        if combinations.iter().any(|c| c.ncols() != self.inner.theta.len()) {
            return Err(invalid(py, "combinations must have a column per parameter"));
        }
        let fixed = |c: DMatrix<f64>| c.fixed_rows::<6>(0).into_owned();
        Ok(combinations.into_iter().map(|c| self.inner.degrees_of_freedom_of(&fixed(c))).collect())
    }

    /// Minus the logarithm of the posterior density of the levels at their mode.
    #[getter]
    fn value(&self) -> f64 {
        self.inner.value
    }

    /// Components of the error: name, fall of the log likelihood without it, mean square misfit it explains.
    #[getter]
    fn attribution(&self) -> Vec<(&'static str, f64, f64)> {
        self.inner.attribution.iter().map(|a| (a.name, a.loss, a.misfit)).collect()
    }

    /// Fall of the log likelihood where the robot is taken as exact.
    #[getter]
    fn robot_loss(&self) -> f64 {
        self.inner.robot_loss
    }

    /// Information (n, n) at the mode under the working model.
    #[getter]
    fn information<'py>(&self, py: Python<'py>) -> Floats<'py> {
        convert::dynamic_out(py, &self.inner.information)
    }

    /// Linearisations, steps of the levels, and whether all came to rest.
    #[getter]
    fn effort(&self) -> (usize, usize, bool) {
        (self.inner.rounds, self.inner.steps, self.inner.converged)
    }

    /// Where the start came from.
    #[getter]
    fn origin(&self) -> &'static str {
        self.origin
    }
}
