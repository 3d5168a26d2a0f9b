//! What views say of X and Y without any prior belief.

use handeye_core::estimation::chain_information;
use handeye_core::least_squares::Side;
use nalgebra::Matrix6;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::call::CallCore;
use crate::convert::{self, Array};
use crate::errors::{invalid, to_python};

/// Registers the functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(chain_information_py, module)?)
}

/// Information of the twists of X and Y; see the type stub.
#[pyfunction]
#[pyo3(name = "chain_information", signature = (x, forward, information, sigmas_px, *, left=None, right=None))]
fn chain_information_py<'py>(
    py: Python<'py>,
    x: Array<'py>,
    forward: Array<'py>,
    information: Array<'py>,
    sigmas_px: Array<'py>,
    left: Option<Array<'py>>,
    right: Option<Array<'py>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let x = convert::transform(py, "x", &x)?;
    let forward = convert::transforms(py, "forward", &forward)?;
    let information = convert::matrices::<6, 6>(py, "information", &information)?;
    let sigmas = convert::scalars(py, "sigmas_px", &sigmas_px)?;
    if information.len() != forward.len() || sigmas.len() != forward.len() {
        return Err(invalid(py, "as many poses, information and deviations as views are needed"));
    }
    let root = |side, given: Array<'py>| {
        Ok::<_, PyErr>((side, convert::matrix::<6, 6>(py, "root of the robot's error", &given)?))
    };
    let robot = match (left, right) {
        (None, None) => None,
        (Some(given), None) => Some(root(Side::Left, given)?),
        (None, Some(given)) => Some(root(Side::Right, given)?),
        _ => return Err(invalid(py, "the robot errs on one side")),
    };
    let pixels: Vec<(Matrix6<f64>, f64)> = information.into_iter().zip(sigmas).collect();
    let found = py.core(|| chain_information(&x, &forward, &pixels, robot))?.map_err(|e| to_python(py, e))?;
    Ok(convert::matrix_out(py, &found))
}
