//! The group of rigid transforms, batched.

use crate::call::CallCore;
use handeye_core::interrupt::checked;
use handeye_core::se3::Se3;
use numpy::{IntoPyArray, PyArray1, PyArrayDyn};
use pyo3::prelude::*;

use crate::convert::{self, Array};

/// Registers the functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(se3_exp, module)?)?;
    module.add_function(wrap_pyfunction!(se3_log, module)?)?;
    module.add_function(wrap_pyfunction!(se3_adjoint, module)?)?;
    module.add_function(wrap_pyfunction!(nearest_rigid, module)?)?;
    module.add_function(wrap_pyfunction!(are_rigid, module)?)
}

#[pyfunction]
fn se3_exp<'py>(py: Python<'py>, xi: Array<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let twists = convert::vectors::<6>(py, "xi", &xi)?;
    let transforms: Vec<Se3> = py.core(|| checked(&twists).map(Se3::exp).collect())?;
    Ok(convert::transforms_out(py, &transforms))
}

#[pyfunction]
#[expect(non_snake_case, reason = "the name in Python")]
fn se3_log<'py>(py: Python<'py>, T: Array<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let transforms = convert::transforms(py, "T", &T)?;
    let twists: Vec<_> = py.core(|| checked(&transforms).map(Se3::log).collect())?;
    Ok(convert::vectors_out(py, &twists))
}

#[pyfunction]
#[expect(non_snake_case, reason = "the name in Python")]
fn se3_adjoint<'py>(py: Python<'py>, T: Array<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let transforms = convert::transforms(py, "T", &T)?;
    let adjoints: Vec<_> = py.core(|| checked(&transforms).map(Se3::adjoint).collect())?;
    Ok(convert::matrices_out(py, &adjoints))
}

#[pyfunction]
#[expect(non_snake_case, reason = "the name in Python")]
fn nearest_rigid<'py>(py: Python<'py>, T: Array<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let transform = convert::transform(py, "T", &T)?;
    Ok(convert::matrix_out(py, &transform.to_matrix()))
}

#[pyfunction]
#[expect(non_snake_case, reason = "the name in Python")]
fn are_rigid<'py>(py: Python<'py>, T: Array<'py>, tolerance: f64) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let entries = convert::row_major::<4, 4>(py, "T", &T)?;
    let (each, _) = entries.as_chunks::<16>();
    Ok(each.iter().map(|m| Se3::is_rigid(m, tolerance)).collect::<Vec<_>>().into_pyarray(py))
}
