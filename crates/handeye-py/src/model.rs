//! The assumptions of a solve, as a Python value.

use handeye_core::least_squares::{ChainPrior, Model as CoreModel};
use nalgebra::{DMatrix, SVector};
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::invalid;

/// Registers the class of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Model>()
}

/// What a solve believes about noise, and about `X` and `Y` beforehand.
#[pyclass(frozen, module = "handeye._core")]
pub struct Model {
    pub inner: CoreModel,
}

/// A square matrix of any size out of an `(n, n)` array.
pub fn square(py: Python<'_>, name: &str, array: &Array<'_>) -> PyResult<DMatrix<f64>> {
    let shape = array.shape();
    if shape.len() != 2 || shape[0] != shape[1] {
        return Err(invalid(py, &format!("{name} must be a square matrix")));
    }
    Ok(DMatrix::from_row_slice(shape[0], shape[1], &convert::in_place(array)))
}

fn twist(py: Python<'_>, name: &str, array: &Array<'_>) -> PyResult<SVector<f64, 6>> {
    let values = convert::scalars(py, name, array)?;
    if values.len() != 6 {
        return Err(invalid(py, &format!("{name} must have 6 entries, found {}", values.len())));
    }
    Ok(SVector::from_column_slice(&values))
}

#[pymethods]
impl Model {
    #[new]
    #[pyo3(signature = (pixel_sigma, *, chain_prior=None))]
    fn new<'py>(
        py: Python<'py>,
        pixel_sigma: Array<'py>,
        chain_prior: Option<(Array<'py>, Array<'py>, Array<'py>, Array<'py>)>,
    ) -> PyResult<Self> {
        let chain_prior = chain_prior
            .map(|(x, y, sigma_x, sigma_y)| {
                PyResult::Ok(ChainPrior {
                    x: convert::transform(py, "chain_prior X", &x)?,
                    y: convert::transform(py, "chain_prior Y", &y)?,
                    sigma_x: twist(py, "chain_prior sigma_x", &sigma_x)?,
                    sigma_y: twist(py, "chain_prior sigma_y", &sigma_y)?,
                })
            })
            .transpose()?;
        Ok(Self {
            inner: CoreModel { pixel_sigma: convert::scalars(py, "pixel_sigma", &pixel_sigma)?, chain_prior },
        })
    }
}

/// `(K, 6, q)` as one matrix per view.
pub fn jacobian_list(py: Python<'_>, array: &Array<'_>) -> PyResult<Vec<DMatrix<f64>>> {
    let shape = array.shape().to_vec();
    if shape.len() != 3 || shape[1] != 6 {
        return Err(invalid(py, "joint Jacobians must have shape (N, 6, q)"));
    }
    let values = convert::in_place(array);
    let size = 6 * shape[2];
    Ok((0..shape[0])
        .map(|k| DMatrix::from_row_slice(6, shape[2], &values[k * size..(k + 1) * size]))
        .collect())
}
