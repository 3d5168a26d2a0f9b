//! Closed-form starts.

use crate::call::CallCore;
use handeye_core::closed_form::{Method, solve};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::to_python;

/// Registers the functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(closed_form, module)?)?;
    module.add_function(wrap_pyfunction!(closed_form_methods, module)?)
}

type TransformPair<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

#[pyfunction]
#[expect(non_snake_case, reason = "the names in Python")]
fn closed_form<'py>(
    py: Python<'py>,
    method: &str,
    A: Array<'py>,
    C: Array<'py>,
) -> PyResult<TransformPair<'py>> {
    let method = Method::from_name(method).map_err(|error| to_python(py, error))?;
    let a = convert::transforms(py, "A", &A)?;
    let c = convert::transforms(py, "C", &C)?;
    let found = py.core(|| solve(method, &a, &c))?.map_err(|error| to_python(py, error))?;
    Ok((convert::matrix_out(py, &found.x.to_matrix()), convert::matrix_out(py, &found.y.to_matrix())))
}

#[pyfunction]
fn closed_form_methods() -> Vec<(&'static str, &'static str, &'static str)> {
    Method::ALL.map(|method| (method.name(), method.family().name(), method.paper())).to_vec()
}
