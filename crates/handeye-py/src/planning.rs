//! Several views at once, and the bound on any choice.

use crate::call::CallCore;
use handeye_core::planning::{Objective, certify as core_certify, select as core_select};
use nalgebra::DMatrix;
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::{invalid, to_python};
use crate::model::square;

/// Registers the functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(select_views, module)?)?;
    module.add_function(wrap_pyfunction!(certify_views, module)?)
}

fn objective(py: Python<'_>, name: &str, tool_points: Option<Array<'_>>) -> PyResult<Objective> {
    match name {
        "entropy" => Ok(Objective::Entropy),
        "entropy_handeye" => Ok(Objective::EntropyHandEye),
        "tool_point" => {
            let points = tool_points.ok_or_else(|| invalid(py, "objective tool_point needs tool_points"))?;
            let points = convert::vectors::<3>(py, "tool_points", &points)?;
            Objective::tool_points(&points).map_err(|e| to_python(py, e))
        }
        other => Err(invalid(
            py,
            &format!("unknown objective \"{other}\"; there are entropy, entropy_handeye, tool_point"),
        )),
    }
}

fn pool(py: Python<'_>, array: &Array<'_>) -> PyResult<Vec<DMatrix<f64>>> {
    let shape = array.shape().to_vec();
    if shape.len() != 3 || shape[1] != shape[2] {
        return Err(invalid(py, "informations must have shape (N, n, n)"));
    }
    let values = convert::in_place(array);
    let size = shape[1] * shape[1];
    Ok((0..shape[0])
        .map(|i| DMatrix::from_row_slice(shape[1], shape[1], &values[i * size..(i + 1) * size]))
        .collect())
}

#[pyfunction]
#[pyo3(signature = (base, informations, k, objective, *, tool_points=None))]
fn select_views<'py>(
    py: Python<'py>,
    base: Array<'py>,
    informations: Array<'py>,
    k: usize,
    objective: &str,
    tool_points: Option<Array<'py>>,
) -> PyResult<(Vec<usize>, f64)> {
    let base = square(py, "base", &base)?;
    let pool = pool(py, &informations)?;
    let objective = self::objective(py, objective, tool_points)?;
    let chosen = py.core(|| core_select(&base, &pool, k, &objective))?.map_err(|e| to_python(py, e))?;
    Ok((chosen.indices, chosen.value))
}

#[pyfunction]
#[pyo3(signature = (base, informations, chosen, objective, *, tool_points=None, iterations=300, tolerance=1e-4))]
#[expect(clippy::too_many_arguments, reason = "one keyword per option")]
fn certify_views<'py>(
    py: Python<'py>,
    base: Array<'py>,
    informations: Array<'py>,
    chosen: Vec<usize>,
    objective: &str,
    tool_points: Option<Array<'py>>,
    iterations: usize,
    tolerance: f64,
) -> PyResult<(f64, f64, f64)> {
    let base = square(py, "base", &base)?;
    let pool = pool(py, &informations)?;
    if let Some(i) = chosen.iter().find(|i| **i >= pool.len()) {
        return Err(invalid(py, &format!("chosen view {i} of {}", pool.len())));
    }
    let objective = self::objective(py, objective, tool_points)?;
    py.core(|| {
        let certificate =
            core_certify(&base, &pool, chosen.len(), &objective, &chosen, iterations, tolerance)?;
        let total = chosen.iter().fold(base.clone(), |sum, i| sum + &pool[*i]);
        let value = objective.value(&total).unwrap_or(f64::NAN);
        let efficiency = objective.efficiency(value, certificate.bound, base.nrows());
        Ok((value, certificate.bound, efficiency))
    })?
    .map_err(|e| to_python(py, e))
}
